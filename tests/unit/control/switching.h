// Regulators that give switch states, on the winding of a machine.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "firmware/math/legs.h"
#include "firmware/params/parameters.h"
#include "tests/contract/observers.h"
#include "tests/contract/winding.h"

namespace switching
{

using bench::Complex;

// 20 kHz, as the acceptance table has it, and the two machines without saturation.
struct Bench {
    const char *name;
    bench::Machine machine;
    bench::Base base;
    double link_V, rated_rad_s; // mechanical
    double i_rated_A;

    double link() const
    {
        return link_V / base.v_V;
    }

    double omega() const // electrical, 30 % of rated speed, per-unit
    {
        return 0.3 * rated_rad_s * machine.pole_pairs / base.omega_rad_s;
    }

    Complex emf() const
    {
        return bench::kJ * omega() * machine.psi_m_Wb / base.psi_Wb();
    }
};

inline Bench ipm(double period_s = 50e-6)
{
    return {"ipm", bench::kIpmLinear, {450, 8, 540, period_s}, 300, 104.72, 4};
}

inline Bench spm(double period_s = 50e-6)
{
    return {"spm", bench::kSpmLinear, {450, 10, 1000, period_s}, 36, 41.888, 4};
}

// L_share: of the inductances told. A start without injection.
inline drive_params_t parameters(const Bench &b, regulator_id_t regulator, double L_share = 1)
{
    drive_params_t p = bench::parameters(b.machine, b.base);
    p.regulator = regulator;
    p.start_method = 2;
    p.i_rated = static_cast<int32_t>(std::lround(1e3 * b.i_rated_A));
    p.i_max = p.i_rated * 9 / 8;
    p.i_trip = p.i_rated * 3 / 2;
    for (int32_t *L : {&p.L_d, &p.L_q, &p.L_dh_rated, &p.L_qh_rated, &p.L_q_rated}) {
        *L = static_cast<int32_t>(std::lround(*L * L_share));
    }
    return p;
}

inline regulator_config_t config(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(r.ok) << r.reason;
    return c.regulator;
}

inline Complex voltage_of(uint16_t legs, double link)
{
    double v[3];
    for (uint32_t leg = 0; leg < 3; ++leg) {
        EXPECT_TRUE(pm_leg(legs, leg) == PM_LEG_HIGH || pm_leg(legs, leg) == PM_LEG_LOW);
        v[leg] = pm_leg(legs, leg) == PM_LEG_HIGH ? link : 0;
    }
    return {(2 * v[0] - v[1] - v[2]) / 3, (v[1] - v[2]) / std::sqrt(3.0)};
}

inline int moved(uint16_t a, uint16_t b)
{
    int n = 0;
    for (uint32_t leg = 0; leg < 3; ++leg) {
        n += pm_leg(a, leg) != pm_leg(b, leg) ? 1 : 0;
    }
    return n;
}

inline uint16_t all_states(int n)
{
    const auto state = [n](int bit) { return (n >> bit & 1) != 0 ? PM_LEG_HIGH : PM_LEG_LOW; };
    return pm_legs_of(state(0), state(1), state(2));
}

inline pm_half_dir_t half_direction(double angle)
{
    return {bench::fixed(std::cos(angle), 30), bench::fixed(std::sin(angle), 30)};
}

// A regulator and its winding at constant speed, from no current on.
class Loop
{
  public:
    Loop(const Bench &b, const regulator_config_t &c, double omega)
        : bench_(b), config_(c), omega_(omega), winding_(b.machine, b.base, omega)
    {
        const Complex emf = bench::kJ * omega * b.machine.psi_m_Wb / b.base.psi_Wb();
        regulator_reset(&self_, &config_, bench::dq(emf), {0, 0}, bench::fixed(omega, 28));
    }

    // A period towards a current, all in A; what was chosen may be changed before it acts.
    template <typename Change> Complex run(Complex i_ref, Change change)
    {
        const double turn = omega_ * bench_.base.omega_rad_s * bench_.base.period_s;
        const regulator_in_t in = {bench::dq(winding_.i()),
                                   bench::dq(i_ref / bench_.base.i_A),
                                   bench::fixed(omega_, 28),
                                   PM_ONE,
                                   half_direction(theta_ + 1.5 * turn),
                                   bench::fixed(bench_.link(), 28)};
        regulator_out_t out = {};
        regulator_step(&self_, &config_, &in, &out);
        change(self_, out);
        winding_.run({bench::real(out.v.d, 22), bench::real(out.v.q, 22)});
        theta_ = std::remainder(theta_ + turn, 2 * bench::kPi);
        return i();
    }

    Complex run(Complex i_ref)
    {
        return run(i_ref, [](regulator_t &, regulator_out_t &) {});
    }

    Complex i() const
    {
        return winding_.i() * bench_.base.i_A;
    }

  private:
    Bench bench_;
    regulator_config_t config_;
    double omega_;
    bench::Winding winding_;
    regulator_t self_ = {};
    double theta_ = 0;
};

} // namespace switching
