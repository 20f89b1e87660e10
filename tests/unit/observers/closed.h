// Any observer of the list with a phase-locked loop in double around a rotor at constant speed, with or
// without the noise of a converter.
#pragma once

#include <algorithm>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

namespace bench
{

constexpr double kConverterNoise_A = 2.8e-3; // half a step of 12 bits for +-10 A, and its quantisation

struct Errors {
    double mean = 0, max = 0, ripple = 0; // degrees
};

class Closed
{
  public:
    Closed(const Base &base, const observer_config_t &of, const Rotation &truth, double noise_A = 0)
        : config(of), rotation(truth), base_(base), noise_A_(noise_A)
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
        const Complex noise = noise_A_ == 0 ? 0 : noise_A_ * Complex{gauss(), gauss()};
        in = rotation.seen(loop.theta_rad, loop.omega_rad_s, 0, noise);
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

    Errors settled(double settle_s = 0.5, double seconds = 0.5)
    {
        const auto n = static_cast<int>(seconds / base_.period_s);
        settled_deg(settle_s);
        double sum = 0, squares = 0;
        Errors e;
        for (int k = 0; k < n; ++k) {
            step();
            sum += error_deg();
            squares += error_deg() * error_deg();
            e.max = std::max(e.max, std::abs(error_deg()));
        }
        e.mean = sum / n;
        e.ripple = std::sqrt(std::max(0.0, squares / n - e.mean * e.mean));
        return e;
    }

    observer_config_t config;
    observer_t state = {};
    Loop loop;
    Rotation rotation;
    obs_in_t in = {};
    obs_out_t out = {};

  private:
    double gauss() // of twelve uniform ones
    {
        double sum = -6;
        for (int k = 0; k < 12; ++k) {
            sum += random_.within(0, 1);
        }
        return sum;
    }

    Base base_;
    double noise_A_;
    samples::Random random_;
    int periods_ = 0;
};

} // namespace bench
