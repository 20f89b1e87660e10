// Block commutation on the switching plant: bldc/ in fixed point, everything around it in double precision. The plant shares
// no code with the firmware; errors are those against its true angle.
#ifndef TESTS_UNIT_BLDC_RIG_H
#define TESTS_UNIT_BLDC_RIG_H

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "bldc/six_step.h"
#include "sim_plant/plant.h"

namespace bldc_rig
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

inline int32_t fixed(double x, int bits)
{
    return static_cast<int32_t>(std::llround(std::ldexp(x, bits)));
}

inline double real(int32_t x, int bits = PM_Q_BITS)
{
    return std::ldexp(static_cast<double>(x), -bits);
}

inline double wrapped_deg(double angle_rad)
{
    return std::remainder(angle_rad, 2 * kPi) / kDegree;
}

struct Machine {
    plant_config_t plant;
    bool trapezoid;

    // E of a trapezoid, E_m of a sine; V s.
    double peak_Vs() const
    {
        return plant.machine.psi_m_Wb * (trapezoid ? kPi * kPi / 12 : 1);
    }

    // Of the terminal, for a rad of the rotor at 1 rad/s: 10.3.2.
    double slope_Vs() const
    {
        return trapezoid ? 6 / kPi * peak_Vs() : 1.5 * peak_Vs();
    }
};

// METHODS.md 14. Dead time and capacitance are those of 0.3; r_winding for Q of 3 where c_leg is not 0.
inline Machine hs()
{
    plant_config_t c = {};
    c.machine = {0.025, 25e-6, 25e-6, 0, 1.25e-3, 1};
    c.mech.J_kgm2 = 2e-6;
    c.mech.load_Nms2 = 0.3e-9;
    c.mech.T_coulomb_Nm = 5e-4;
    c.inverter.f_pwm_Hz = 40e3;
    c.inverter.dead_time_s = 2e-6;
    c.inverter.r_on_ohm = 0.002;
    c.inverter.v_diode_V = 0.8;
    c.inverter.timer_counts = 2125;
    c.dclink = {};
    c.dclink.v_source_V = 24;
    c.dclink.r_source_ohm = 0.02;
    c.dclink.c_F = 0.47e-3;
    c.sensor.bits = 12;
    c.sensor.noise_lsb = 0.5;
    c.sensor.seed = 1;
    c.sensor.i_full_scale_A = 40;
    c.sensor.v_full_scale_V = 40;
    c.sensor.v_leg_full_scale_V = 40;
    return {c, false};
}

inline Machine fan()
{
    Machine m = hs();
    m.trapezoid = true;
    m.plant.machine = {0.4, 0.5e-3, 0.5e-3, 0, 7.5e-3, 4};
    for (int k = 0; k < 15; ++k) {
        const int n = 2 * k + 3;
        m.plant.winding.emf[k] = {n, 2 * 7.5e-3 * std::sin(n * kPi / 6) / std::pow(n, 3), 0};
    }
    m.plant.mech.J_kgm2 = 1e-4;
    m.plant.mech.load_Nms2 = 1.8e-6;
    m.plant.mech.T_coulomb_Nm = 2e-3;
    m.plant.inverter.f_pwm_Hz = 20e3;
    m.plant.inverter.r_on_ohm = 0.01;
    m.plant.inverter.timer_counts = 4250;
    m.plant.dclink.r_source_ohm = 0.05;
    m.plant.dclink.c_F = 1e-3;
    m.plant.sensor.i_full_scale_A = 10;
    return m;
}

// Output capacitance of the legs, and the loss that damps a floating leg: plant_config.h, r_winding_ohm.
inline Machine with_capacitance(Machine m, double c_leg_F, double Q)
{
    m.plant.inverter.c_leg_F = c_leg_F;
    m.plant.winding.r_winding_ohm = Q / 1.5 * std::sqrt(1.5 * m.plant.machine.L_d0_H / c_leg_F);
    return m;
}

constexpr double kBase_V = 40;

struct Options {
    pattern_id_t pattern = PATTERN_H_PWM_L_ON;
    bool complementary = true;
    zero_reference_t reference = ZERO_LINK;
    double advance_deg = 0;
    double k_V = 0, k_H = 0; // of thresholds.h
    double blank_s = 3e-6, lead_s = 1e-6, least_s = 6e-6;
    bool virtual_third = false; // crossings of the third harmonic of the terminals
    bool third = false;         // crossings of the third harmonic,
    bool told_filter = true;    // with the lag of the channel's RC taken off
    bool late_rule = true;      // a first sample past the crossing counts
    bool reverse = false;
    bool one_channel = false;  // the mean of the terminals in place of each
    bool legs_unknown = false; // all samples are taken for those of on times
    int strikes = 6;
};

