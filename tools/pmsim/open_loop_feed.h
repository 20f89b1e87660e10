// Any machine on its inverter without a drive: sinusoidal duties at rated current and half the rated speed.
//
// The speed is imposed, so the voltage of the steady state feeds it without control: v = R i + j omega
// psi(i), with the current of rated amplitude that gives most torque, plus the fundamental of what dead time
// and drops take. It starts from the EMF and reaches rated current within 0.1 s, which keeps transients
// small. The speed is less where the link does not give that voltage. Legs: three of a star; of two sets, the
// second 30 degrees later; of an open winding, half of the voltage at either end. Harmonics are not
// compensated. Users: `pmsim bench`. Tests: tests/unit/pmsim/preset_energy_test.cpp.
#ifndef PMSIM_OPEN_LOOP_FEED_H
#define PMSIM_OPEN_LOOP_FEED_H

#include <array>
#include <complex>
#include <memory>

#include "tools/pmsim/setup.h"

namespace pmsim
{

class OpenLoopFeed
{
  public:
    explicit OpenLoopFeed(const Setup &setup); // with rated values; throws InputError for what cannot be

    void step(); // one PWM period

    const plant_t *plant() const
    {
        return plant_.get();
    }

  private:
    struct Destroy {
        void operator()(plant_t *plant) const
        {
            plant_destroy(plant);
        }
    };

    Setup setup_; // owns the flux map
    std::unique_ptr<plant_t, Destroy> plant_;
    std::complex<double> i_A_, v_start_V_, v_rated_V_;
    std::array<std::complex<double>, PLANT_LEGS> leg_; // what a leg has of the voltage phasor
    double omega_e_rad_s_, period_s_;
    double periods_ = 0.0;
};

} // namespace pmsim

#endif
