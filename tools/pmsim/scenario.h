// A scenario as data: what is on the bench, what happens when, what is expected. Format: docs/pmsim.md.
#ifndef PMSIM_SCENARIO_H
#define PMSIM_SCENARIO_H

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tools/pmsim/setup.h"

namespace pmsim
{

// Values that follow the profile, in SI; an event steps or ramps them.
enum class Channel {
    speed_rad_s, // references
    torque_Nm,
    current_A,
    duty,        // of v_dc
    load_Nm,     // constant torque, opposes positive rotation
    load_fan_Nm, // at rated speed; grows with the square of the speed and always opposes it
    v_source_V,
    temperature_degC,
    imposed_speed_rad_s,
    R_s_ohm, // of the machine itself: heating, demagnetisation, core
    psi_m_Wb,
    L_d0_H,
    L_q0_H,
    c_A_Wb5,
    winding_degC, // of the machine itself, by its temperature coefficients
    magnet_degC,
    count
};

constexpr size_t channel_count = static_cast<size_t>(Channel::count);

struct LegFault {
    int leg;
    plant_leg_fault_t kind;
};

struct ShortCircuit { // of terminals; leg_b < 0: to the negative rail; R_ohm < 0: ended
    int leg_a, leg_b;
    double R_ohm;
};

struct Event {
    double t_s = 0.0; // of the scenario, or after `state` was first entered
    std::optional<int> state;
    double ramp_s = 0.0; // for all channels of the event
    std::array<std::optional<double>, channel_count> targets;
    std::optional<bool> enable, locked, hw_fault;
    std::optional<int> mode;
    std::optional<std::array<double, PLANT_LEGS>> sensor_offset_A, sensor_gain_error;
    std::optional<double> v_zero_gain_error;
    std::optional<double> rotor_slip_rad, estimate_turn_rad; // electrical
    std::optional<LegFault> leg_fault;
    std::optional<ShortCircuit> short_circuit;
    std::optional<bool> supply; // false: lost
    bool free = false;          // ends an imposed speed
    bool clear_fault = false;
};

struct Expectation {
    std::string metric;
    std::string label; // metric with its arguments, for reports
    double t0_s = 0.0, t1_s = std::numeric_limits<double>::infinity();
    double fraction = 0.0; // argument of some metrics: of rated speed
    std::optional<double> min, max, max_abs;
    std::optional<std::string> equals;
    std::string unit;
    std::string book; // section it stands for
};

struct Scenario {
    std::string title;
    Setup setup;
    uint64_t seed = 1;
    double theta_e_rad = 0.0; // rotor at the start
    double duration_s = 0.0;
    double after_fault_s =
        std::numeric_limits<double>::infinity(); // the run ends so long after the first fault
    std::vector<Event> profile;
    std::vector<Expectation> expect;
};

} // namespace pmsim

#endif
