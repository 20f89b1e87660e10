// An observer in a loop of 25 Hz on a machine at constant speed and current, with the noise of a converter.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

namespace bench
{

constexpr double kConverterNoise_A = 2.8e-3; // half a step of 12 bits for +-10 A, and its quantisation

struct Errors {
    double mean = 0, max = 0, ripple = 0; // degrees
};

template <class Functions> class ClosedLoop
{
  public:
    using Config = typename Functions::Config;

    ClosedLoop(const Config &config, const Base &base, const Rotation &truth,
               double noise_A = kConverterNoise_A)
        : rotation(truth), config_(config), base_(base), noise_A_(noise_A)
    {
        loop.theta_rad = rotation.theta_rad;
        loop.omega_rad_s = rotation.omega_rad_s;
        const obs_in_t in = rotation.seen(loop.theta_rad, loop.omega_rad_s);
        Functions::reset(&state, &config_, &in);
    }

    void step()
    {
        rotation.advance();
        loop.predict(base_.period_s);
        const Complex noise = noise_A_ * Complex{gauss(), gauss()};
        const obs_in_t in = rotation.seen(loop.theta_rad, loop.omega_rad_s, 0, noise);
        Functions::step(&state, &config_, &in, &out);
        loop.correct(real(out.eps), base_.period_s);
        if (++periods_ % 10 == 0) {
            Functions::slow(&state, &config_, &in, &out, PM_ONE);
        }
    }

    double error_deg() const
    {
        return wrapped(rotation.theta_rad - loop.theta_rad) / kDegree;
    }

    Errors settled(double settle_s = 0.5, double seconds = 0.5)
    {
        const auto n = static_cast<int>(seconds / base_.period_s);
        for (int k = 0; k < static_cast<int>(settle_s / base_.period_s); ++k) {
            step();
        }
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

    typename Functions::State state = {};
    obs_out_t out = {};
    Loop loop;
    Rotation rotation;

  private:
    double gauss() // of twelve uniform ones
    {
        double sum = -6;
        for (int k = 0; k < 12; ++k) {
            sum += random_.within(0, 1);
        }
        return sum;
    }

    Config config_;
    Base base_;
    double noise_A_;
    samples::Random random_;
    int periods_ = 0;
};

struct SlidingModeFunctions {
    using State = sliding_mode_t;
    using Config = sliding_mode_config_t;
    static constexpr auto reset = sliding_mode_reset;
    static constexpr auto step = sliding_mode_step;
    static constexpr auto slow = sliding_mode_slow;
};

struct EkfFullFunctions {
    using State = ekf_full_t;
    using Config = ekf_full_config_t;
    static constexpr auto reset = ekf_full_reset;
    static constexpr auto step = ekf_full_step;
    static constexpr auto slow = ekf_full_slow;
};

struct EkfReducedFunctions {
    using State = ekf_reduced_t;
    using Config = ekf_reduced_config_t;
    static constexpr auto reset = ekf_reduced_reset;
    static constexpr auto step = ekf_reduced_step;
    static constexpr auto slow = ekf_reduced_slow;
};

} // namespace bench
