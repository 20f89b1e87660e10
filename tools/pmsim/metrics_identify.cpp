// What the drive has identified against the plant's own data.
#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>

#include "firmware/params/parameters.h"
#include "tools/pmsim/drive_parameters.h"
#include "tools/pmsim/names.h"

namespace pmsim
{
namespace
{

// The energy form at a pair of currents: flux linkages by Newton, and their tangent.
class Point
{
  public:
    Point(const plant_machine_t &m, double i_d_A, double i_q_A) : m_(m)
    {
        const double i_f_A = m.psi_m_Wb / m.L_d0_H + m.c_A_Wb5 * std::pow(m.psi_m_Wb, 5);
        psi_d_ = m.psi_m_Wb + m.L_d0_H * i_d_A;
        psi_q_ = m.L_q0_H * i_q_A;
        for (int n = 0; n < 50; ++n) {
            const double s = psi_d_ * psi_d_ + psi_q_ * psi_q_;
            const double e_d = i_d_A + i_f_A - psi_d_ / m.L_d0_H - m.c_A_Wb5 * psi_d_ * s * s;
            const double e_q = i_q_A - psi_q_ / m.L_q0_H - m.c_A_Wb5 * psi_q_ * s * s;
            tangent(s);
            const double D = dd_ * qq_ - dq_ * dq_;
            psi_d_ += (qq_ * e_d - dq_ * e_q) / D;
            psi_q_ += (dd_ * e_q - dq_ * e_d) / D;
        }
        tangent(psi_d_ * psi_d_ + psi_q_ * psi_q_);
    }

    double psi_q() const
    {
        return psi_q_;
    }

    double L_dh() const
    {
        return qq_ / (dd_ * qq_ - dq_ * dq_);
    }

    double L_qh() const
    {
        return dd_ / (dd_ * qq_ - dq_ * dq_);
    }

    double L_dqh() const
    {
        return -dq_ / (dd_ * qq_ - dq_ * dq_);
    }

  private:
    void tangent(double s)
    {
        const double k = 4 * m_.c_A_Wb5 * s;
        dd_ = 1 / m_.L_d0_H + m_.c_A_Wb5 * s * s + k * psi_d_ * psi_d_;
        qq_ = 1 / m_.L_q0_H + m_.c_A_Wb5 * s * s + k * psi_q_ * psi_q_;
        dq_ = k * psi_d_ * psi_q_;
    }

    plant_machine_t m_;
    double psi_d_, psi_q_, dd_ = 0, qq_ = 0, dq_ = 0;
};

// With the i_d of most torque per ampere by the inductances at zero current.
Point on_trajectory(const Setup &setup, double i_A)
{
    const plant_machine_t &m = setup.plant.machine;
    const Point zero(m, 0, 0);
    const double dL_H = zero.L_qh() - zero.L_dh();
    const double h_A = dL_H > 0.05 * zero.L_qh() ? m.psi_m_Wb / (2 * dL_H) : 0;
    return {m, h_A > 0 ? h_A - std::hypot(h_A, i_A) : 0, i_A};
}

Point rated_point(const Setup &setup)
{
    return on_trajectory(setup, setup.rated.i_rated_A);
}

class Identified : public Metric
{
  public:
    Identified(const Expectation &e, const Setup &setup) : kind_(e.metric), setup_(setup)
    {
    }

    void add(const Sample &s) override
    {
        last_ = s.rig.identified;
    }

    MetricValue value() const override
    {
        if (kind_ == "identify_state") {
            return {double(last_.state), name_of(identify_state_names(), last_.state)};
        }
        if (kind_ == "identify_reason") {
            return {double(last_.reason), name_of(identify_reason_names(), last_.reason)};
        }
        return {error(), ""};
    }

  private:
    // The inductance along an axis relative to itself, the cross one to L_qh: the largest of the three.
    static double largest(const rig_saliency_t &found, const Point &truth)
    {
        if (found.L_qh_H == 0) {
            return std::numeric_limits<double>::quiet_NaN();
        }
        return std::max({std::abs(found.L_dh_H / truth.L_dh() - 1), std::abs(found.L_qh_H / truth.L_qh() - 1),
                         std::abs(found.L_dqh_H - truth.L_dqh()) / truth.L_qh()});
    }

