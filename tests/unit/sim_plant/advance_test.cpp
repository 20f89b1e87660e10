// The integrator of circuit.h: figures do not depend on its step, and no operation makes it chatter.
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace
{

// A tenth of what METHODS.md asks for in total, 1e-4 of rated after a second.
constexpr double independence = 1e-5;
constexpr double rated_A = 4.0, rated_rad_s = 104.7;

// A second of a driven motor with dead time, drops, friction and soft link, by the PWM of a first run.
plant_truth_t second_of(double tolerance, std::vector<plant_pwm_t> &pwm)
{
    plant_config_t config = rig::ipm_1000_real();
    config.mech.T_coulomb_Nm = 0.05;
    config.tolerance = tolerance;
    rig::Plant plant(config);
    rig::CurrentControl control(config);
    bool first = pwm.empty();
    for (size_t k = 0; k < 10000; k++) {
        plant_set_load(plant, k > 3000 ? 2.0 : 0.0);
        if (first) {
            pwm.push_back(control.step(plant.truth(), -0.5, k < 7000 ? 4.0 : -2.0));
        }
        plant.run(pwm[k]);
    }
    return plant.truth();
}

TEST(Advance, FiguresDoNotDependOnTheStep)
{
    std::vector<plant_pwm_t> pwm;
    plant_truth_t with = second_of(1e-6, pwm), half = second_of(5e-7, pwm), fine = second_of(1e-10, pwm);
    RecordProperty("i_q", std::to_string(1e9 * std::fabs(with.i_q_A - fine.i_q_A) / rated_A) + "e-9");
    for (const plant_truth_t &other : {half, fine}) {
        EXPECT_NEAR(with.i_d_A, other.i_d_A, independence * rated_A);
        EXPECT_NEAR(with.i_q_A, other.i_q_A, independence * rated_A);
        EXPECT_NEAR(with.omega_mech_rad_s, other.omega_mech_rad_s, independence * rated_rad_s);
        EXPECT_NEAR(with.v_dc_V, other.v_dc_V, independence * 300.0);
        EXPECT_NEAR(with.e_in_J, other.e_in_J, independence * other.e_in_J);
    }
}

class Random
{
  public:
    explicit Random(uint64_t seed) : state_(seed)
    {
    }

    double operator()() // 0 ... 1
    {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<double>(state_ >> 11) * 0x1p-53;
    }

    bool chance(double p)
    {
        return (*this)() < p;
    }

  private:
    uint64_t state_;
};

plant_config_t random_plant(Random &random)
{
    plant_config_t c = rig::ipm_1000_real();
    double kind = random();
    if (kind < 0.33) {
        c = rig::spm_400_linear();
        c.machine.c_A_Wb5 = 2.09e5;
        c.inverter = rig::inverter(10e3, 2e-6, 0.0, 0.8, 0.05);
        c.dclink = rig::dclink(36.0, 0.2, 1e-3, true);
        c.mech.J_kgm2 = 5e-4;
    } else if (kind < 0.66) { // BLDC-HS
        c.machine = {0.025, 25e-6, 25e-6, 0.0, 1.25e-3, 1};
        c.inverter = rig::inverter(40e3, 0.5e-6, 0.0, 0.8, 0.005, 2000);
        c.dclink = rig::dclink(24.0);
        c.mech.J_kgm2 = 2e-6;
        c.sensor.i_full_scale_A = 40.0;
    }
    c.inverter.v_diode_V *= random.chance(0.7);
    c.inverter.v_switch_V *= random.chance(0.7);
    c.inverter.r_on_ohm *= random.chance(0.7);
    c.inverter.dead_time_s *= random.chance(0.8);
    c.mech.T_coulomb_Nm = random.chance(0.3) ? 0.3 * random() : 0.0;
    c.sensor.delay_s = (random() - 0.5) / c.inverter.f_pwm_Hz;
    return c;
}

plant_pwm_t random_pwm(Random &random, uint32_t timer_counts)
{
    plant_pwm_t pwm{};
    double kind = random();
    for (int k = 0; k < PLANT_LEGS; k++) {
        pwm.driven[k] = kind < 0.3 ? false : kind < 0.6 ? random.chance(0.6) : true;
        for (uint32_t &compare : pwm.compare[k]) {
            double extreme = random();
            double duty = extreme < 0.1   ? 0.0
                          : extreme < 0.2 ? 1.01
                          : extreme < 0.3 ? 0.03 * random()
                                          : 0.4 + 0.2 * random();
            compare = static_cast<uint32_t>(duty * timer_counts);
        }
    }
    return pwm;
}

void random_event(Random &random, rig::Plant &plant, double omega_max, double v_source)
{
    double what = random();
    if (what < 0.02) {
        plant_set_speed(plant, (2.0 * random() - 1.0) * omega_max);
    } else if (what < 0.03) {
        plant_free_speed(plant);
    } else if (what < 0.04) {
        plant_trip(plant);
    } else if (what < 0.05) {
        plant_set_load(plant, random() - 0.5);
    } else if (what < 0.055) {
        plant_turn_rotor(plant, 6.0 * random() - 3.0);
    } else if (what < 0.06) {
        plant_set_locked(plant, random.chance(0.3));
    } else if (what < 0.07) {
        plant_set_source(plant, 1.2 * random() * v_source);
    } else if (what < 0.075) {
        plant_machine(plant)->R_s_ohm *= 0.9 + 0.2 * random();
    }
}

// The plant asserts that it does not chatter; here it is to be driven through everything and stay physical:
// currents sum to zero, terminals stay between the rails, energy is kept.
TEST(Advance, SurvivesRandomOperation)
{
    constexpr int runs = 100, periods = 300;
    double worst = 0.0;
    for (uint64_t seed = 1; seed <= runs; seed++) {
        Random random(seed * 7919);
        plant_config_t config = random_plant(random);
        double omega_max =
            2.0 * config.dclink.v_source_V / (config.machine.psi_m_Wb * config.machine.pole_pairs);
        rig::Plant plant(config, 6.28 * random());
        plant_pwm_t pwm{};
        double throughput_J = 1e-3;
        for (int k = 0; k < periods; k++) {
            random_event(random, plant, omega_max, config.dclink.v_source_V);
            if (random.chance(0.2)) {
                pwm = random_pwm(random, config.inverter.timer_counts);
            }
            plant_adc_t adc;
            plant_sample(plant, &adc);
            plant.run(pwm);
            plant_truth_t t = plant.truth();
            throughput_J = std::max({throughput_J, std::fabs(t.e_in_J), std::fabs(t.e_mech_J), t.e_copper_J});
            double drop_V = config.inverter.v_diode_V + config.inverter.v_switch_V + 1e-5;
            for (int leg = 0; leg < 3; leg++) {
                double r_V = drop_V + config.inverter.r_on_ohm * std::fabs(t.i_A[leg]);
                ASSERT_TRUE(std::isfinite(t.i_A[leg])) << seed << " " << k;
                ASSERT_LE(t.v_leg_V[leg], t.v_dc_V + r_V) << seed << " " << k << " " << leg;
                ASSERT_GE(t.v_leg_V[leg], -r_V) << seed << " " << k << " " << leg;
            }
            ASSERT_NEAR(t.i_A[0] + t.i_A[1] + t.i_A[2], 0.0, 1e-6) << seed << " " << k;
        }
        plant_truth_t t = plant.truth();
        double residual = t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
        worst = std::max(worst, std::fabs(residual) / throughput_J);
    }
    RecordProperty("worst_balance", std::to_string(1e6 * worst) + "e-6");
    EXPECT_LT(worst, 1e-4); // of what went through; violent runs, so less is asked than of a driven motor
}

// Any connection, with anything that a winding and an inverter can have.
plant_config_t random_machine(Random &random)
{
    plant_config_t c = random_plant(random);
    plant_winding_t &w = c.winding;
    double L = c.machine.L_d0_H, kind = random();
    if (kind < 0.35) {
        w.sets = 2;
        w.M_d_H = random.chance(0.5) ? 0.3 * L : 0.0;
        w.M_q_H = random.chance(0.5) ? 0.4 * L : w.M_d_H;
    } else if (kind < 0.7) {
        w.connection = PLANT_OPEN;
        w.L_0_H = (0.1 + 0.4 * random()) * L;
        w.dL_0_H = random.chance(0.5) ? 0.1 * w.L_0_H : 0.0;
    }
    if (random.chance(0.5)) {
        w.emf[0] = {3, 0.05 * c.machine.psi_m_Wb, 6.0 * random()};
        w.emf[1] = {5, 0.03 * c.machine.psi_m_Wb, 6.0 * random()};
    }
    if (random.chance(0.3)) {
        w.dL_H[static_cast<int>(6.0 * random())] = 0.1 * L;
        w.dR_ohm[static_cast<int>(6.0 * random())] = 0.2 * c.machine.R_s_ohm;
        w.saliency[0] = {-4, 0.03 * L, 1.0};
    }
    if (random.chance(0.2)) {
        w.L_eddy_d_H = w.L_eddy_q_H = 3.0 * L;
        w.R_eddy_ohm = 5.0 * c.machine.R_s_ohm;
    }
    if (random.chance(0.4)) {
        c.inverter.c_leg_F = 5e-9 * random();
    }
    if (random.chance(0.4) && c.inverter.dead_time_s > 0.0) {
        c.inverter.turn_on_s = 0.3 * c.inverter.dead_time_s;
        c.inverter.turn_off_s = 0.6 * c.inverter.dead_time_s;
    }
    return c;
}

// Whether a short is there afterwards; only without one do the legs' currents add up to nothing.
bool random_fault(Random &random, rig::Plant &plant, int legs, bool soft, bool shorted)
{
    double what = random();
    int leg = static_cast<int>(legs * random());
    if (what < 0.02) {
        plant_set_leg_fault(plant, leg, static_cast<plant_leg_fault_t>(static_cast<int>(6.0 * random())));
    } else if (what < 0.04) {
        plant_set_leg_fault(plant, leg, PLANT_HEALTHY);
    } else if (what < 0.045) {
        plant_set_short(plant, leg, random.chance(0.5) ? -1 : (leg + 1) % legs, 20.0 * random() + 0.1);
        return true;
    } else if (what < 0.06) {
        plant_set_short(plant, leg, -1, -1.0);
        return false;
    } else if (what < 0.065 && soft) { // a stiff link has no supply to lose
        plant_set_supply(plant, random.chance(0.5));
    } else if (what < 0.07) {
        plant_set_temperature(plant, 25.0 + 100.0 * random(), 25.0);
    }
    return shorted;
}

// The same with every machine and every fault: no chatter, no current from nowhere, no energy either.
class AdvanceRandomly : public testing::TestWithParam<uint64_t>
{
};

TEST_P(AdvanceRandomly, SurvivesFaults)
{
    constexpr int runs = 15, periods = 200;
    double worst = 0.0;
    for (uint64_t seed = GetParam(); seed < GetParam() + runs; seed++) {
        Random random(seed * 104729);
        plant_config_t config = random_machine(random);
        bool open = config.winding.connection == PLANT_OPEN;
        int legs = open || config.winding.sets == 2 ? 6 : 3;
        double omega_max =
            1.5 * config.dclink.v_source_V / (config.machine.psi_m_Wb * config.machine.pole_pairs);
        rig::Plant plant(config, 6.28 * random());
        plant_pwm_t pwm{};
        double throughput_J = 1e-3;
        bool shorted = false;
        for (int k = 0; k < periods; k++) {
            random_event(random, plant, omega_max, config.dclink.v_source_V);
            shorted = random_fault(random, plant, legs, config.dclink.c_F > 0.0, shorted);
            if (random.chance(0.2)) {
                pwm = random_pwm(random, config.inverter.timer_counts);
            }
            plant.run(pwm);
            plant_truth_t t = plant.truth();
            throughput_J = std::max({throughput_J, std::fabs(t.e_in_J), std::fabs(t.e_mech_J), t.e_copper_J});
            double sum[3] = {}, scale = config.sensor.i_full_scale_A;
            for (int leg = 0; leg < legs; leg++) {
                ASSERT_TRUE(std::isfinite(t.i_A[leg])) << seed << " " << k;
                ASSERT_TRUE(std::isfinite(t.v_leg_V[leg])) << seed << " " << k;
                ASSERT_LT(std::fabs(t.i_A[leg]), 1e6) << seed << " " << k;
                sum[open ? leg % 3 : leg / 3] += t.i_A[leg];
                scale = std::max(scale, std::fabs(t.i_A[leg]));
            }
            for (double s : sum) {
                ASSERT_TRUE(shorted || std::fabs(s) < 1e-6 * scale) << seed << " " << k << " " << s;
            }
        }
        plant_truth_t t = plant.truth();
        double residual = t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J;
        worst = std::max(worst, std::fabs(residual) / throughput_J);
        EXPECT_LT(std::fabs(residual) / throughput_J, 1e-4) << seed;
    }
    RecordProperty("worst_balance", std::to_string(1e6 * worst) + "e-6");
}

INSTANTIATE_TEST_SUITE_P(Seeds, AdvanceRandomly, testing::Values(1, 16, 31, 46));

} // namespace
