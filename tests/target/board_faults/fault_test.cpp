// Faults that the image has to survive with the bridge off, without a reset.
#include "bench.h"

#include <algorithm>
#include <cmath>

namespace
{

using bench::Bench;

// A short between the two terminals that differ most, 0.05 ohm and 1 uH.
void short_terminals(const Bench &b)
{
    const uint32_t *compare = &board_inside(b.board)->tim1.regs.value[0x34 / 4];
    const auto [least, most] = std::minmax_element(compare, compare + 3);
    plant_set_short(b.plant, static_cast<int>(least - compare), static_cast<int>(most - compare), 0.05);
}

// The processor stands still: only comparators and timer are left. The short carries a steep current in every
// active vector.
TEST(BoardFault, OverCurrentOpensTheBridgeWithoutTheProcessor)
{
    Bench b;
    b.running();
    cpu_halt(board_cpu(b.board), true);
    short_terminals(b);
    b.run_ms(1);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_NE(board_inside(b.board)->tim1.regs.value[0x10 / 4] & 0x80u, 0u);
    EXPECT_EQ(board_resets(b.board), 0u);
}

TEST(BoardFault, TheSameWithoutComparatorsStaysOn)
{
    Bench b;
    b.running();
    cpu_halt(board_cpu(b.board), true);
    plant_set_break(b.plant, nullptr);
    short_terminals(b);
    b.run_ms(1);
    EXPECT_TRUE(b.bridge_on());
}

// The port asks for it (DBGMCU): no voltage stays applied at a breakpoint, and a breakpoint is no dead
// program.
TEST(BoardFault, DebuggerThatStopsTheProcessorOpensTheBridge)
{
    Bench b;
    b.running();
    board_halt(b.board, true);
    EXPECT_FALSE(b.bridge_on()); // at once
    b.run_ms(100);               // five times the watchdog's
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(board_resets(b.board), 0u);
}

TEST(BoardFault, BreakInputOpensAndBarsArming)
{
    Bench b;
    b.running();
    board_hold_break(b.board, true);
    EXPECT_FALSE(b.bridge_on()); // at once
    b.run_ms(5);
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_HARDWARE);
    b.command(false, DRIVE_MODE_CURRENT, 0, 0, true);
    b.run_ms(5);
    b.command(true);
    b.run_ms(50);
    EXPECT_FALSE(b.bridge_on());
    board_hold_break(b.board, false);
    b.run_ms(5);
    b.command(false, DRIVE_MODE_CURRENT, 0, 0, false);
    b.run_ms(5);
    b.command(false, DRIVE_MODE_CURRENT, 0, 0, true);
    b.run_ms(5);
    b.command(true);
    b.run_ms(300);
    EXPECT_TRUE(b.bridge_on()) << b.console();
    EXPECT_EQ(board_resets(b.board), 0u);
}

// Its supply sinks below what the converters' reference needs, above what resets the processor.
TEST(BoardFault, ALowSupplyOfTheProcessorOpensTheBridgeAtOnceAndStaysAFault)
{
    Bench b;
    b.running();
    board_set_supply(b.board, 3.0);
    b.run_ms(1);
    EXPECT_TRUE(b.bridge_on());
    board_set_supply(b.board, 2.7);
    EXPECT_FALSE(b.bridge_on()); // without the processor
    b.run_ms(5);
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_HARDWARE);
    b.command(false, DRIVE_MODE_CURRENT, 0, 0, true);
    b.run_ms(5);
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_HARDWARE); // the cause is still there
    board_set_supply(b.board, 3.3);
    b.run_ms(100);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(board_resets(b.board), 0u);
}

TEST(BoardFault, BusOffIsAFaultAndTheBusRecovers)
{
    Bench b;
    b.running();
    board_can_error(b.board, true);
    b.run_ms(5);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_REMOTE_LOST);
    b.run_ms(50);
    board_frame_t frame = {0x7FF, 0, {}};
    EXPECT_TRUE(board_can_send(b.board, &frame));
}

TEST(BoardFault, SilenceOfTheMasterIsAFault)
{
    Bench b;
    b.running();
    b.run_ms(390);
    EXPECT_TRUE(b.bridge_on()); // 490 ms since the last command
    b.run_ms(20);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_REMOTE_LOST);
}

TEST(BoardFault, ABrokenTemperatureSensorIsAFault)
{
    Bench b;
    b.running();
    board_set_temperature(b.board, -200.0);
    b.run_ms(10);
    EXPECT_FALSE(b.bridge_on());
    EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_TEMPERATURE_SENSOR);
}

// Above the voltage detector's threshold, or too high: currents and voltages are read wrong by as much.
TEST(BoardFault, ASupplyThatIsNoReferenceIsAFault)
{
    for (const double supply_V : {3.05, 3.55}) {
        Bench b;
        b.running();
        board_set_supply(b.board, supply_V);
        b.run_ms(10);
        EXPECT_FALSE(b.bridge_on()) << supply_V;
        EXPECT_EQ(b.watched()->drive.fault, DRIVE_FAULT_SENSOR_REFERENCE) << supply_V;
    }
}

TEST(BoardFault, ASupplyWithinItsToleranceIsNone)
{
    for (const double supply_V : {3.2, 3.4}) {
        Bench b;
        b.running();
        board_set_supply(b.board, supply_V);
        b.run_ms(50);
        EXPECT_TRUE(b.bridge_on()) << supply_V;
    }
}

} // namespace
