/* Execution, memories, bus and time. */
#include "tests/unit/board/cpu_machine.h"

namespace
{

using namespace machine;

struct CpuRun : Cpu {
};

TEST_F(CpuRun, StartsFromTheVectorTable)
{
    start({movs(0, 7), here});
    EXPECT_EQ(r(13), stack_top);
    run(10);
    EXPECT_EQ(r(0), 7U);
    EXPECT_EQ(cpu_pc(cpu), main_code + 2);
}

TEST_F(CpuRun, CountsInstructionsAndCycles)
{
    start({movs(0, 0), adds(0, 1), 0x2864 /* cmp r0, #100 */, 0xD1FC /* bne back to adds */, bkpt});
    cpu_on_breakpoint(cpu, nullptr, [](void *, uint8_t number) { return number != 7; });
    run(10000);
    EXPECT_TRUE(cpu_reset_asked(cpu)) << "the handler has ended the run";
    EXPECT_EQ(r(0), 100U);
    EXPECT_EQ(cpu_instructions(cpu), 1U + 3U * 100U + 1U);
    EXPECT_EQ(cpu_now(cpu), 1U + 3U * 100U + 2U * 99U + 1U) << "a taken branch refills";
    EXPECT_EQ(cpu_cycles_low(cpu), 1U + 3U * 100U + 99U + 1U);
    EXPECT_EQ(cpu_cycles_high(cpu), 1U + 3U * 100U + 3U * 99U + 1U);
}

TEST_F(CpuRun, StoppingAnywhereChangesNothing)
{
    start({movs(0, 0), adds(0, 1), 0x28C8, 0xD1FC, here});
    while (cpu_pc(cpu) != main_code + 8) {
        run(1);
    }
    EXPECT_EQ(r(0), 200U);
    const uint64_t instructions = cpu_instructions(cpu);
    start({movs(0, 0), adds(0, 1), 0x28C8, 0xD1FC, bkpt});
    cpu_on_breakpoint(cpu, nullptr, [](void *, uint8_t) { return false; });
    run(10000);
    EXPECT_NEAR(static_cast<double>(cpu_instructions(cpu) - instructions), 601.0 + 1.0, 1.0);
}

TEST_F(CpuRun, DivisionTakesTimeByItsOperands)
{
    const std::vector<uint16_t> program = {0xFBB1, 0xF0F2, bkpt}; /* udiv r0, r1, r2 */
    cpu_on_breakpoint(cpu, nullptr, [](void *, uint8_t) { return false; });
    start(program, {0, 100, 7});
    const uint64_t before = cpu_now(cpu);
    run(100);
    EXPECT_EQ(r(0), 14U);
    const uint64_t some = cpu_now(cpu) - before;
    start(program, {0, UINT32_MAX, 1});
    const uint64_t again = cpu_now(cpu);
    run(100);
    EXPECT_EQ(r(0), UINT32_MAX);
    EXPECT_EQ(some, 5U + 1U);
    EXPECT_EQ(cpu_now(cpu) - again, 11U + 1U);
}

TEST_F(CpuRun, BothViewsOfAMemoryAreOne)
{
    start({str(1, 0), ldr(2, 3), here}, {ccm_alias + 8, 0x12345678, 0, ccm + 8});
    run(20);
    EXPECT_EQ(r(2), 0x12345678U);
    EXPECT_EQ(get(ccm + 8), 0x12345678U);
}

TEST_F(CpuRun, CodeWrittenOverIsExecuted)
{
    code(ccm, {movs(0, 1), bx_lr});
    start({0x47A0 /* blx r4 */, 0x8035 /* strh r5, [r6] */, 0x47A0, here},
          {0, 0, 0, 0, ccm | 1, movs(0, 9), ccm});
    run(7);
    EXPECT_EQ(r(0), 1U);
    run(50);
    EXPECT_EQ(r(0), 9U);
}

/* The page has been data alone so far, so that stores to it have taken the fast way. */
TEST_F(CpuRun, CodeWrittenIntoDataIsExecutedAndCanBeWrittenOver)
{
    start({0x8035 /* strh r5, [r6] */, 0x8077 /* strh r7, [r6, #2] */, 0x8035, 0x47A0 /* blx r4 */, 0x3505,
           0x8035, 0x47A0, here},
          {0, 0, 0, 0, (ram + 0x801) | 1, movs(0, 4), ram + 0x800, bx_lr});
    run(12);
    EXPECT_EQ(r(0), 4U);
    run(50);
    EXPECT_EQ(r(0), 9U);
}

/* As a start-up copies code: unicorn does not see it at once, but from reset on. */
TEST_F(CpuRun, CodeWrittenThroughTheOtherViewIsExecutedAfterReset)
{
    code(ccm, {movs(0, 1), bx_lr});
    start({0x47A0, 0x8035, here}, {0, 0, 0, 0, ccm | 1, movs(0, 9), ccm_alias});
    run(50);
    start({0x47A0, here}, {0, 0, 0, 0, ccm | 1});
    run(50);
    EXPECT_EQ(r(0), 9U);
}

TEST_F(CpuRun, ProgrammedFlashIsExecutedAnew)
{
    start({movs(0, 1), adds(1, 1), 0xE7FC /* b back */});
    run(30);
    EXPECT_EQ(r(0), 1U);
    code(main_code, {movs(0, 5)});
    cpu_code_changed(cpu, main_code, 2);
    run(30);
    EXPECT_EQ(r(0), 5U);
}

TEST_F(CpuRun, BlocksAreCounted)
{
    start({movs(0, 0), adds(0, 1), 0x2805, 0xD1FC, here});
    run(40);
    struct Seen {
        uint64_t instructions = 0, loop_hits = 0;
    } seen;
    cpu_visit_blocks(
        cpu,
        [](void *context, uint32_t address, uint32_t, uint32_t instructions, uint64_t hits) {
            auto *s = static_cast<Seen *>(context);
            s->instructions += instructions * hits;
            s->loop_hits += address == main_code + 2 ? hits : 0;
        },
        &seen);
    EXPECT_EQ(seen.instructions, cpu_instructions(cpu));
    EXPECT_EQ(seen.loop_hits, 4U) << "the first round is one block with the move";
}

TEST_F(CpuRun, WatchesSeeEveryArrival)
{
    struct Watch {
        cpu_t *cpu;
        std::vector<uint32_t> seen;
    } watch{cpu, {}};
    start({movs(0, 0), adds(0, 1), 0x2805, 0xD1FC, here});
    cpu_watch(cpu, main_code + 2, &watch, [](void *owner, uint32_t) {
        auto *w = static_cast<Watch *>(owner);
        w->seen.push_back(cpu_register(w->cpu, 0));
    });
    run(60);
    EXPECT_EQ(watch.seen, (std::vector<uint32_t>{1, 2, 3, 4}));
}

struct Device {
    uint32_t word = 0xA5A5A5A5, offset = 0, mask = 0;
    int reads = 0, writes = 0;
    cpu_t *cpu = nullptr;
};

bool device_read(void *self, uint32_t offset, uint32_t *value)
{
    auto *device = static_cast<Device *>(self);
    device->reads++;
    *value = device->word;
    return offset < 0x10;
}

bool device_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    auto *device = static_cast<Device *>(self);
    device->writes++;
    device->offset = offset;
    device->word = value;
    device->mask = mask;
    if (offset == 0xC) {
        cpu_fail(device->cpu, "the device says no to 0x%x", value);
    }
    return offset < 0x10;
}

