#include "tools/pmsim/machine_variables.h"

#include <algorithm>

#include "firmware/drive/config.h"
#include "firmware/params/parameters.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double two_pi = 6.283185307179586;

// Of the demonstration, for a pace of 1, s.
const double found_s = 0.4, up_s = 1.05, turned_s = 1.3, stopped_s = 0.55, loaded_s = 0.18;
const double dip = 0.3;     // of rated speed; under a fan the integral then settles with 2 dip load_ramp_s
const double settled = 4.0; // of its speed control's bandwidth, Hz s

double si(const Setup &setup, drive_param_id_t id)
{
    return parameter_si(*setup.params, id);
}

// What the drive refuses is said when it is made.
bool starts_by_saliency(const Setup &setup)
{
    drive_config_t config = {};
    return drive_configure(&config, setup.params.get(), PM_CHANNELS).ok && config.injection;
}

double load_ramp_s(const Setup &setup)
{
    const double w_s = two_pi * si(setup, DRIVE_PARAM_speed_bandwidth);
    const double speed = setup.rated.speed_rated_rad_s;
    const double lost = setup.rated.torque_rated_Nm / (setup.plant.mech.J_kgm2 * w_s); // by a step
    return lost <= dip * speed ? 0.0 : 4.0 * lost / (w_s * dip * speed);
}

double pace(const Setup &setup, bool salient, double load_s)
{
    const double ramp_s = setup.rated.speed_rated_rad_s / si(setup, DRIVE_PARAM_acceleration);
    const double dragged_s =
        salient ? 0.0
                : si(setup, DRIVE_PARAM_speed_high) / si(setup, DRIVE_PARAM_open_loop_acceleration) + 0.1;
    const double late_s = salient ? 0.0 : std::max(0.0, si(setup, DRIVE_PARAM_t_align) + 0.1 - found_s);
    return std::max({1.0, (late_s + dragged_s + ramp_s) / up_s, 2.0 * (dragged_s + ramp_s) / turned_s,
                     (dragged_s + ramp_s) / stopped_s, settled / si(setup, DRIVE_PARAM_speed_bandwidth),
                     load_s / loaded_s});
}

} // namespace

Variables machine_variables(const Setup &setup)
{
    const int digits = 12;
    const bool salient = starts_by_saliency(setup);
    const double load_s = load_ramp_s(setup);
    return {
        {"machine", setup.name},
        {"salient", salient ? "1" : "0"},
        {"round", salient ? "0" : "1"},
        {"pole_deg", format(360.0 / si(setup, DRIVE_PARAM_pole_pairs), digits)},
        {"load_ramp_s", format(load_s, digits)},
        {"pace", format(pace(setup, salient, load_s), digits)},
    };
}

} // namespace pmsim
