#include "tools/pmsim/metrics_special.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();
const double to_deg = 57.29577951308232, pi = 3.141592653589793;

// From the start of the window to a fraction of rated speed in the commanded direction.
class TimeToSpeed : public Metric
{
  public:
    TimeToSpeed(const Expectation &e, const Setup &setup)
        : t0_s_(e.t0_s), speed_(e.fraction * setup.rated.speed_rated_rad_s)
    {
    }

    void add(const Sample &s) override
    {
        const bool reached = s.direction * s.rig.truth.omega_mech_rad_s >= speed_;
        if (std::isnan(time_s_) && s.direction != 0 && reached) {
            time_s_ = s.rig.truth.t_s - t0_s_;
        }
    }

    MetricValue value() const override
    {
        return {time_s_, ""};
    }

  private:
    double t0_s_, speed_, time_s_ = nan;
};

// Farthest fall behind the most advanced rotor position, while one direction is commanded.
class BackwardMovement : public Metric
{
  public:
    BackwardMovement(const Expectation &, const Setup &setup) : pole_pairs_(setup.plant.machine.pole_pairs)
    {
    }

    void add(const Sample &s) override
    {
        if (s.direction == 0) {
            return;
        }
        const double position = s.direction * s.rig.truth.theta_e_rad * to_deg / pole_pairs_;
        if (s.direction != direction_) {
            direction_ = s.direction;
            farthest_ = position;
        }
        farthest_ = std::max(farthest_, position);
        const double back = farthest_ - position;
        back_ = std::isnan(back_) ? back : std::max(back_, back);
    }

    MetricValue value() const override
    {
        return {back_, ""};
    }

  private:
    int direction_ = 0;
    double pole_pairs_, farthest_ = 0.0, back_ = nan;
};

// Farthest the rotor gets from where it was at the start of the window.
class Travel : public Metric
{
  public:
    Travel(const Expectation &, const Setup &setup) : pole_pairs_(setup.plant.machine.pole_pairs)
    {
    }

    void add(const Sample &s) override
    {
        const double position = s.rig.truth.theta_e_rad * to_deg / pole_pairs_;
        start_ = std::isnan(start_) ? position : start_;
        farthest_ = std::max(farthest_, std::fabs(position - start_));
    }

    MetricValue value() const override
    {
        return {std::isnan(start_) ? nan : farthest_, ""};
    }

  private:
    double pole_pairs_, start_ = nan, farthest_ = 0.0;
};

// Amplitude of the position error at `order` times the electrical angle: by the angle, so that the speed may vary, over
// the whole electrical turns that the window has.
template <int order> class AngleErrorOrder : public Metric
{
  public:
    AngleErrorOrder(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        const double theta = s.rig.truth.theta_e_rad;
        if (has_position(s) && !std::isnan(before_)) {
            const double way = theta - before_;
            turned_ += way;
            sum_ += s.rig.angle_error_rad * to_deg * way * std::polar(1.0, -order * (theta - 0.5 * way));
            if (std::fabs(turned_) >= (turns_ + 1.0) * 2.0 * pi) {
                turns_ += 1.0;
                whole_ = sum_;
            }
        }
        before_ = theta;
    }

    MetricValue value() const override
    {
        return {turns_ > 0.0 ? std::abs(whole_) / (turns_ * pi) : nan, ""};
    }

  private:
    std::complex<double> sum_ = 0.0, whole_ = 0.0;
    double before_ = nan, turned_ = 0.0, turns_ = 0.0;
};

// Position error at an instant that may come more than once.
class AngleErrorAt : public Metric
{
  public:
    MetricValue value() const override
    {
        return {worst_, ""};
    }

  protected:
    void take(const Sample &s)
    {
        const double error = s.rig.angle_error_rad * to_deg;
        worst_ = std::isnan(worst_) || std::fabs(error) > std::fabs(worst_) ? error : worst_;
    }

  private:
    double worst_ = nan;
};

// When the drive begins to run: after what the search has found injection has settled.
class FoundAngleError : public AngleErrorAt
{
  public:
    FoundAngleError(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (s.rig.state == RIG_RUNNING && last_state_ != RIG_RUNNING) {
            take(s);
        }
        last_state_ = s.rig.state;
    }

  private:
    int last_state_ = RIG_RUNNING; // a window that begins while running has found nothing
};

// When injection begins to settle: what the pulses have found.
class PulsesAngleError : public AngleErrorAt
{
  public:
    PulsesAngleError(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        settled_ = s.rig.settles ? settled_ + 1 : 0;
        if (settled_ == 2) { // the first is from before its first period
            take(s);
        }
    }

  private:
    int settled_ = 0;
};

} // namespace

std::vector<SpecialMetric> motion_metrics()
{
    return {
        {{"time_to_speed_s",
          "s",
          "window start to `fraction` of rated speed, commanded direction",
          false,
          true,
          {}},
         make_special<TimeToSpeed>},
        {{"backward_movement_deg_mech",
          "deg",
          "largest travel against the commanded direction, mechanical",
          false,
          false,
          {}},
         make_special<BackwardMovement>},
        {{"travel_max_deg_mech",
          "deg",
          "farthest from the position at the window start, mechanical",
          false,
          false,
          {}},
         make_special<Travel>},
        {{"found_angle_error_deg",
          "deg",
          "position error when the drive begins to run, worst of the window",
          false,
          false,
          {}},
         make_special<FoundAngleError>},
        {{"pulses_angle_error_deg",
          "deg",
          "position error that injection begins with, as the pulses have found it, worst of the window",
          false,
          false,
          {}},
         make_special<PulsesAngleError>},
        {{"angle_error_2nd_deg",
          "deg",
          "amplitude of the position error at twice the electrical angle, over whole turns",
          false,
          false,
          {}},
         make_special<AngleErrorOrder<2>>},
        {{"angle_error_6th_deg",
          "deg",
          "amplitude of the position error at six times the electrical angle, over whole turns",
          false,
          false,
          {}},
         make_special<AngleErrorOrder<6>>},
    };
}

} // namespace pmsim