struct CpuBus : Cpu {
    Device device;

    void SetUp() override
    {
        Cpu::SetUp();
        device.cpu = cpu;
        const cpu_device_t block = {"TIM9", 0x40012000, 0x400, &device, device_read, device_write};
        cpu_add_device(cpu, &block);
    }
};

TEST_F(CpuBus, ReachesItsDevice)
{
    start({ldr(1, 0), 0x7042 /* strb r2, [r0, #1] */, here}, {0x40012004, 0, 0x77});
    run(20);
    EXPECT_EQ(r(1), 0xA5A5A5A5U);
    EXPECT_EQ(device.reads, 1);
    EXPECT_EQ(device.writes, 1);
    EXPECT_EQ(device.offset, 4U);
    EXPECT_EQ(device.mask, 0xFF00U);
    EXPECT_EQ(device.word & 0xFF00U, 0x7700U);
}

TEST_F(CpuBus, RefusedRegisterNamesEverything)
{
    start({nop, nop, str(1, 0), nop, here}, {0x40012010, 0x1234});
    const std::string text = failure(20);
    EXPECT_NE(text.find("0x40012010"), std::string::npos) << text;
    EXPECT_NE(text.find("0x1234"), std::string::npos) << text;
    EXPECT_NE(text.find("TIM9"), std::string::npos) << text;
    EXPECT_NE(text.find("PC 0x08000404"), std::string::npos) << text;
}

TEST_F(CpuBus, MissingDeviceIsAnError)
{
    start({nop, ldr(1, 0), here}, {0x40013000});
    const std::string text = failure(20);
    EXPECT_NE(text.find("read of 0x40013000: no device"), std::string::npos) << text;
    EXPECT_NE(text.find("PC 0x08000402"), std::string::npos) << text;
    EXPECT_FALSE(cpu_run(cpu, UINT64_MAX)) << "stays failed";
    start({here});
    EXPECT_TRUE(cpu_run(cpu, cpu_now(cpu) + 10)) << "until reset";
}