    // Of all points; flat: were they all as without current.
    double map_error(bool flat) const
    {
        double most = 0;
        for (int row = 0; row < RIG_MAP_SIDE; ++row) {
            for (int column = 0; column < RIG_MAP_SIDE; ++column) {
                const double quarter_A = last_.map_current_A / 4;
                const Point truth(setup_.plant.machine, (column - 2) * quarter_A, row * quarter_A);
                const double error = largest(flat ? last_.map[0][2] : last_.map[row][column], truth);
                most = std::isnan(most) || error <= most ? most : error;
            }
        }
        return most;
    }

    // I_p and I_n of a carrier of f_pwm / 20, whose flux the samples see as V_h T_s / (2 sin(pi / 20)).
    double circle_error() const
    {
        const Point zero(setup_.plant.machine, 0, 0);
        const double v_V = parameter_si(*setup_.params, DRIVE_PARAM_v_injection);
        const double flux_Wb = v_V / setup_.plant.inverter.f_pwm_Hz / (2 * std::sin(M_PI / 20));
        const double centre_A = flux_Wb * (1 / zero.L_dh() + 1 / zero.L_qh()) / 2;
        const double radius_A = flux_Wb * (1 / zero.L_dh() - 1 / zero.L_qh()) / 2;
        return std::max(std::abs(relative(last_.circle_centre_A, centre_A)),
                        std::abs(relative(last_.circle_radius_A, radius_A)));
    }

    double table_error() const
    {
        const double i_A = last_.map_current_A;
        return std::max(largest(last_.half, on_trajectory(setup_, i_A / 2)),
                        largest(last_.rated, on_trajectory(setup_, i_A)));
    }

    static double relative(double found, double truth)
    {
        return found == 0 ? std::numeric_limits<double>::quiet_NaN() : found / truth - 1;
    }

    // Of the sum of the terminals that the star of resistors makes, with weights by their conductances.
    std::complex<double> star() const
    {
        std::complex<double> weighed = 0;
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            const double conductance = 1 / (1 + setup_.plant.sensor.v_zero_network_error[k]);
            weighed += std::polar(conductance, k * 2 * std::acos(-1.0) / 3);
            sum += conductance;
        }
        return weighed / sum;
    }

