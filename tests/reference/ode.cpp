#include "tests/reference/ode.h"

#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation/generation_controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation/generation_runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/generation/make_controlled.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace reference
{

namespace odeint = boost::numeric::odeint;

constexpr double longest_s = 1e-3;

Ode::Ode(Rates rates, double relative, double absolute)
    : rates_(std::move(rates)), relative_(relative), absolute_(absolute)
{
}

void Ode::advance(State &x, double duration_s)
{
    auto system = [this](const State &now, State &dxdt, double) { rates_(now, dxdt); };
    auto stepper = odeint::make_controlled(absolute_, relative_, odeint::runge_kutta_dopri5<State>());
    double t = 0.0;
    double next_s = step_s_ > 0.0 ? step_s_ : longest_s;
    while (duration_s - t > 1e-12 * duration_s) {
        double left_s = duration_s - t;
        double step_s = std::min({next_s, left_s, longest_s});
        bool last = step_s == left_s;
        if (stepper.try_step(system, x, t, step_s) == odeint::success) {
            // A step cut short by the end of the duration says nothing against the longer one.
            next_s = last ? std::max(next_s, step_s) : step_s;
        } else {
            next_s = step_s;
        }
        if (!(step_s > 1e-12 * duration_s)) {
            throw std::runtime_error("reference::Ode: no step is short enough");
        }
    }
    step_s_ = next_s;
}

} // namespace reference