inline double base_rad_s(const Machine &m)
{
    return m.trapezoid ? 1256.6 : 8377.6;
}

inline double psi_3_Wb(const Machine &m)
{
    return m.plant.winding.emf[0].order == 3 ? m.plant.winding.emf[0].amplitude : 0;
}

inline six_step_config_t make(const Machine &m, const Options &o)
{
    const double N = m.plant.inverter.timer_counts;
    const double count_s = 0.5 / m.plant.inverter.f_pwm_Hz / N;
    const double shape = o.reference == ZERO_LINK        ? 1
                         : o.reference == ZERO_TERMINALS ? 2.0 / 3
                         : m.trapezoid                   ? 1
                                                         : 2.0 / 3;
    six_step_config_t c = {};
    c.pattern.id = o.pattern;
    c.pattern.complementary = o.complementary;
    c.pattern.half_period = static_cast<uint16_t>(N);
    c.pattern.lead = static_cast<uint16_t>(std::lround(o.lead_s / count_s));
    c.pattern.least = static_cast<uint16_t>(std::lround(o.least_s / count_s));
    c.crossing.reference = o.reference;
    c.crossings = o.virtual_third ? CROSSINGS_virtual_third : CROSSINGS_open_terminal;
    c.crossing.rail = fixed(0.35 / kBase_V, PM_Q_BITS);
    c.crossing.blank = static_cast<uint32_t>(std::lround(o.blank_s / count_s));
    c.commutation.half = fixed((0.5 - o.advance_deg / 60) / 6, 32);
    c.commutation.turn_base = static_cast<uint32_t>(std::lround(2 * kPi / base_rad_s(m) / count_s));
    c.commutation.strikes = static_cast<uint8_t>(o.strikes);
    c.thresholds.k_V = fixed(1.5 * o.k_V, 32);
    c.thresholds.k_H = fixed(o.k_H, 32);
    c.compared = o.third || o.virtual_third ? 0 : -1;
    c.thresholds.most = fixed((o.third ? 2.0 / 3 : 2.0) / kBase_V, PM_Q_BITS);
    c.crossing.t_60 = (c.commutation.turn_base + 3) / 6;
    c.crossing.curve = m.trapezoid ? 0 : ZERO_CURVE_SINE;
    if (o.third) {
        c.crossings = CROSSINGS_third_harmonic;
        c.third.trapezoid = m.trapezoid;
        c.third.negative = psi_3_Wb(m) < 0;
        c.third.pi_rc = static_cast<int32_t>(
            std::lround(o.told_filter ? kPi * m.plant.sensor.v_zero_filter_s / count_s : 0));
        const double rise_Vs = m.trapezoid ? 2 * m.peak_Vs() / 3 : 3 * kPi * std::abs(psi_3_Wb(m));
        c.crossing.swing = fixed(rise_Vs * base_rad_s(m) / kBase_V, PM_Q_BITS);
        return c;
    }
    c.crossing.swing = fixed(shape * m.slope_Vs() * base_rad_s(m) * kPi / 3 / kBase_V, PM_Q_BITS);
    return c;
}

// Of an error in degrees.
struct Statistics {
    double sum = 0, squares = 0, most = 0;
    int n = 0;

    void add(double e)
    {
        sum += e;
        squares += e * e;
        most = std::max(most, std::abs(e));
        ++n;
    }
    double mean() const
    {
        return n > 0 ? sum / n : 1e9;
    }
    double rms() const
    {
        return n > 0 ? std::sqrt(squares / n) : 1e9;
    }
};

// Of the leg that has gone, until its current is zero.
struct Freewheel {
    Statistics angle, current; // degrees, A

    double i() const
    {
        return current.mean();
    }
};

class Rig
{
  public:
    // The rotor turns at omega_e already; the drive is told its angle and speed with errors.
    Rig(const Machine &m, const Options &o, double omega_e_rad_s, double off_deg = 3, double off_speed = 1.03,
        double start_rad = 95 * kDegree)
        : machine(m), options(o), config(make(m, o)), period_s_(1 / m.plant.inverter.f_pwm_Hz),
          count_s_(0.5 * period_s_ / m.plant.inverter.timer_counts), sign_(o.reverse ? -1 : 1)
    {
        const char *error = nullptr;
        plant_.reset(plant_create(&machine.plant, sign_ * start_rad, &error));
        EXPECT_EQ(error, nullptr) << error;
        impose(omega_e_rad_s);
        const double theta_rad = std::remainder(sign_ * (start_rad + off_deg * kDegree), 2 * kPi);
        six_step_reset(&six_step, &config,
                       static_cast<pm_angle_t>(std::llround(std::ldexp(theta_rad / 2 / kPi, 32))),
                       fixed(sign_ * off_speed * omega_e_rad_s / base_rad_s(machine), PM_Q_BITS), 0);
        sector_ = next_sector_ = six_step.commutation.sector;
    }

