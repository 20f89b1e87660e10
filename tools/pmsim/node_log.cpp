#include "tools/pmsim/node_log.h"

#include <cstdio>

#include <unistd.h>

#include "tools/pmsim/names.h"

namespace pmsim
{

constexpr double live_s = 0.2; // between two live lines
const char *const to_line_start = "\r\033[K";

NodeLog::NodeLog(bool quiet) : quiet_(quiet), live_(!quiet && isatty(STDOUT_FILENO) != 0)
{
}

void NodeLog::say(double t_s, const std::string &text)
{
    if (!quiet_) {
        std::printf("%s%10.3f s  %s\n", live_ ? to_line_start : "", t_s, text.c_str());
        std::fflush(stdout);
    }
}

void NodeLog::drive(double t_s, const rig_sample_t &sample)
{
    // A fault is known one control period before the state that it leads to.
    const int state = sample.fault != 0 ? RIG_FAULT : sample.state;
    if (state != state_ || sample.fault != fault_) {
        state_ = state;
        fault_ = sample.fault;
        const std::string fault = fault_ != 0 ? " " + name_of(fault_names(), fault_) : "";
        say(t_s, name_of(state_names(), state_) + fault);
    }
    if (live_ && t_s >= next_s_) {
        next_s_ = t_s + live_s;
        show(t_s, sample);
    }
}

void NodeLog::show(double t_s, const rig_sample_t &sample)
{
    std::printf("%s%10.1f s  %-12s %9.2f rad/s  %8.3f Nm", to_line_start, t_s,
                name_of(state_names(), sample.state).c_str(), sample.truth.omega_mech_rad_s,
                sample.truth.torque_Nm);
    std::fflush(stdout);
}

void NodeLog::bus(double t_s, hal_can_state_t state)
{
    if (state != bus_) {
        bus_ = state;
        say(t_s, state == HAL_CAN_ACTIVE    ? "bus active"
                 : state == HAL_CAN_PASSIVE ? "bus: error passive"
                                            : "bus off");
    }
}

void NodeLog::lines(double t_s, const char *holding)
{
    if (holding != holding_) {
        holding_ = holding;
        say(t_s,
            holding == nullptr ? "bridge released by the lines" : std::string("bridge held off: ") + holding);
    }
}

void NodeLog::end()
{
    if (live_) {
        std::printf("\n");
        std::fflush(stdout);
    }
}

} // namespace pmsim
