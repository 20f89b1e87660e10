#include "tools/pmsim/profile.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace pmsim
{

static const double room_degC = 25.0;

Profile::Profile(const Scenario &scenario, rig_t *rig)
    : scenario_(scenario), rig_(rig), done_(scenario.profile.size(), false), pending_(done_.size())
{
    entered_s_.fill(std::numeric_limits<double>::quiet_NaN());
    const auto preset = [this](Channel channel, double value) { ramp(channel).now = value; };
    preset(Channel::v_source_V, scenario.setup.plant.dclink.v_source_V);
    preset(Channel::temperature_degC, room_degC);
    preset(Channel::winding_degC, room_degC);
    preset(Channel::magnet_degC, room_degC);
    preset(Channel::R_s_ohm, scenario.setup.plant.machine.R_s_ohm);
    preset(Channel::psi_m_Wb, scenario.setup.plant.machine.psi_m_Wb);
    preset(Channel::L_d0_H, scenario.setup.plant.machine.L_d0_H);
    preset(Channel::L_q0_H, scenario.setup.plant.machine.L_q0_H);
    preset(Channel::c_A_Wb5, scenario.setup.plant.machine.c_A_Wb5);
    rig_set_temperature(rig, room_degC);
    rig_set_break(rig, scenario.setup.i_break_A);
}

Profile::Ramp &Profile::ramp(Channel channel)
{
    return ramps_[static_cast<size_t>(channel)];
}

const Profile::Ramp &Profile::ramp(Channel channel) const
{
    return ramps_[static_cast<size_t>(channel)];
}

void Profile::play(double t_s, int state, double omega_mech_rad_s)
{
    double &entered = entered_s_[static_cast<size_t>(state)];
    if (std::isnan(entered)) {
        entered = t_s;
    }
    command_changed_ = false;
    if (pending_ > 0) {
        start_events(t_s, omega_mech_rad_s);
    }
    if (any_moving_) {
        move_ramps(t_s);
    }
    if (command_changed_) {
        rig_command(rig_, &command_);
    }
    apply_load(omega_mech_rad_s);
}

void Profile::start_events(double t_s, double omega_mech_rad_s)
{
    const double slack_s = 1e-9; // times in the file are decimals
    for (size_t i = 0; i < done_.size(); ++i) {
        const Event &event = scenario_.profile[i];
        const double origin_s = event.state ? entered_s_[static_cast<size_t>(*event.state)] : 0.0;
        if (!done_[i] && t_s + slack_s >= origin_s + event.t_s) { // false while the origin is NaN
            start(event, t_s, omega_mech_rad_s);
            done_[i] = true;
            --pending_;
        }
    }
}

void Profile::start(const Event &event, double t_s, double omega_mech_rad_s)
{
    start_switches(event);
    start_faults(event);
    for (size_t i = 0; i < channel_count; ++i) {
        if (!event.targets[i]) {
            continue;
        }
        const auto channel = static_cast<Channel>(i);
        Ramp &r = ramps_[i];
        if (channel == Channel::imposed_speed_rad_s && !imposed_) {
            imposed_ = true;
            r.now = omega_mech_rad_s;
        }
        r.from = r.now;
        r.to = *event.targets[i];
        r.t0_s = t_s;
        r.t1_s = t_s + event.ramp_s;
        r.moving = event.ramp_s > 0.0;
        any_moving_ = any_moving_ || r.moving;
        if (!r.moving) {
            r.now = r.to;
            apply(channel, r.now);
        }
    }
}

void Profile::start_switches(const Event &event)
{
    plant_t *plant = rig_plant(rig_);
    if (event.enable || event.mode) {
        command_.enable = event.enable.value_or(command_.enable);
        command_.mode = event.mode.value_or(command_.mode);
        command_changed_ = true;
    }
    if (event.locked) {
        plant_set_locked(plant, *event.locked);
    }
    if (event.free) {
        plant_free_speed(plant);
        imposed_ = false;
        ramp(Channel::imposed_speed_rad_s).moving = false;
    }
    if (event.rotor_slip_rad) {
        plant_turn_rotor(plant, *event.rotor_slip_rad);
    }
    if (event.estimate_turn_rad && !rig_turn_estimate(rig_, *event.estimate_turn_rad)) {
        throw std::runtime_error("estimate_turn_deg: the drive has no estimate that can be turned");
    }
    if (event.clear_fault) {
        rig_clear_fault(rig_);
    }
}

void Profile::start_faults(const Event &event)
{
    plant_t *plant = rig_plant(rig_);
    for (size_t leg = 0; leg < PLANT_LEGS; ++leg) {
        if (event.sensor_offset_A) {
            plant_sensor(plant)->offset_A[leg] = (*event.sensor_offset_A)[leg];
        }
        if (event.sensor_gain_error) {
            plant_sensor(plant)->gain_error[leg] = (*event.sensor_gain_error)[leg];
        }
    }
    if (event.v_zero_gain_error) {
        plant_sensor(plant)->v_zero_gain_error = *event.v_zero_gain_error;
    }
    if (event.hw_fault) {
        rig_set_hw_fault(rig_, *event.hw_fault);
    }
    if (event.leg_fault) {
        plant_set_leg_fault(plant, event.leg_fault->leg, event.leg_fault->kind);
    }
    if (event.short_circuit) {
        const ShortCircuit &tie = *event.short_circuit;
        plant_set_short(plant, tie.leg_a, tie.leg_b, tie.R_ohm);
    }
    if (event.supply) {
        plant_set_supply(plant, *event.supply);
    }
}

void Profile::move_ramps(double t_s)
{
    any_moving_ = false;
    for (size_t i = 0; i < channel_count; ++i) {
        Ramp &r = ramps_[i];
        if (!r.moving) {
            continue;
        }
        r.moving = t_s < r.t1_s;
        any_moving_ = any_moving_ || r.moving;
        r.now = r.moving ? r.from + (r.to - r.from) * (t_s - r.t0_s) / (r.t1_s - r.t0_s) : r.to;
        apply(static_cast<Channel>(i), r.now);
    }
}

void Profile::apply(Channel channel, double value)
{
    plant_t *plant = rig_plant(rig_);
    switch (channel) {
    case Channel::speed_rad_s:
        command_.speed_rad_s = value;
        command_changed_ = true;
        break;
    case Channel::torque_Nm:
        command_.torque_Nm = value;
        command_changed_ = true;
        break;
    case Channel::current_A:
        command_.current_A = value;
        command_changed_ = true;
        break;
    case Channel::duty:
        command_.duty = value;
        command_changed_ = true;
        break;
    case Channel::v_source_V:
        plant_set_source(plant, value);
        break;
    case Channel::temperature_degC:
        rig_set_temperature(rig_, value);
        break;
    case Channel::imposed_speed_rad_s:
        plant_set_speed(plant, value);
        break;
    case Channel::R_s_ohm:
        plant_machine(plant)->R_s_ohm = value;
        break;
    case Channel::psi_m_Wb:
        plant_machine(plant)->psi_m_Wb = value;
        break;
    case Channel::L_d0_H:
        plant_machine(plant)->L_d0_H = value;
        break;
    case Channel::L_q0_H:
        plant_machine(plant)->L_q0_H = value;
        break;
    case Channel::c_A_Wb5:
        plant_machine(plant)->c_A_Wb5 = value;
        break;
    case Channel::winding_degC:
    case Channel::magnet_degC:
        plant_set_temperature(plant, ramp(Channel::winding_degC).now, ramp(Channel::magnet_degC).now);
        break;
    case Channel::load_Nm:
    case Channel::load_fan_Nm:
    case Channel::count:
        break; // apply_load() does it every period
    }
}

void Profile::apply_load(double omega_mech_rad_s)
{
    const double n = omega_mech_rad_s / scenario_.setup.rated.speed_rated_rad_s;
    const double load_Nm = ramp(Channel::load_Nm).now + ramp(Channel::load_fan_Nm).now * n * std::fabs(n);
    if (load_Nm < load_Nm_ || load_Nm > load_Nm_) {
        load_Nm_ = load_Nm;
        plant_set_load(rig_plant(rig_), load_Nm);
    }
}

double Profile::load_Nm() const
{
    return load_Nm_;
}

double Profile::speed_ref_rad_s() const
{
    return ramp(Channel::speed_rad_s).now;
}

int Profile::direction() const
{
    if (!command_.enable) {
        return 0;
    }
    double sense = command_.speed_rad_s;
    if (command_.mode == RIG_TORQUE) {
        sense = command_.torque_Nm;
    } else if (command_.mode == RIG_DUTY) {
        sense = command_.duty;
    }
    return sense > 0.0 ? 1 : (sense < 0.0 ? -1 : 0);
}

const rig_command_t &Profile::command() const
{
    return command_;
}

bool Profile::command_changed() const
{
    return command_changed_;
}

} // namespace pmsim
