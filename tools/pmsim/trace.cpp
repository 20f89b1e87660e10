#include "tools/pmsim/trace.h"

#include <cmath>

#include "tools/pmsim/loop.h"
#include "tools/pmsim/names.h"

namespace pmsim
{
namespace
{

const uint64_t most_rows = 20000;
const double two_pi = 6.283185307179586;
const double to_deg = 360.0 / two_pi;

struct Column {
    const char *name;
    int digits;
    double (*value)(const Sample &);
};

#define PM_COLUMN(name, digits, expression)                                                                  \
    {                                                                                                        \
        name, digits, [](const Sample &s) -> double { return expression; }                                   \
    }

const Column columns[] = {
    PM_COLUMN("t_s", 9, s.rig.truth.t_s),
    PM_COLUMN("theta_e_rad", 6,
              s.rig.truth.theta_e_rad - two_pi * std::floor(s.rig.truth.theta_e_rad / two_pi)),
    PM_COLUMN("theta_hat_rad", 6, s.rig.theta_hat_e_rad),
    PM_COLUMN("angle_error_deg", 5, s.rig.angle_error_rad *to_deg),
    PM_COLUMN("omega_mech_rad_s", 6, s.rig.truth.omega_mech_rad_s),
    PM_COLUMN("omega_hat_mech_rad_s", 6, s.rig.omega_hat_mech_rad_s),
    PM_COLUMN("omega_ref_mech_rad_s", 6, s.rig.omega_ref_mech_rad_s),
    PM_COLUMN("omega_command_mech_rad_s", 6, s.speed_ref_rad_s),
    PM_COLUMN("ia_A", 5, s.rig.truth.i_A[0]),
    PM_COLUMN("ib_A", 5, s.rig.truth.i_A[1]),
    PM_COLUMN("ic_A", 5, s.rig.truth.i_A[2]),
    PM_COLUMN("id_A", 5, s.rig.truth.i_d_A),
    PM_COLUMN("iq_A", 5, s.rig.truth.i_q_A),
    PM_COLUMN("id_hat_A", 5, s.rig.i_d_hat_A),
    PM_COLUMN("iq_hat_A", 5, s.rig.i_q_hat_A),
    PM_COLUMN("id_ref_A", 5, s.rig.i_d_ref_A),
    PM_COLUMN("iq_ref_A", 5, s.rig.i_q_ref_A),
    PM_COLUMN("v_alpha_V", 5, s.rig.truth.v_mean_alpha_V),
    PM_COLUMN("v_beta_V", 5, s.rig.truth.v_mean_beta_V),
    PM_COLUMN("v_alpha_hat_V", 5, s.rig.v_alpha_V),
    PM_COLUMN("v_beta_hat_V", 5, s.rig.v_beta_V),
    PM_COLUMN("torque_Nm", 5, s.rig.truth.torque_Nm),
    PM_COLUMN("load_Nm", 5, s.load_Nm),
    PM_COLUMN("v_dc_V", 5, s.rig.truth.v_dc_V),
    PM_COLUMN("v_dc_hat_V", 5, s.rig.v_dc_hat_V),
    PM_COLUMN("weight", 4, s.rig.weight),
    PM_COLUMN("quality", 4, s.rig.quality),
    PM_COLUMN("limits", 9, double(s.rig.limits)),
};

#undef PM_COLUMN

// All that opposes the motion, on the rotor's side of an elastic shaft as on the other.
double loads_Nm(const plant_mech_t &mech, double pole_pairs, const Sample &sample)
{
    const plant_truth_t &truth = sample.rig.truth;
    const double w = truth.omega_mech_rad_s;
    double sum = sample.load_Nm + (mech.load_Nms + mech.load_Nms2 * std::fabs(w)) * w + mech.B_Nms * w;
    sum += w > 0.0 ? mech.T_coulomb_Nm : (w < 0.0 ? -mech.T_coulomb_Nm : 0.0);
    for (const plant_harmonic_t &h : mech.load_angle) {
        sum += h.order == 0 ? 0.0
                            : h.amplitude * std::cos(h.order * truth.theta_e_rad / pole_pairs + h.phase_rad);
    }
    return sum;
}

} // namespace

TraceWriter::TraceWriter(const std::string &path, const Scenario &scenario, uint64_t decimate)
    : path_(path), mech_(scenario.setup.plant.mech), pole_pairs_(scenario.setup.plant.machine.pole_pairs),
      file_(std::fopen(path.c_str(), "w")), decimate_(decimate)
{
    if (!file_) {
        throw InputError(path + ": cannot be written");
    }
    if (decimate_ == 0) {
        decimate_ = 1 + (period_count(scenario) - 1) / most_rows;
    }
    for (const Column &column : columns) {
        std::fprintf(file_.get(), "%s,", column.name);
    }
    std::fputs("loads_Nm,open_loop,driven,state,fault\n", file_.get());
}

void TraceWriter::add(const Sample &sample)
{
    if (count_++ % decimate_ != 0) {
        return;
    }
    char row[1024];
    int length = 0;
    for (const Column &column : columns) {
        const auto room = sizeof row - static_cast<size_t>(length);
        length += std::snprintf(row + length, room, "%.*g,", column.digits, column.value(sample));
    }
    std::fprintf(file_.get(), "%s%.5g,%d,%d,%s,%s\n", row, loads_Nm(mech_, pole_pairs_, sample),
                 sample.rig.dragged ? 1 : 0, sample.rig.driven ? 1 : 0,
                 name_of(state_names(), sample.rig.state).c_str(),
                 name_of(fault_names(), sample.rig.fault).c_str());
}

void TraceWriter::close()
{
    const bool failed = std::ferror(file_.get()) != 0 || std::fflush(file_.get()) != 0;
    file_.reset();
    if (failed) {
        throw InputError(path_ + ": write error");
    }
}

} // namespace pmsim