    double error() const
    {
        const plant_machine_t &m = setup_.plant.machine;
        const plant_inverter_t &inverter = setup_.plant.inverter;
        const Point zero(m, 0, 0);
        if (kind_ == "identify_R_s_error_rel") {
            return relative(last_.R_s_ohm, m.R_s_ohm + inverter.r_on_ohm);
        }
        if (kind_ == "identify_L_d_error_rel") {
            return relative(last_.L_d_H, zero.L_dh());
        }
        if (kind_ == "identify_L_q_error_rel") {
            return relative(last_.L_q_H, zero.L_qh());
        }
        if (kind_ == "identify_L_q_rated_error_rel") {
            return relative(last_.L_q_rated_H, rated_point(setup_).psi_q() / setup_.rated.i_rated_A);
        }
        if (kind_ == "identify_L_qh_rated_error_rel") {
            return relative(last_.L_qh_rated_H, rated_point(setup_).L_qh());
        }
        if (kind_ == "identify_L_dq_error_rel") { // of L_q
            return (last_.L_dq_rated_H - rated_point(setup_).L_dqh()) / zero.L_qh();
        }
        if (kind_ == "identify_psi_m_error_rel") {
            return relative(last_.psi_m_Wb, m.psi_m_Wb);
        }
        if (kind_ == "identify_J_error_rel") {
            return relative(last_.J_kgm2, setup_.plant.mech.J_kgm2);
        }
        if (kind_ == "identify_lost_error_rel") {
            const double gap = inverter.dead_time_s * inverter.f_pwm_Hz;
            const double lost_V = gap * setup_.plant.dclink.v_source_V + inverter.v_switch_V * (1 - 2 * gap) +
                                  inverter.v_diode_V * 2 * gap;
            return relative(last_.lost_V, lost_V);
        }
        if (kind_ == "identify_map_error_rel") {
            return map_error(false);
        }
        if (kind_ == "identify_map_flat_error_rel") {
            return map_error(true);
        }
        if (kind_ == "identify_circle_error_rel") {
            return circle_error();
        }
        if (kind_ == "identify_table_error_rel") {
            return table_error();
        }
        if (kind_ == "identify_dL_0_error_rel") {
            return relative(last_.dL_0_H, setup_.plant.winding.dL_0_H);
        }
        if (kind_ == "identify_L_c0_error_rel") { // of dL_0
            return (last_.L_c0_H - setup_.plant.winding.L_c0_H) / setup_.plant.winding.dL_0_H;
        }
        if (kind_ == "identify_star_error") {
            return std::abs(std::complex<double>(last_.star[0], last_.star[1]) - star());
        }
        if (kind_ == "identify_zero_falls") {
            return last_.zero_falls;
        }
        if (kind_ == "identify_leg_capacitance_F") {
            return last_.move_A * inverter.dead_time_s / setup_.plant.dclink.v_source_V;
        }
        const double speed_rad_s = setup_.rated.speed_rated_rad_s; // friction at rated speed, of rated torque
        const double truth_Nm = setup_.plant.mech.B_Nms * speed_rad_s + setup_.plant.mech.T_coulomb_Nm;
        const double found_Nm = last_.viscous_Nms * speed_rad_s + last_.coulomb_Nm;
        return (found_Nm - truth_Nm) / setup_.rated.torque_rated_Nm;
    }

    std::string kind_;
    const Setup &setup_;
    rig_identified_t last_{};
};

SpecialMetric number(const std::string &name, const std::string &help)
{
    return {{name, "1", help, false, false, {}}, make_special<Identified>};
}

} // namespace

std::vector<SpecialMetric> identify_metrics()
{
    return {
        {{"identify_state", "", "of the identification", true, false, identify_state_names()},
         make_special<Identified>},
        {{"identify_reason", "", "why the identification failed", true, false, identify_reason_names()},
         make_special<Identified>},
        number("identify_R_s_error_rel", "resistance found against winding and switch"),
        number("identify_lost_error_rel", "voltage that a leg loses, found against dead time and drops"),
        {{"identify_leg_capacitance_F", "F", "output capacitance of a leg found", false, false, {}},
         make_special<Identified>},
        number("identify_L_d_error_rel", "L_d at zero current, found against the plant's"),
        number("identify_L_q_error_rel", "L_q at zero current, found against the plant's"),
        number("identify_L_q_rated_error_rel", "psi_q / i_q at rated current, found against the plant's"),
        number("identify_L_qh_rated_error_rel",
               "incremental L_q at rated current, estimated against the plant's"),
        number("identify_L_dq_error_rel", "error of the cross inductance at rated current, of L_q"),
        number("identify_map_error_rel", "largest error of the saliency map's inductances; L_dqh: of L_qh"),
        number("identify_map_flat_error_rel", "the same, were all of the map as without current"),
        number("identify_circle_error_rel",
               "larger error of centre and radius of the saliency circle without current"),
        number("identify_table_error_rel",
               "largest error of the inductances at half and all of the map's current, drive's i_d"),
        number("identify_dL_0_error_rel", "dL_0 found against the plant's"),
        number("identify_L_c0_error_rel", "error of L_c0, of dL_0"),
        number("identify_star_error", "error of what unlike resistors of the star make of the legs' voltage"),
        number("identify_zero_falls", "what was found of zero_falls; 2: not known"),
        number("identify_psi_m_error_rel", "magnet flux found against the plant's"),
        number("identify_J_error_rel", "inertia found against the plant's"),
        number("identify_friction_error_rel", "error of the friction at rated speed, of rated torque"),
    };
}

} // namespace pmsim