TEST_F(CpuBus, ADeviceCanEndTheRun)
{
    start({str(1, 0, 0xC), str(1, 0), here}, {0x40012000, 3});
    EXPECT_NE(failure(20).find("the device says no to 0x3"), std::string::npos);
    EXPECT_EQ(device.writes, 1) << "nothing reaches a device after that";
}

struct FlashDevice {
    cpu_t *cpu;
    std::vector<std::pair<uint32_t, uint32_t>> writes;
    uint64_t stall_until = 0;
};

bool flash_write(void *self, uint32_t offset, uint32_t value, uint32_t)
{
    auto *device = static_cast<FlashDevice *>(self);
    device->writes.emplace_back(offset, value);
    if (device->stall_until != 0) {
        cpu_stall(device->cpu, flash, device->stall_until);
    }
    return true;
}

struct CpuFlash : Cpu {
    FlashDevice device{};

    void SetUp() override
    {
        Cpu::SetUp();
        device.cpu = cpu;
        const cpu_device_t block = {"flash", flash, 0x1000, &device, nullptr, flash_write};
        cpu_add_device(cpu, &block);
    }
};

TEST_F(CpuFlash, WritesGoToTheDeviceAndNotToMemory)
{
    start({str(1, 0), str(2, 0, 4), here}, {flash + 0xF00, 0x11, 0x22});
    run(30);
    EXPECT_EQ(device.writes, (std::vector<std::pair<uint32_t, uint32_t>>{{0xF00, 0x11}, {0xF04, 0x22}}));
    EXPECT_EQ(get(flash + 0xF00), UINT32_MAX);
    EXPECT_EQ(get(flash + 0xF04), UINT32_MAX);
}

TEST_F(CpuFlash, CodeInFlashWaitsWhileItIsBusyAndOtherCodeDoesNot)
{
    device.stall_until = 5000;
    code(ccm, {str(1, 0), adds(2, 1), 0xE7FD /* b to the adds */});
    start({str(1, 0), 0xE7FF /* b on */, adds(2, 1), 0xE7FD}, {flash + 0xF00, 0x11});
    run(1000);
    EXPECT_EQ(r(2), 0U);
    run(5000);
    EXPECT_GT(r(2), 100U);
    device.stall_until = cpu_now(cpu) + 5000;
    start({here}, {flash + 0xF00, 0x11});
    cpu_set_register(cpu, 15, ccm);
    run(1000);
    EXPECT_GT(r(2), 100U);
}

TEST_F(CpuFlash, LoadsFromBusyFlashWait)
{
    device.stall_until = 5000;
    code(ccm, {str(1, 0), 0xE7FF /* b on */, ldr(3, 0), 0xE7FF, here});
    start({here}, {flash + 0xF00, 0x11});
    cpu_set_register(cpu, 15, ccm);
    run(10);
    EXPECT_GE(cpu_now(cpu), 5000U);
    run(10);
    EXPECT_EQ(r(3), UINT32_MAX);
}

TEST_F(CpuRun, WaitStatesCostInFlashAlone)
{
    cpu_set_wait_states(cpu, flash, 4);
    start({nop, nop, nop, nop, here});
    run(1);
    const uint64_t cold = cpu_now(cpu);
    EXPECT_EQ(cold, 4U + 3U + 4U + 2U) << "four and a branch; two words of eight bytes";
    cpu_reset(cpu, flash);
    run(1);
    EXPECT_EQ(cpu_now(cpu) - cold, 7U) << "now in the cache";
}

TEST_F(CpuRun, AlarmsComeBetweenBlocksInTime)
{
    struct Alarm {
        cpu_t *cpu;
        uint64_t at = 0;
    } alarm{cpu};
    start({adds(0, 1), 0xE7FD});
    cpu_alarm(cpu, &alarm, 100, [](void *owner, uint64_t cycle) {
        static_cast<Alarm *>(owner)->at = cpu_now(static_cast<Alarm *>(owner)->cpu);
        EXPECT_EQ(cycle, 100U);
    });
    run(200);
    EXPECT_GE(alarm.at, 100U);
    EXPECT_LT(alarm.at, 105U);
}

TEST_F(CpuRun, AHaltedProcessorLetsTimePass)
{
    start({adds(0, 1), 0xE7FD});
    cpu_halt(cpu, true);
    run(1000);
    EXPECT_EQ(cpu_now(cpu), 1000U);
    EXPECT_EQ(r(0), 0U);
    cpu_halt(cpu, false);
    run(100);
    EXPECT_GT(r(0), 10U);
}

} // namespace
