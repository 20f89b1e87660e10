/* Interrupts and faults as a device and the outside see them; the model itself is compared with QEMU's by
 * tests/target/emulator. */
#include "tests/unit/board/cpu_machine.h"

namespace
{

using namespace machine;

constexpr uint32_t AIRCR = 0xE000ED0C, SHCSR = 0xE000ED24, CFSR = 0xE000ED28;

struct CpuExceptions : Cpu {
    const std::vector<uint16_t> idle = {adds(7, 1), 0xE7FD};

    const cpu_exception_stats_t &stats(int exception)
    {
        return *cpu_exception_stats(cpu, exception);
    }
};

TEST_F(CpuExceptions, ALineInterruptsAsLongAsItIsHigh)
{
    handler(16 + 3, {adds(4, 1), 0x4770});
    start(idle);
    enable_line(3, 0x40);
    cpu_irq(cpu, 3, true);
    run(200);
    cpu_irq(cpu, 3, false);
    run(50);
    EXPECT_GE(stats(19).count, 5U) << "taken again after each return";
    const uint64_t before = stats(19).count;
    run(200);
    EXPECT_EQ(stats(19).count, before);
    EXPECT_EQ(r(4), before);
}

TEST_F(CpuExceptions, FiguresOfOneHandler)
{
    handler(16 + 3, {movs(0, 1), movs(0, 2), bx_lr});
    start(idle);
    enable_line(3, 0x40);
    cpu_clear_stats(cpu);
    cpu_irq(cpu, 3, true);
    cpu_irq(cpu, 3, false);
    run(100);
    EXPECT_EQ(stats(19).count, 1U);
    EXPECT_EQ(stats(19).instructions, 3U);
    EXPECT_EQ(stats(19).instructions_least, 3U);
    EXPECT_EQ(stats(19).instructions_most, 3U);
    EXPECT_EQ(stats(19).cycles_typical, 12U + 2U + 3U + 10U);
    EXPECT_LE(stats(19).latency_most, 4U);
    EXPECT_GT(cpu_cycles_in_thread(cpu), 50U);
}

/* The handler of line 3 pends line 5, which is more urgent; its instructions are not line 3's. */
TEST_F(CpuExceptions, PreemptionIsNotCounted)
{
    handler(16 + 3, {str(1, 0), 0xF3BF, 0x8F6F, nop, bx_lr});
    handler(16 + 5, {nop, nop, nop, nop, nop, nop, bx_lr});
    start(idle, {0xE000E200, 1U << 5});
    enable_line(3, 0x40);
    enable_line(5, 0x20);
    cpu_set_register(cpu, 0, 0xE000E200);
    cpu_set_register(cpu, 1, 1U << 5);
    cpu_irq(cpu, 3, true);
    cpu_irq(cpu, 3, false);
    run(100);
    EXPECT_EQ(stats(19).instructions, 4U);
    EXPECT_EQ(stats(21).instructions, 7U);
    EXPECT_EQ(stats(21).count, 1U);
}

TEST_F(CpuExceptions, TailChainingSavesTheFrame)
{
    handler(16 + 3, {bx_lr});
    handler(16 + 5, {bx_lr});
    start(idle);
    enable_line(3, 0x40);
    enable_line(5, 0x40);
    struct Entry {
        cpu_t *cpu;
        std::vector<uint32_t> sp;
    } entry{cpu, {}};
    cpu_trace(cpu, &entry, [](void *owner, int, bool in) {
        auto *e = static_cast<Entry *>(owner);
        if (in) {
            e->sp.push_back(cpu_register(e->cpu, 13));
        }
    });
    for (const int irq : {5, 3}) {
        cpu_irq(cpu, irq, true);
        cpu_irq(cpu, irq, false);
    }
    const uint64_t before = cpu_now(cpu);
    run(100);
    ASSERT_EQ(entry.sp.size(), 2U);
    EXPECT_EQ(entry.sp[0], stack_top - 32);
    EXPECT_EQ(entry.sp[1], stack_top - 32);
    EXPECT_EQ(stats(19).cycles_typical, 12U + 3U) << "leaves the frame to the next";
    EXPECT_EQ(stats(21).cycles_typical, 6U + 3U + 10U);
    EXPECT_GE(stats(21).latency_most, 12U + 3U);
    EXPECT_GT(cpu_now(cpu), before);
}

TEST_F(CpuExceptions, NmiIsALineToo)
{
    handler(2, {adds(4, 1), bx_lr});
    start({cpsid, adds(7, 1), 0xE7FD});
    run(20);
    cpu_irq(cpu, CPU_NMI, true);
    cpu_irq(cpu, CPU_NMI, false);
    run(60);
    EXPECT_EQ(r(4), 1U);
}

TEST_F(CpuExceptions, SleepEndsWithAnInterrupt)
{
    handler(16 + 3, {adds(4, 1), bx_lr});
    start({wfi, adds(7, 1), 0xE7FC});
    run(50);
    EXPECT_TRUE(cpu_sleeping(cpu));
    EXPECT_EQ(r(7), 0U);
    EXPECT_GT(cpu_cycles_asleep(cpu), 30U);
    start({wfi, adds(7, 1), 0xE7FC});
    enable_line(3, 0x40);
    run(30);
    EXPECT_EQ(r(7), 0U);
    cpu_irq(cpu, 3, true);
    cpu_irq(cpu, 3, false);
    run(60);
    EXPECT_EQ(r(4), 1U);
    EXPECT_EQ(r(7), 1U);
    EXPECT_TRUE(cpu_sleeping(cpu));
}

TEST_F(CpuExceptions, AMaskedInterruptEndsSleepAllTheSame)
{
    handler(16 + 3, {adds(4, 1), bx_lr});
    start({cpsid, wfi, adds(7, 1), here});
    enable_line(3, 0x40);
    run(30);
    EXPECT_TRUE(cpu_sleeping(cpu));
    cpu_irq(cpu, 3, true);
    run(30);
    EXPECT_EQ(r(7), 1U);
    EXPECT_EQ(r(4), 0U);
}

TEST_F(CpuExceptions, WaitForEvent)
{
    start({sev, wfe, adds(7, 1), wfe, adds(7, 1), here});
    run(50);
    EXPECT_EQ(r(7), 1U) << "the first event was there, the second is not";
    EXPECT_TRUE(cpu_sleeping(cpu));
}

TEST_F(CpuExceptions, SysTickComesRegularly)
{
    handler(15, {adds(4, 1), bx_lr});
    start(idle);
    write_register(0xE000E014, 999);
    write_register(0xE000E018, 0);
    write_register(0xE000E010, 7);
    run(10500);
    EXPECT_EQ(r(4), 10U);
    write_register(0xE000E010, 0);
    run(5000);
    EXPECT_EQ(r(4), 10U);
}

TEST_F(CpuExceptions, TheCycleCounterIsTheTime)
{
    start({ldr(2, 0), 0xE7FF, ldr(3, 0), here}, {0xE0001004});
    write_register(0xE000EDFC, 0x01000000);
    write_register(0xE0001000, 1);
    run(20);
    EXPECT_EQ(r(3) - r(2), 2U + 3U) << "a load and a branch; both reads see the end of their block";
}

TEST_F(CpuExceptions, ResetIsAskedForWithTheKeyOnly)
{
    start(idle);
    write_register(AIRCR, 4);
    EXPECT_FALSE(cpu_reset_asked(cpu));
    write_register(AIRCR, 0x05FA0004);
    EXPECT_TRUE(cpu_reset_asked(cpu));
    EXPECT_FALSE(cpu_locked_up(cpu));
    start(idle);
    EXPECT_FALSE(cpu_reset_asked(cpu));
}

TEST_F(CpuExceptions, SecondFaultLocksUp)
{
    handler(3, {undefined});
    start({undefined});
    run(100);
    EXPECT_TRUE(cpu_locked_up(cpu));
    EXPECT_TRUE(cpu_reset_asked(cpu));
}

/* r0 is left as the frame's PC by the handler. */
TEST_F(CpuExceptions, BadAddressIsABusFaultAtItsInstruction)
{
    handler(3, {0x9806 /* ldr r0, [sp, #24] */, ldr(5, 6, 0), ldr(4, 6, 0x10), here});
    start({nop, nop, ldr(1, 0), adds(7, 1), here}, {0x90000000, 0, 0, 0, 0, 0, CFSR});
    run(100);
    EXPECT_EQ(r(0), main_code + 4);
    EXPECT_EQ(r(5), 0x8200U);
    EXPECT_EQ(r(4), 0x90000000U);
    EXPECT_EQ(r(7), 0U);
}

TEST_F(CpuExceptions, StackOverflowMeetsItsGuard)
{
    handler(4, {movs(4, 4), here});
    handler(3, {movs(4, 3), ldr(5, 6, 0), here});
    start({0xB4FF /* push {r0-r7} */, 0xE7FD}, {1, 2, 3, 4, 0, 6, CFSR, 8});
    write_register(0xE000ED98, 0);
    write_register(0xE000ED9C, ram);
    write_register(0xE000EDA0, (1U << 28) | (7 << 1) | 1); /* 256 bytes without access */
    write_register(0xE000ED94, 5);
    write_register(SHCSR, 1U << 16);
    cpu_set_register(cpu, 6, CFSR);
    run(3000);
    EXPECT_EQ(r(4), 4U)
        << "the guard is below: the frame of the fault does not fit, its handler runs all the same";
    EXPECT_EQ(get(ram + 0xFC), 0U) << "the guard is untouched";
}

TEST_F(CpuExceptions, BreakpointWithoutADebuggerIsAnError)
{
    start({nop, bkpt});
    EXPECT_NE(failure(20).find("breakpoint 7; PC 0x08000402"), std::string::npos);
}

TEST_F(CpuExceptions, FloatingPointHasToBeSwitchedOn)
{
    handler(3, {ldr(5, 6, 0), here});
    start({0xEE30, 0x0A20 /* vadd.f32 s0, s0, s1 */, adds(7, 1), here}, {0, 0, 0, 0, 0, 0, CFSR});
    run(100);
    EXPECT_EQ(r(5), 0x00080000U) << "NOCP";
    start({0xEE30, 0x0A20, adds(7, 1), here});
    write_register(0xE000ED88, 0xFU << 20);
    run(20);
    EXPECT_EQ(r(7), 1U);
}

TEST_F(CpuExceptions, SystemRegistersNobodyModelsAreErrors)
{
    start({str(1, 0), here}, {0xE000EF90, 1});
    EXPECT_NE(failure(20).find("not modelled in system control space"), std::string::npos) << cpu_error(cpu);
}

} // namespace