    void impose(double omega_e_rad_s)
    {
        turn_s_ = 2 * kPi / omega_e_rad_s;
        plant_set_speed(plant_.get(), sign_ * omega_e_rad_s / machine.plant.machine.pole_pairs);
    }
    void release()
    {
        plant_free_speed(plant_.get());
    }
    plant_t *plant()
    {
        return plant_.get();
    }
    plant_truth_t truth() const
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return t;
    }
    double omega_e() const
    {
        return sign_ * truth().omega_mech_rad_s * machine.plant.machine.pole_pairs;
    }
    double angle_rad() const
    {
        plant_truth_t t;
        plant_truth_windings(plant_.get(), &t);
        return sign_ * t.theta_e_rad;
    }

    // One period with the mean line voltage u v_dc.
    void period(double u)
    {
        six_step_in_t in = {};
        in.now = now_;
        in.u = fixed(u, PM_Q_BITS);
        const bool sampled = sampled_ && config.crossings != CROSSINGS_third_harmonic;
        zero_sample_t sample;
        for (int k = 0; k < 3; ++k) {
            sample.v[k] = fixed(adc_.v_leg[k] / 65536.0 + wrong_reference_V / kBase_V, PM_Q_BITS);
        }
        if (options.one_channel) {
            const pm_q_t mean = (sample.v[0] + sample.v[1] + sample.v[2]) / 3;
            sample.v[0] = sample.v[1] = sample.v[2] = mean;
        }
        sample.v_neutral = fixed(adc_.v_neutral[0] / 65536.0, PM_Q_BITS);
        sample.v_neutral -= (sample.v[0] + sample.v[1] + sample.v[2]) / 3;
        sample.v_dc = fixed(adc_.v_dc / 65536.0 * machine.plant.sensor.v_full_scale_V / kBase_V, PM_Q_BITS);
        plant_adc_t edge;
        plant_sample(plant_.get(), &edge);
        in.v_zero =
            fixed((edge.v_zero[0] - 32768) / 32768.0 * machine.plant.sensor.v_zero_full_scale_V / kBase_V,
                  PM_Q_BITS);
        if (options.legs_unknown) {
            six_step.plan[0].legs = ZERO_LEGS_APART;
        }
        seen = {sampled, sample, static_cast<zero_legs_t>(six_step.plan[0].legs), sampled_rad_, sampled_in_};
        if (++since_slow_ * period_s_ >= 1e-3) {
            since_slow_ = 0;
            six_step_slow(&six_step, &config);
        }
        if (options.virtual_third) {
            six_step_from_mean(&six_step, &sample);
        }
        in.sample = sampled ? &sample : nullptr;
        six_step_out_t out;
        const bool before = six_step.crossing.found;
        const uint32_t sector = six_step.crossing.sector;
        looked_ = now_ - 2 * machine.plant.inverter.timer_counts + six_step.plan[0].sample_at;
        if (!options.late_rule && sampled && is_late(in)) {
            in.sample = nullptr;
        }
        const bool ahead = six_step.crossing.ahead;
        six_step_step(&six_step, &config, &in, &out);
        // The instant that is kept is the one that would be made now.
        EXPECT_TRUE(six_step.moved ||
                    six_step.due == commutation_due(&six_step.commutation, &config.commutation));
        if (six_step.crossing.found && !(before && six_step.crossing.sector == sector)) {
            const double ago_s = static_cast<double>(now_ - six_step.crossing.at) * count_s_;
            crossing_deg = wrapped_deg(angle_rad() - omega_e() * ago_s -
                                       (60 + 60.0 * six_step.crossing.sector) * kDegree);
            crossings.add(crossing_deg);
            in_time.add(ahead && six_step.crossing.sector == sector ? 1 : 0);
            first_past.add(crossing_deg + static_cast<double>(looked_ - six_step.crossing.at) * count_s_ *
                                              omega_e() / kDegree);
        }
        write(out);
        followed_ = 0;
        run(asked_, sector_);
        sector_ = next_sector_;
        next_sector_ = six_step.commutation.sector;
        asked_ = out;
        follow(2.0 * machine.plant.inverter.timer_counts);
        plant_run_period(plant_.get());
        plant_truth_t t;
        plant_truth_windings(plant_.get(), &t);
        torque_ += sign_ * t.torque_Nm;
        current_ += t.i_A[0] * t.i_A[0] + t.i_A[1] * t.i_A[1] + t.i_A[2] * t.i_A[2];
        periods_++;
        now_ += 2 * machine.plant.inverter.timer_counts;
        t_s += period_s_;
    }

    void run_for(double time_s, double u)
    {
        for (const double end_s = t_s + time_s - 0.5 * period_s_; t_s < end_s;) {
            period(u);
        }
    }

    // Mean torque over rms current since the last clear().
    double torque_per_ampere() const
    {
        return torque_ / periods_ / std::sqrt(current_ / periods_);
    }

    // Current of the two legs that conduct, in the middle of the off time.
    double conducted_A() const
    {
        return std::sqrt(current_ / periods_ / 2);
    }

    void clear()
    {
        crossings = in_time = {};
        first_past = {};
        ripples = {};
        freewheels[0] = freewheels[1] = {};
        torque_ = current_ = 0;
        periods_ = 0;
        commutations = {};
        for (Statistics &s : of_sector) {
            s = {};
        }
    }

    // What is left once all has settled, over `turns` of the imposed speed.
    void measure(int settle_turns, int turns, double u)
    {
        run_for(settle_turns * turn_s_, u);
        clear();
        run_for(turns * turn_s_, u);
    }

    const Machine machine;
    const Options options;
    six_step_config_t config;
    six_step_t six_step = {};
    Statistics crossings, commutations;
    Statistics in_time;      // 1: a sample ahead of the crossing was seen
    Statistics first_past;   // the samples that have shown the crossings
    Statistics ripples;      // of the current in periods without commutation and freewheeling, A; if
    bool watch = false;      // the plant is looked at within the period,
    bool freewheel = false;  // from a commutation on until the current has ceased
    Freewheel freewheels[2]; // into even and odd sectors
    Statistics of_sector[SECTORS];
    double crossing_deg = 0;
    double t_s = 0;
    struct {
        bool there;
        zero_sample_t sample;
        zero_legs_t legs;
        double angle_rad; // at its instant
        uint32_t sector;
    } seen = {};                  // by the last step
    double wrong_reference_V = 0; // added to all terminals

  private:
    void write(const six_step_out_t &out)
    {
        plant_pwm_t pwm = {};
        uint16_t compare[PM_LEGS][2];
        pattern_write(&out.on, out.sector, six_step.reverse, compare);
        for (uint32_t k = 0; k < 3; ++k) {
            const pm_leg_t state = pm_leg(out.legs, k);
            pwm.compare[k][0] = compare[k][0];
            pwm.compare[k][1] = compare[k][1];
            pwm.driven[k] = state != PM_LEG_OFF;
            pwm.state[k] = of(state);
        }
        plant_set_pwm(plant_.get(), &pwm);
    }

    static plant_leg_state_t of(pm_leg_t state)
    {
        return state == PM_LEG_UPPER            ? PLANT_LEG_UPPER
               : state == PM_LEG_LOWER          ? PLANT_LEG_LOWER
               : state == PM_LEG_INVERTED       ? PLANT_LEG_INVERTED
               : state == PM_LEG_LOWER_INVERTED ? PLANT_LEG_LOWER_INVERTED
               : state == PM_LEG_HIGH           ? PLANT_LEG_HIGH
               : state == PM_LEG_LOW            ? PLANT_LEG_LOW
                                                : PLANT_LEG_PWM;
    }

    void commutate(const six_step_out_t &out, uint32_t from)
    {
        bool driven[PLANT_LEGS] = {};
        plant_leg_state_t state[PLANT_LEGS] = {};
        for (uint32_t k = 0; k < 3; ++k) {
            driven[k] = pm_leg(out.then, k) != PM_LEG_OFF;
            state[k] = of(pm_leg(out.then, k));
        }
        follow(out.commutate_at);
        plant_move(plant_.get(), out.commutate_at * count_s_);
        const double e = wrapped_deg(angle_rad() - (90 + 60.0 * from - options.advance_deg) * kDegree);
        commutations.add(e);
        of_sector[from].add(e);
        const sector_t next = sector_legs(sector_next(from), options.reverse);
        gone_ = next.open;
        gone_A_ = std::abs(current(gone_));
        left_rad_ = gone_A_ > 0 ? angle_rad() : 0;
        gone_odd_ = !sector_rising(sector_next(from));
        plant_drive_legs(plant_.get(), driven, state);
    }

    void run(const six_step_out_t &out, uint32_t from)
    {
        const bool first = out.commutate_at != 0 && (out.sample_at == 0 || out.commutate_at < out.sample_at);
        if (first) {
            commutate(out, from);
        }
        sampled_ = out.sample_at != 0;
        if (sampled_) {
            follow(out.sample_at);
            plant_sample_at(plant_.get(), out.sample_at * count_s_, &adc_);
            sampled_rad_ = angle_rad();
            sampled_in_ = first ? sector_next(from) : from;
        }
        if (out.commutate_at != 0 && !first) {
            commutate(out, from);
        }
    }

    // Would this sample find a crossing of which none ahead was seen?
    bool is_late(const six_step_in_t &in) const
    {
        zero_crossing_t copy = six_step.crossing;
        const six_step_plan_t &plan = six_step.plan[0];
        const bool next = plan.commutate_at != 0 && plan.commutate_at < plan.sample_at;
        if (copy.found || copy.ahead || next) {
            return false;
        }
        const zero_instant_t when = {in.now - 2U * machine.plant.inverter.timer_counts + plan.sample_at,
                                     static_cast<zero_legs_t>(plan.legs)};
        zero_expected_t expected = six_step.expected;
        expected.at = when.at; // due
        return zero_crossing_step(&copy, &config.crossing, in.sample, when, &expected);
    }

    // Up to a count of the period, in parts of it.
    void follow(double to)
    {
        if (freewheel) {
            cease(to);
        }
        followed_ = watch ? followed_ : to;
        if (!watch) {
            return;
        }
        const double part = machine.plant.inverter.timer_counts / 50.0,
                     end = 2.0 * machine.plant.inverter.timer_counts;
        if (followed_ <= 0) {
            least_ = 1e9;
            largest_ = -1e9;
            whole_ = asked_.commutate_at == 0 && current(sector_legs(sector_, options.reverse).open) == 0;
        }
        for (; followed_ < to - part; followed_ += part) {
            plant_move(plant_.get(), followed_ * count_s_);
            const double i_A = current(sector_legs(sector_, options.reverse).high);
            least_ = std::min(least_, i_A);
            largest_ = std::max(largest_, i_A);
        }
        if (to >= end && whole_) {
            ripples.add(largest_ - least_);
        }
    }

    // Up to a count of the period, in steps of 0.2 us, while the leg that has gone carries current.
    void cease(double to)
    {
        for (double at = followed_ + 0.2e-6 / count_s_; left_rad_ != 0 && at < to; at += 0.2e-6 / count_s_) {
            plant_move(plant_.get(), at * count_s_);
            if (current(gone_) == 0) {
                freewheels[gone_odd_ ? 1 : 0].angle.add(wrapped_deg(angle_rad() - left_rad_));
                freewheels[gone_odd_ ? 1 : 0].current.add(gone_A_);
                left_rad_ = 0;
            }
        }
    }

    double current(int leg) const
    {
        plant_truth_t t;
        plant_truth_windings(plant_.get(), &t);
        return t.i_A[leg];
    }

    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_{nullptr, &plant_destroy};
    const double period_s_, count_s_, sign_;
    double turn_s_ = 0, torque_ = 0, current_ = 0;
    int periods_ = 0, since_slow_ = 0;
    double followed_ = 0, least_ = 0, largest_ = 0;
    bool whole_ = false, gone_odd_ = false;
    int gone_ = 0;
    double gone_A_ = 0, left_rad_ = 0;
    uint32_t now_ = 0, looked_ = 0, sector_ = 0, next_sector_ = 0;
    bool sampled_ = false;
    double sampled_rad_ = 0;
    uint32_t sampled_in_ = 0;
    plant_adc_t adc_ = {};
    six_step_out_t asked_ = {};
};

// Share of v_dc that drives about i_A at this speed.
inline double duty(const Machine &m, double omega_e_rad_s, double i_A)
{
    const double line = m.trapezoid ? 2 : std::sqrt(3.0) * 3 / kPi;
    return (line * m.peak_Vs() * omega_e_rad_s + 2 * m.plant.machine.R_s_ohm * i_A) / 24;
}

inline double electrical(const Machine &m, double rpm)
{
    return rpm * 2 * kPi / 60 * m.plant.machine.pole_pairs;
}

} // namespace bldc_rig

#endif
