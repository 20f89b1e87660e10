#include "tools/pmsim/similarity.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "firmware/drive/config.h"
#include "firmware/params/parameters.h"
#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/metrics.h"
#include "tools/pmsim/runner.h"
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{
namespace
{

constexpr double kV = 0.07, kI = 5.0;

Scenario load()
{
    const ScenarioFile file(Value::from_file("tests/scenario/load_step.yaml"), {});
    return file.scenario(file.runs().front());
}

TEST(Similarity, FactorsFollowFromTheUnits)
{
    const Similarity s{2.0, 3.0};
    EXPECT_EQ(s.of_key("v_source_V"), 2.0);
    EXPECT_EQ(s.of_key("offset_A"), 3.0);
    EXPECT_DOUBLE_EQ(s.of_key("R_s_ohm"), 2.0 / 3);
    EXPECT_DOUBLE_EQ(s.of_key("L_d0_H"), 2.0 / 3);
    EXPECT_EQ(s.of_key("psi_m_Wb"), 2.0);
    EXPECT_EQ(s.of_key("J_kgm2"), 6.0);
    EXPECT_EQ(s.of_key("B_Nms"), 6.0);
    EXPECT_DOUBLE_EQ(s.of_key("c_leg_F"), 1.5);
    EXPECT_DOUBLE_EQ(s.of_key("c_A_Wb5"), 3.0 / 32);
    EXPECT_DOUBLE_EQ(s.of_unit("A/Wb^2"), 3.0 / 4);
    for (const char *same :
         {"speed_rated_rad_s", "dead_time_s", "f_pwm_Hz", "pole_pairs", "gain_error", "alpha_R_1_K"}) {
        EXPECT_EQ(s.of_key(same), 1.0) << same;
    }
}

// A unit that is in no list would be left as it is, like that of b + c, and the drive be told another machine.
TEST(Similarity, EveryUnitIsEitherScaledOrKept)
{
    const std::set<std::string> kept = {
        "",    "1",   "s",    "Hz",   "bit/s",         "rad/s",       "rad/s2",
        "rad", "deg", "turn", "degC", "rated current", "rated torque"};
    const auto known = [&kept](const std::string &unit) {
        return kept.count(unit) != 0 || Similarity{2.0, 3.0}.of_unit(unit) != 1.0;
    };
    for (const drive_param_text_t &text : drive_param_text) {
        EXPECT_TRUE(known(text.unit)) << text.unit;
    }
    for (const MetricInfo &metric : metric_infos()) {
        EXPECT_TRUE(known(metric.unit)) << metric.name << ' ' << metric.unit;
    }
}

// The plant of a machine that is wound again: the same angles and speeds, currents and voltages in proportion.
TEST(Similarity, ThePlantIsTheSameInPerUnit)
{
    Scenario first = load(), second = load();
    for (Scenario *s : {&first, &second}) { // rounding of the converters is not in proportion
        s->setup.plant.sensor.bits = 0;
        s->setup.plant.sensor.noise_lsb = 0.0;
    }
    make_similar(second.setup, {kV, kI});
    const char *reason = nullptr;
    plant_t *a = plant_create(&first.setup.plant, 0.3, &reason),
            *b = plant_create(&second.setup.plant, 0.3, &reason);
    ASSERT_NE(a, nullptr);
    ASSERT_NE(b, nullptr);
    for (int k = 0; k < 2000; ++k) {
        plant_pwm_t pwm = {};
        for (int leg = 0; leg < 3; ++leg) {
            pwm.driven[leg] = true;
            pwm.compare[leg][0] =
                static_cast<uint32_t>(8500 * (0.5 + 0.2 * std::cos(0.03 * k - leg * 2.0944)));
            pwm.compare[leg][1] = pwm.compare[leg][0];
        }
        for (plant_t *plant : {a, b}) {
            plant_set_pwm(plant, &pwm);
            plant_run_period(plant);
        }
    }
    plant_truth_t x = {}, y = {};
    plant_truth(a, &x);
    plant_truth(b, &y);
    EXPECT_GT(std::abs(x.i_A[0]), 0.1);
    for (int leg = 0; leg < 3; ++leg) {
        EXPECT_NEAR(y.i_A[leg], kI * x.i_A[leg], 1e-4 * kI);
    }
    EXPECT_NEAR(y.v_dc_V, kV * x.v_dc_V, 1e-5 * y.v_dc_V);
    EXPECT_NEAR(y.torque_Nm, kV * kI * x.torque_Nm, 1e-4);
    EXPECT_NEAR(y.omega_mech_rad_s, x.omega_mech_rad_s, 1e-4);
    plant_destroy(a);
    plant_destroy(b);
}

TEST(Similarity, TheDriveIsTheSameInPerUnit)
{
    Scenario first = load(), second = load();
    make_similar(second.setup, {kV, kI});
    drive_config_t a = {}, b = {};
    ASSERT_TRUE(drive_configure(&a, first.setup.params.get(), PM_CHANNELS).ok);
    const drive_result_t result = drive_configure(&b, second.setup.params.get(), PM_CHANNELS);
    ASSERT_TRUE(result.ok) << drive_param_table[result.param].name << ' ' << result.reason;
    EXPECT_NEAR(a.machine.R_s, b.machine.R_s, 1e-4 * a.machine.R_s);
    EXPECT_NEAR(a.machine.L_q, b.machine.L_q, 1e-4 * a.machine.L_q);
    EXPECT_NEAR(a.machine.psi_m, b.machine.psi_m, 1e-4 * a.machine.psi_m);
    EXPECT_NEAR(a.i_max, b.i_max, 1e-4 * a.i_max);
    EXPECT_NEAR(a.protection.v_dc_max, b.protection.v_dc_max, 1e-3 * a.protection.v_dc_max);
}

TEST(Similarity, AFluxMapIsRefused)
{
    pmsim::Setup setup = default_setup();
    setup.flux_map = std::make_shared<const FluxMap>();
    EXPECT_NE(error_of([&] { make_similar(setup, {kV, kI}); }).find("flux map"), std::string::npos);
}

} // namespace
} // namespace pmsim
