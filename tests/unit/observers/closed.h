// Any observer of the list with a phase-locked loop in double around a rotor at constant speed.
#pragma once

#include "tests/contract/bench.h"

namespace bench
{

class Closed
{
  public:
    Closed(const Base &base, const observer_config_t &of, const Rotation &truth)
        : config(of), rotation(truth), base_(base)
    {
        loop.theta_rad = rotation.theta_rad;
        loop.omega_rad_s = rotation.omega_rad_s;
        in = rotation.seen(loop.theta_rad, loop.omega_rad_s);
        observer_reset(&state, &config, &in);
    }

    void step(pm_q_t weight = PM_ONE)
    {
        rotation.advance();
        loop.predict(base_.period_s);
        in = rotation.seen(loop.theta_rad, loop.omega_rad_s);
        observer_step(&state, &config, &in, &out);
        loop.correct(real(out.eps), base_.period_s);
        if (++periods_ % 10 == 0) {
            observer_slow(&state, &config, &in, &out, weight);
        }
    }

    double error_deg() const // theta - theta_hat
    {
        return wrapped(rotation.theta_rad - loop.theta_rad) / kDegree;
    }

    double settled_deg(double seconds = 1.0)
    {
        for (int k = 0; k < static_cast<int>(seconds / base_.period_s); ++k) {
            step();
        }
        return error_deg();
    }

    observer_config_t config;
    observer_t state = {};
    Loop loop;
    Rotation rotation;
    obs_in_t in = {};
    obs_out_t out = {};

  private:
    Base base_;
    int periods_ = 0;
};

} // namespace bench
