// Position error by what repeats with the rotor's angle.
#include <cmath>
#include <limits>

#include "tools/pmsim/metrics_special.h"

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();
const double to_deg = 57.29577951308232;

// Amplitude at N times the electrical angle, by least squares of mean, cosine and sine over the window.
template <int N> class AngleErrorHarmonic : public Metric
{
  public:
    AngleErrorHarmonic(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (!has_position(s)) {
            return;
        }
        const double base[3] = {1, std::cos(N * s.rig.truth.theta_e_rad),
                                std::sin(N * s.rig.truth.theta_e_rad)};
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                normal_[row][column] += base[row] * base[column];
            }
            right_[row] += base[row] * s.rig.angle_error_rad * to_deg;
        }
    }

    MetricValue value() const override
    {
        const double whole = determinant(-1);
        return {whole > 0 ? std::hypot(determinant(1), determinant(2)) / whole : nan, ""};
    }

  private:
    // Cramer's rule: of the normal matrix with the right side in place of a column; -1: as it is.
    double determinant(int replaced) const
    {
        double m[3][3];
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                m[row][column] = column == replaced ? right_[row] : normal_[row][column];
            }
        }
        return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
               m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    }

    double normal_[3][3] = {}, right_[3] = {};
};

// Half a turn does not count: what a saliency alone can tell.
class AxisError : public Metric
{
  public:
    AxisError(const Expectation &, const Setup &)
    {
    }

    void add(const Sample &s) override
    {
        if (has_position(s)) {
            const double error = std::fabs(std::remainder(s.rig.angle_error_rad * to_deg, 180));
            most_ = std::isnan(most_) ? error : std::fmax(most_, error);
        }
    }

    MetricValue value() const override
    {
        return {most_, ""};
    }

  private:
    double most_ = nan;
};

} // namespace

std::vector<SpecialMetric> angle_metrics()
{
    return {
        {{"angle_error_h2_deg",
          "deg",
          "amplitude of the position error at twice the electrical angle",
          false,
          false,
          {}},
         make_special<AngleErrorHarmonic<2>>},
        {{"angle_error_h6_deg",
          "deg",
          "amplitude of the position error at six times the electrical angle",
          false,
          false,
          {}},
         make_special<AngleErrorHarmonic<6>>},
        {{"axis_error_max_deg",
          "deg",
          "largest position error but for half turns, absolute",
          false,
          false,
          {}},
         make_special<AxisError>},
    };
}

} // namespace pmsim
