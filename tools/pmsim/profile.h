// Plays the profile of a scenario on the rig: before each control period, what the world does now.
#ifndef PMSIM_PROFILE_H
#define PMSIM_PROFILE_H

#include <array>
#include <vector>

#include "tools/pmsim/scenario.h"

extern "C" {
#include "tools/pmsim/rig.h"
}

namespace pmsim
{

class Profile
{
  public:
    Profile(const Scenario &scenario, rig_t *rig);

    // Once per period, with the state and the true speed of the last one.
    void play(double t_s, int state, double omega_mech_rad_s);

    double load_Nm() const; // at the shaft in the coming period
    double speed_ref_rad_s() const;
    int direction() const; // of the command; 0 when not enabled
    const rig_command_t &command() const;
    bool command_changed() const; // by the last play()

  private:
    struct Ramp {
        double now = 0.0, from = 0.0, to = 0.0, t0_s = 0.0, t1_s = 0.0;
        bool moving = false;
    };

    void start_events(double t_s, double omega_mech_rad_s);
    void start(const Event &event, double t_s, double omega_mech_rad_s);
    void start_switches(const Event &event);
    void start_faults(const Event &event);
    void move_ramps(double t_s);
    void apply(Channel channel, double value);
    void apply_load(double omega_mech_rad_s);
    Ramp &ramp(Channel channel);
    const Ramp &ramp(Channel channel) const;

    const Scenario &scenario_;
    rig_t *rig_;
    std::vector<bool> done_;
    size_t pending_;
    std::array<double, RIG_STATES> entered_s_; // NaN: not yet
    std::array<Ramp, channel_count> ramps_;
    bool any_moving_ = false, imposed_ = false, command_changed_ = false;
    rig_command_t command_{};
    double load_Nm_ = 0.0;
};

} // namespace pmsim

#endif
