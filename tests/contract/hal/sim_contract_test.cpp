// The port `sim` keeps what hal.h promises.
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/application.h"
#include "tests/support/plants.h"

extern "C" {
#include "tests/contract/hal/hal_contract.h"
}

namespace
{

// What the interrupts of a processor do, one period of 100 us at a time.
void pass_period(hal_t *hal)
{
    plant_sample(hal->plant, &hal->adc);
    if (hal->app != nullptr) {
        app_control(hal->app);
        if (hal->slow_pending) {
            hal->slow_pending = false;
            app_slow(hal->app);
        }
        if (hal->time_us % 1000 == 0) {
            app_monitor(hal->app);
        }
    }
    sim_run_period(hal);
    hal->time_us += 100;
}

void keeps_contract(const plant_config_t &config, uint32_t without, uint32_t channels)
{
    const char *error = nullptr;
    const std::unique_ptr<plant_t, void (*)(plant_t *)> plant(plant_create(&config, 0.0, &error),
                                                              &plant_destroy);
    ASSERT_NE(plant, nullptr) << error;
    static hal_t hal;
    sim_hal_init(&hal, plant.get());
    hal.without = without;
    const hal_contract_t contract = {{8500, 500, 0, 500}, 100, channels, pass_period, sim_break};
    EXPECT_EQ(hal_contract_run(&hal, &contract), 0) << hal.console;
    EXPECT_NE(std::string(hal.console).find("DONE 0 of"), std::string::npos) << hal.console;
}

constexpr uint32_t kAlways =
    NEEDS_SECOND_SAMPLE | NEEDS_HALVES | NEEDS_HELD | NEEDS_ONE_SWITCH | NEEDS_COMMUTATE;

TEST(HalContract, Sim)
{
    keeps_contract(plants::ipm_1000(), 0, kAlways);
}

plant_config_t with_voltages()
{
    plant_config_t config = plants::ipm_1000();
    config.sensor.v_leg_full_scale_V = 450;
    config.sensor.capture_s = 1e-7;
    return config;
}

TEST(HalContract, SimWithTerminalsAndComparators)
{
    keeps_contract(with_voltages(), 0, kAlways | NEEDS_TERMINALS | NEEDS_NEUTRAL | NEEDS_CAPTURES);
}

TEST(HalContract, SimWithNeutralAndLinkCurrent)
{
    plant_config_t config = plants::ipm_1000();
    config.sensor.v_zero_full_scale_V = 200;
    config.sensor.i_dc_full_scale_A = 20;
    keeps_contract(config, 0, kAlways | NEEDS_NEUTRAL | NEEDS_DC_CURRENT);
}

TEST(HalContract, SimWithTwoSetsOfWindings)
{
    plant_config_t config = plants::ipm_1000();
    config.winding.sets = 2;
    config.sensor.v_zero_full_scale_V = 200;
    keeps_contract(config, 0, kAlways | NEEDS_NEUTRAL | NEEDS_BRIDGES | NEEDS_SECOND_SET);
}

TEST(HalContract, SimWithoutWhatIsTaken)
{
    keeps_contract(with_voltages(), ~0U, 0);
}

} // namespace
