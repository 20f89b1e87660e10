/* Breaks and steps, as a debugger asks for them. */
#include "tests/unit/board/cpu_machine.h"

#include <functional>

namespace
{

using namespace machine;

struct CpuDebug : Cpu {
    std::vector<uint32_t> stops; /* offsets in the program */
    std::function<cpu_debug_t()> decide = [] { return CPU_GO; };

    void attach()
    {
        cpu_debug(cpu, this, [](void *owner) {
            auto *self = static_cast<CpuDebug *>(owner);
            self->stops.push_back(cpu_pc(self->cpu) - main_code);
            return self->decide();
        });
    }

    void step_from_start(size_t count)
    {
        attach();
        decide = [this, count] { return stops.size() < count ? CPU_STEP : CPU_GO; };
        cpu_ask_debugger(cpu);
    }
};

constexpr uint16_t cmp_r0(int value)
{
    return static_cast<uint16_t>(0x2800 | value);
}

constexpr uint16_t bne_back_2 = 0xD1FC; /* to two instructions before it */

TEST_F(CpuDebug, StopsWithinABlockAndContinues)
{
    start({movs(0, 1), movs(1, 2), movs(2, 3), movs(3, 4), here});
    attach();
    std::vector<uint32_t> seen;
    decide = [&] {
        seen = {r(0), r(1), r(2), r(3)};
        return CPU_GO;
    };
    ASSERT_TRUE(cpu_break(cpu, main_code + 4, true));
    run(30);
    EXPECT_EQ(stops, std::vector<uint32_t>{4});
    EXPECT_EQ(seen, (std::vector<uint32_t>{1, 2, 0, 0}));
    EXPECT_EQ(r(3), 4U);
}

TEST_F(CpuDebug, StopsInEveryRoundOfALoop)
{
    start({movs(0, 0), adds(0, 1), cmp_r0(4), bne_back_2, here});
    attach();
    ASSERT_TRUE(cpu_break(cpu, main_code + 4, true));
    run(60);
    EXPECT_EQ(stops, (std::vector<uint32_t>{4, 4, 4, 4}));
    EXPECT_EQ(r(0), 4U);
}

TEST_F(CpuDebug, StopsAtTheFirstInstructionOfABlockOnceARound)
{
    start({movs(0, 0), adds(0, 1), cmp_r0(3), bne_back_2, here});
    attach();
    ASSERT_TRUE(cpu_break(cpu, main_code + 2, true));
    run(60);
    EXPECT_EQ(stops, (std::vector<uint32_t>{2, 2, 2}));
}

TEST_F(CpuDebug, ARemovedBreakpointNoLongerStops)
{
    start({movs(0, 0), adds(0, 1), cmp_r0(9), bne_back_2, here});
    attach();
    ASSERT_TRUE(cpu_break(cpu, main_code + 4, true));
    decide = [this] {
        EXPECT_TRUE(stops.size() < 2 || cpu_break(cpu, main_code + 4, false));
        return CPU_GO;
    };
    run(100);
    EXPECT_EQ(stops.size(), 2U);
    EXPECT_EQ(r(0), 9U);
}

TEST_F(CpuDebug, StepsFollowTheProgram)
{
    start({movs(0, 0), adds(0, 1), cmp_r0(2), bne_back_2, nop, here});
    step_from_start(10);
    run(60);
    EXPECT_EQ(stops, (std::vector<uint32_t>{0, 2, 4, 6, 2, 4, 6, 8, 10, 10}));
}

TEST_F(CpuDebug, AStepOverAnItBlockEndsBehindIt)
{
    start({cmp_r0(1), 0xBF0C /* ite eq */, movs(1, 1), movs(1, 2), movs(2, 3), here});
    step_from_start(4);
    run(40);
    EXPECT_EQ(stops, (std::vector<uint32_t>{0, 2, 8, 10}));
    EXPECT_EQ(r(1), 2U);
    EXPECT_EQ(r(2), 3U);
}

TEST_F(CpuDebug, CountsTheSameInstructions)
{
    const std::vector<uint16_t> program = {movs(0, 0), adds(0, 1), cmp_r0(50), bne_back_2, bkpt};
    cpu_on_breakpoint(cpu, nullptr, [](void *, uint8_t) { return false; });
    start(program);
    run(10000);
    const uint64_t alone = cpu_instructions(cpu);
    start(program);
    attach();
    ASSERT_TRUE(cpu_break(cpu, main_code + 4, true));
    run(10000);
    EXPECT_EQ(stops.size(), 50U);
    EXPECT_EQ(cpu_instructions(cpu) - alone, alone);
    stops.clear();
    start(program);
    ASSERT_TRUE(cpu_break(cpu, main_code + 4, false));
    step_from_start(1000);
    run(10000);
    EXPECT_EQ(cpu_instructions(cpu) - 2 * alone, alone);
    EXPECT_EQ(stops.size(), alone);
}

TEST_F(CpuDebug, StepsGoIntoAnInterrupt)
{
    handler(16 + 3, {movs(4, 7), bx_lr});
    start({nop, nop, nop, nop, here});
    enable_line(3, 0x10);
    run(1);
    step_from_start(3);
    cpu_irq(cpu, 3, true);
    run(40);
    ASSERT_GE(stops.size(), 2U);
    EXPECT_EQ(stops[1], flash + 0x800 + 0x20U * 19U - main_code);
}

TEST_F(CpuDebug, TimeStopsAndRegistersCanBeChanged)
{
    start({movs(0, 1), movs(1, 2), here});
    attach();
    uint64_t at = 0;
    decide = [&] {
        at = cpu_now(cpu);
        cpu_set_register(cpu, 1, 77);
        cpu_set_register(cpu, 15, main_code + 4);
        return CPU_GO;
    };
    ASSERT_TRUE(cpu_break(cpu, main_code + 2, true));
    run(20);
    EXPECT_LE(at, 6U);
    EXPECT_EQ(r(0), 1U);
    EXPECT_EQ(r(1), 77U);
}

TEST_F(CpuDebug, AskingStopsASleepingProcessor)
{
    start({wfi, here});
    run(20);
    ASSERT_TRUE(cpu_sleeping(cpu));
    attach();
    cpu_ask_debugger(cpu);
    run(20);
    EXPECT_EQ(stops, std::vector<uint32_t>{2});
}

TEST_F(CpuDebug, WithoutADebuggerNothingStops)
{
    start({movs(0, 0), adds(0, 1), here});
    attach();
    ASSERT_TRUE(cpu_break(cpu, main_code + 2, true));
    cpu_debug(cpu, nullptr, nullptr);
    cpu_ask_debugger(cpu);
    run(20);
    EXPECT_TRUE(stops.empty());
    EXPECT_EQ(r(0), 1U);
}

} // namespace
