// Initial-value problems to 1e-10: Boost.Odeint's Dormand-Prince 5(4) with error control.
#ifndef TESTS_REFERENCE_ODE_H
#define TESTS_REFERENCE_ODE_H

#include <functional>
#include <vector>

namespace reference
{

using State = std::vector<double>;
using Rates = std::function<void(const State &x, State &dxdt)>;

class Ode
{
  public:
    // Local error of each element: at most absolute + relative |x|. A trial step is at most 1 ms, so that it
    // does not leave the range where a flux map has an inverse.
    explicit Ode(Rates rates, double relative = 1e-10, double absolute = 1e-12);

    // The rates must be smooth over the duration: a step of the input begins a new one.
    void advance(State &x, double duration_s);

  private:
    Rates rates_;
    double relative_, absolute_;
    double step_s_ = 0.0; // what the error control would allow next
};

} // namespace reference

#endif
