// Events of the profile that change the plant itself: faults and temperatures.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/pmsim/support.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/names.h"
#include "tools/pmsim/scenario_file.h"

namespace pmsim
{
namespace
{

// IPM-1000 held by a dynamometer, or run by the drive.
Scenario scenario(const std::string &profile, const std::string &more = "")
{
    const std::string text = "title: t\n"
                             "machine: sim_plant/machines/ipm_1000.yaml\n"
                             "start: {theta_e_deg: 30}\n"
                             "duration_s: 1\n" +
                             more + "profile:\n" + profile;
    const ScenarioFile file(Value::from_text(text, "s.yaml"), {});
    return file.scenario(file.runs().front());
}

// Truth of each period up to t.
class Bench
{
  public:
    explicit Bench(const Scenario &s) : scenario_(s), loop_(scenario_)
    {
    }

    template <class Look> void until(double t_s, Look look)
    {
        for (; double(k_) * 1e-4 < t_s; ++k_) {
            look(loop_.step().rig.truth);
        }
    }
    void until(double t_s)
    {
        until(t_s, [](const plant_truth_t &) {});
    }
    double largest_torque_Nm(double t_s)
    {
        double largest = 0.0;
        until(t_s,
              [&](const plant_truth_t &truth) { largest = std::fmax(largest, std::fabs(truth.torque_Nm)); });
        return largest;
    }

  private:
    Scenario scenario_;
    Loop loop_;
    uint64_t k_ = 0;
};

const char coasting[] = "  - {t_s: 0, imposed_speed_rad_s: 30}\n"; // its EMF stays below the link

// A shorted turn brakes, a machine at open terminals does not.
TEST(ProfileFaults, ShortBrakesUntilItEnds)
{
    for (const char *to : {"b", "rail"}) {
        Bench bench(scenario(std::string(coasting) + "  - {t_s: 0.1, short: {from: a, to: " + to +
                                 ", R_ohm: 0.1}}\n  - {t_s: 0.3, short: none}\n",
                             "inverter: {c_leg_F: 0}\n")); // through which a little flows
        EXPECT_LT(bench.largest_torque_Nm(0.1), 1e-9) << to;
        EXPECT_GT(bench.largest_torque_Nm(0.3), 0.1) << to; // by the rail, the lower diodes close the loop
        bench.until(0.35);
        EXPECT_LT(bench.largest_torque_Nm(0.4), 1e-9) << to;
    }
}

// The link lives on its capacitor, which the drive empties.
TEST(ProfileFaults, LostSupplyLetsTheLinkFall)
{
    Bench bench(scenario("  - {t_s: 0, mode: speed, speed_rel: 0.5, enable: true}\n"
                         "  - {t_s: 0.5, load_rel: 0.5, supply: false}\n"));
    double v_dc_V = 0.0;
    const auto look = [&](const plant_truth_t &truth) { v_dc_V = truth.v_dc_V; };
    bench.until(0.5, look);
    EXPECT_NEAR(v_dc_V, 300.0, 1.0);
    bench.until(0.7, look);
    EXPECT_LT(v_dc_V, 200.0);
}

// By the level of the machine file's inverter, and not without one.
TEST(ProfileFaults, OverCurrentComparatorsStopTheDrive)
{
    for (const char *level : {"0", "3"}) {
        const Scenario s = scenario("  - {t_s: 0, mode: speed, speed_rel: 0.3, enable: true}\n"
                                    "  - {t_s: 0.5, load_rel: 1}\n",
                                    std::string("inverter: {i_break_A: ") + level + "}\n");
        Loop loop(s);
        const Sample *last = nullptr;
        for (int k = 0; k < 7000; ++k) {
            last = &loop.step();
        }
        EXPECT_EQ(fault_names()[size_t(last->rig.fault)], *level == '3' ? "HARDWARE" : "NONE");
        EXPECT_EQ(last->rig.state == RIG_FAULT, *level == '3');
        EXPECT_EQ(last->rig.driven, *level == '0');
    }
}

TEST(ProfileFaults, OpenWireCarriesNoCurrent)
{
    Bench bench(scenario("  - {t_s: 0, mode: speed, speed_rel: 0.5, enable: true}\n"
                         "  - {t_s: 0.5, leg_fault: {leg: b, kind: wire_open}}\n"));
    double before_A = 0.0, after_A = 0.0;
    bench.until(0.5,
                [&](const plant_truth_t &truth) { before_A = std::fmax(before_A, std::fabs(truth.i_A[1])); });
    bench.until(0.5005);
    bench.until(0.6,
                [&](const plant_truth_t &truth) { after_A = std::fmax(after_A, std::fabs(truth.i_A[1])); });
    EXPECT_GT(before_A, 1.0);
    EXPECT_EQ(after_A, 0.0);
}

// Copper loss per squared current is the resistance: sums at the sample instants against the plant's
// integral. Ripple between the instants is worth less than 1 %.
TEST(ProfileFaults, WarmWindingHasMoreResistance)
{
    const double alpha_1_K = 0.0039;
    Bench bench(scenario("  - {t_s: 0, mode: speed, speed_rel: 0.5, load_rel: 0.5, enable: true}\n"
                         "  - {t_s: 0.7, winding_degC: 125}\n",
                         "winding: {alpha_R_1_K: 0.0039}\n"));
    const auto resistance_ohm = [&](double from_s, double to_s) {
        double square = 0.0, first_J = -1.0, last_J = 0.0;
        bench.until(from_s);
        bench.until(to_s, [&](const plant_truth_t &truth) {
            first_J = first_J < 0.0 ? truth.e_copper_J : first_J;
            last_J = truth.e_copper_J;
            for (int leg = 0; leg < 3; ++leg) {
                square += truth.i_A[leg] * truth.i_A[leg] * 1e-4;
            }
        });
        return (last_J - first_J) / square;
    };
    EXPECT_NEAR(resistance_ohm(0.5, 0.7), 6.0, 0.06);
    EXPECT_NEAR(resistance_ohm(0.75, 0.95), 6.0 * (1.0 + alpha_1_K * 100.0), 0.08);
}

// EMF of weaker magnets: without current the flux linkage is the magnets'.
TEST(ProfileFaults, WarmMagnetsAreWeaker)
{
    Bench bench(scenario(std::string(coasting) + "  - {t_s: 0.1, magnet_degC: 125, ramp_s: 0.1}\n",
                         "winding: {alpha_psi_1_K: -0.001}\n"));
    double psi_Wb = 0.0;
    const auto look = [&](const plant_truth_t &truth) { psi_Wb = truth.psi_d_Wb; };
    bench.until(0.1, look);
    EXPECT_NEAR(psi_Wb, 0.236, 1e-6);
    bench.until(0.15, look);
    EXPECT_NEAR(psi_Wb, 0.236 * 0.95, 0.236 * 0.001); // half of the ramp
    bench.until(0.3, look);
    EXPECT_NEAR(psi_Wb, 0.236 * 0.9, 1e-6);
}

} // namespace
} // namespace pmsim
