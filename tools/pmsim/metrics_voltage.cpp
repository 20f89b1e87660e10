#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

namespace pmsim
{
namespace
{

using Complex = std::complex<double>;

const double nan = std::numeric_limits<double>::quiet_NaN();
const double to_deg = 57.29577951308232;

Complex applied(const Sample &s)
{
    return {s.rig.truth.v_mean_alpha_V, s.rig.truth.v_mean_beta_V};
}

// Mean in the rotor's frame: at constant speed the fundamental, harmonics cancel over whole turns.
class VoltageFundamental : public Metric
{
  public:
    VoltageFundamental(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        sum_ += applied(s) * std::polar(1.0, -s.rig.truth.theta_e_rad);
        link_V_ += s.rig.truth.v_dc_V;
    }

    MetricValue value() const override
    {
        return {link_V_ > 0.0 ? std::abs(sum_) / (link_V_ / std::sqrt(3.0)) : nan, ""};
    }

  private:
    Complex sum_ = 0.0;
    double link_V_ = 0.0;
};

// Loudest band of 50 Hz of the d current by Welch's method: Hann windows of 20 ms, half over the next one. Between two samples the
// current is a straight line, but for the ripple of the PWM; it is taken at four points of a period.
class LoudestBand : public Metric
{
  public:
    LoudestBand(const Expectation &, const Setup &setup)
        : points_per_s_(parts * setup.plant.inverter.f_pwm_Hz)
    {
    }

    void add(const Sample &s) override
    {
        for (int part = 1; part <= parts && count_ > 0; part++) {
            x_.push_back(last_ + (s.rig.truth.i_d_A - last_) * part / parts);
        }
        last_ = s.rig.truth.i_d_A;
        count_++;
    }

    MetricValue value() const override
    {
        const std::size_t length = static_cast<std::size_t>(std::lround(points_per_s_ / band_Hz));
        if (x_.size() < 2 * length) {
            return {nan, ""};
        }
        double loudest = 0.0;
        for (int band = 2; band * band_Hz <= highest_Hz; band++) {
            loudest = std::max(loudest, mean_square(length, band));
        }
        return {std::sqrt(loudest), ""};
    }

  private:
    static constexpr int parts = 4;
    static constexpr double band_Hz = 50.0, highest_Hz = 10e3, turn = 6.283185307179586;

    // Of the band, A^2: a sine in it has half of its amplitude squared.
    double mean_square(std::size_t length, int band) const
    {
        double sum = 0.0, windows = 0.0;
        for (std::size_t from = 0; from + length <= x_.size(); from += length / 2) {
            Complex part = 0.0;
            for (std::size_t k = 0; k < length; k++) {
                const double at = static_cast<double>(k) / static_cast<double>(length);
                part += x_[from + k] * (0.5 - 0.5 * std::cos(turn * at)) * std::polar(1.0, -turn * band * at);
            }
            sum += 0.5 * std::norm(4.0 * part / static_cast<double>(length));
            windows += 1.0;
        }
        return sum / windows;
    }

    double points_per_s_, last_ = 0.0;
    int count_ = 0;
    std::vector<double> x_;
};

// What the drive commands with a sample acts over the next period and is seen as the mean at its end.
class VoltageAngleError : public Metric
{
  public:
    VoltageAngleError(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        const Complex command = acted_;
        acted_ = acts_;
        acts_ = {s.rig.v_alpha_V, s.rig.v_beta_V};
        if (count_++ >= 2 && command != 0.0 && has_position(s)) {
            const double error = std::fabs(std::arg(applied(s) / command)) * to_deg;
            worst_ = std::isnan(worst_) ? error : std::max(worst_, error);
        }
    }

    MetricValue value() const override
    {
        return {worst_, ""};
    }

  private:
    Complex acts_ = 0.0, acted_ = 0.0;
    int count_ = 0;
    double worst_ = nan;
};

} // namespace

std::vector<SpecialMetric> voltage_metrics()
{
    return {
        {{"voltage_fundamental_rel",
          "1",
          "amplitude of the voltage's fundamental / (v_dc / sqrt(3)); whole turns at constant speed",
          false,
          false,
          {}},
         make_special<VoltageFundamental>},
        {{"i_d_loudest_band_A",
          "A",
          "rms of the d current in the loudest band of 50 Hz from 100 Hz to 10 kHz",
          false,
          false,
          {}},
         make_special<LoudestBand>},
        {{"voltage_angle_error_max_deg",
          "deg",
          "largest angle between a period's mean voltage and the command",
          false,
          false,
          {}},
         make_special<VoltageAngleError>},
    };
}

} // namespace pmsim
