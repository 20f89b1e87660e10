#ifndef TESTS_UNIT_SIM_PLANT_DIODE_BRIDGE_H
#define TESTS_UNIT_SIM_PLANT_DIODE_BRIDGE_H

#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace rig
{

// A linear round machine on legs and diodes, by implicit Euler in 50 ns steps: in each, every combination of
// the undriven legs being open, on their lower or on their upper diode is tried until one contradicts
// nothing. It knows no events.
class DiodeBridge
{
  public:
    enum Leg { open, low, high, driven_low, driven_high };
    static constexpr double h = 50e-9;

    DiodeBridge(const plant_config_t &config, double omega_mech, double theta_e)
        : c(config), w(config.machine.pole_pairs * omega_mech), theta(theta_e)
    {
    }

    std::array<double, 3> i_A{};
    double e_in_J = 0.0;

    // gate[k]: driven_low, driven_high, or open for a leg left to its diodes
    void step(const std::array<Leg, 3> &gate)
    {
        theta += h * w;
        std::array<double, 3> e;
        for (size_t k = 0; k < 3; k++) {
            e[k] = -w * c.machine.psi_m_Wb * std::sin(theta - static_cast<double>(k) * 2 * pi / 3);
        }
        for (int combination = 0; combination < 27; combination++) {
            std::array<Leg, 3> leg = {Leg(combination % 3), Leg(combination / 3 % 3), Leg(combination / 9)};
            bool repeats = false;
            for (size_t k = 0; k < 3; k++) {
                repeats = repeats || (gate[k] != open && leg[k] != open);
                leg[k] = gate[k] != open ? gate[k] : leg[k];
            }
            if (!repeats && fits(leg, e)) {
                return;
            }
        }
        FAIL() << "no combination fits";
    }

  private:
    double rail_V(Leg leg) const
    {
        double v_d = c.inverter.v_diode_V, v_dc = c.dclink.v_source_V;
        return leg == low ? -v_d : leg == high ? v_dc + v_d : leg == driven_high ? v_dc : 0.0;
    }

    bool fits(const std::array<Leg, 3> &leg, const std::array<double, 3> &e)
    {
        double l = c.machine.L_d0_H / h, r = c.machine.R_s_ohm + c.inverter.r_on_ohm;
        double star = 0.0; // potential of the star point
        int tied = 0;
        for (size_t k = 0; k < 3; k++) {
            if (leg[k] != open) {
                star += rail_V(leg[k]) - e[k] + l * i_A[k];
                tied++;
            }
        }
        star = tied > 0 ? star / tied : 0.0;
        std::array<double, 3> next{};
        double highest = -1e9, lowest = 1e9, i_dc = 0.0;
        for (size_t k = 0; k < 3; k++) {
            if (leg[k] == open) {
                double u = star + e[k] - l * i_A[k];
                highest = std::max(highest, u);
                lowest = std::min(lowest, u);
                continue;
            }
            next[k] = (rail_V(leg[k]) - star - e[k] + l * i_A[k]) / (l + r);
            if ((leg[k] == low && next[k] < 0.0) || (leg[k] == high && next[k] > 0.0)) {
                return false;
            }
            i_dc += leg[k] == high || leg[k] == driven_high ? next[k] : 0.0;
        }
        bool beyond = tied == 0 ? highest - lowest > rail_V(high) - rail_V(low)
                                : highest > rail_V(high) || lowest < rail_V(low);
        if (beyond || (tied == 1 && std::count_if(leg.begin(), leg.end(),
                                                  [](Leg x) { return x == low || x == high; }) == 1)) {
            return false;
        }
        i_A = next;
        e_in_J += h * c.dclink.v_source_V * i_dc;
        return true;
    }

    plant_config_t c;
    double w, theta;
};

} // namespace rig

#endif
