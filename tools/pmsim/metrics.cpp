#include "tools/pmsim/metrics.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "tools/pmsim/metrics_special.h"

namespace pmsim
{
namespace
{

const double nan = std::numeric_limits<double>::quiet_NaN();
const double to_deg = 57.29577951308232;

enum class Fold { mean, rms, deviation, max, min, max_abs, span, last };

using Signal = double (*)(const Sample &, const Setup &);

// A number per period, folded into one. Counted always, or only while the drive has a position.
struct FoldedMetric {
    const char *name, *unit, *help;
    Fold fold;
    bool needs_position;
    Signal signal;
};

double angle_error(const Sample &s, const Setup &)
{
    return s.rig.angle_error_rad * to_deg;
}

double speed(const Sample &s, const Setup &)
{
    return s.rig.truth.omega_mech_rad_s;
}

double speed_rel(const Sample &s, const Setup &setup)
{
    return s.rig.truth.omega_mech_rad_s / setup.rated.speed_rated_rad_s;
}

double speed_error_rel(const Sample &s, const Setup &setup)
{
    return (s.rig.omega_ref_mech_rad_s - s.rig.truth.omega_mech_rad_s) / setup.rated.speed_rated_rad_s;
}

double speed_estimate_error_rel(const Sample &s, const Setup &setup)
{
    return (s.rig.omega_hat_mech_rad_s - s.rig.truth.omega_mech_rad_s) / setup.rated.speed_rated_rad_s;
}

double torque(const Sample &s, const Setup &)
{
    return s.rig.truth.torque_Nm;
}

double torque_rel(const Sample &s, const Setup &setup)
{
    return s.rig.truth.torque_Nm / setup.rated.torque_rated_Nm;
}

double current_peak(const Sample &s, const Setup &)
{
    const double *i = s.rig.truth.i_A;
    return std::max({std::fabs(i[0]), std::fabs(i[1]), std::fabs(i[2])});
}

double current_amplitude(const Sample &s, const Setup &)
{
    return std::hypot(s.rig.truth.i_d_A, s.rig.truth.i_q_A);
}

double i_d(const Sample &s, const Setup &)
{
    return s.rig.truth.i_d_A;
}

double i_q(const Sample &s, const Setup &)
{
    return s.rig.truth.i_q_A;
}

double zero_current(const Sample &s, const Setup &)
{
    return s.rig.truth.i_zero_A;
}

// Amplitude of half the difference of two sets, the second in axes of its own 30 degrees on.
double difference_current(const Sample &s, const Setup &)
{
    const double *i = s.rig.truth.i_A;
    const auto vector = [](const double *x) {
        return std::complex<double>((2 * x[0] - x[1] - x[2]) / 3, (x[1] - x[2]) / std::sqrt(3.0));
    };
    return 0.5 / std::sqrt(2.0) * std::abs(vector(i) - vector(i + 3) * std::polar(1.0, std::acos(-1.0) / 6));
}

double v_dc(const Sample &s, const Setup &)
{
    return s.rig.truth.v_dc_V;
}

double weight(const Sample &s, const Setup &)
{
    return s.rig.weight;
}

double quality(const Sample &s, const Setup &)
{
    return s.rig.quality;
}

const FoldedMetric folded_metrics[] = {
    {"angle_error_mean_deg", "deg", "mean position error, signed", Fold::mean, true, angle_error},
    {"angle_error_rms_deg", "deg", "rms position error", Fold::rms, true, angle_error},
    {"angle_error_std_deg", "deg", "rms position error about its mean", Fold::deviation, true, angle_error},
    {"angle_error_max_deg", "deg", "largest position error, absolute", Fold::max_abs, true, angle_error},
    {"speed_error_max_rel", "1", "largest |reference after the ramp - true speed| / rated", Fold::max_abs,
     true, speed_error_rel},
    {"speed_estimate_error_max_rel", "1", "largest |estimated - true speed| / rated", Fold::max_abs, true,
     speed_estimate_error_rel},
    {"speed_estimate_error_rms_rel", "1", "rms of estimated - true speed / rated", Fold::rms, true,
     speed_estimate_error_rel},
    {"speed_mean_rad_s", "rad/s", "mean true speed, mechanical", Fold::mean, false, speed},
    {"speed_mean_rel", "1", "mean true speed / rated", Fold::mean, false, speed_rel},
    {"speed_min_rel", "1", "lowest true speed / rated", Fold::min, false, speed_rel},
    {"speed_max_rel", "1", "highest true speed / rated", Fold::max, false, speed_rel},
    {"speed_final_rad_s", "rad/s", "true speed at the end of the window", Fold::last, false, speed},
    {"speed_final_rel", "1", "true speed at the end of the window / rated", Fold::last, false, speed_rel},
    {"torque_mean_Nm", "Nm", "mean air-gap torque", Fold::mean, false, torque},
    {"torque_mean_rel", "1", "mean air-gap torque / rated", Fold::mean, false, torque_rel},
    {"torque_span_Nm", "Nm", "largest - smallest air-gap torque", Fold::span, false, torque},
    {"current_peak_A", "A", "largest phase current, absolute, at the sample instants", Fold::max, false,
     current_peak},
    {"current_amplitude_mean_A", "A", "mean amplitude of the current vector", Fold::mean, false,
     current_amplitude},
    {"current_final_A", "A", "amplitude of the current vector at the end", Fold::last, false,
     current_amplitude},
    {"i_d_mean_A", "A", "mean d current, true frame", Fold::mean, false, i_d},
    {"i_q_mean_A", "A", "mean q current, true frame", Fold::mean, false, i_q},
    {"i_q_min_A", "A", "lowest q current, true frame, at the sample instants", Fold::min, false, i_q},
    {"i_q_max_A", "A", "highest q current, true frame, at the sample instants", Fold::max, false, i_q},
    {"i_q_std_A", "A", "rms of the q current about its mean, true frame, at the sample instants",
     Fold::deviation, false, i_q},
    {"zero_current_rms_A", "A", "rms of the current that all phases of an open winding have in common",
     Fold::rms, false, zero_current},
    {"difference_current_rms_A", "A", "rms over a phase of half the difference of two sets' currents",
     Fold::rms, false, difference_current},
    {"v_dc_max_V", "V", "highest DC-link voltage", Fold::max, false, v_dc},
    {"v_dc_min_V", "V", "lowest DC-link voltage", Fold::min, false, v_dc},
    {"weight_mean", "1", "mean share of the flux observer; 0: injection alone", Fold::mean, true, weight},
    {"quality_min", "1", "worst quality figure of the position", Fold::min, true, quality},
};

class FoldMetric : public Metric
{
  public:
    FoldMetric(const FoldedMetric &metric, const Setup &setup) : metric_(metric), setup_(setup)
    {
    }

    void add(const Sample &sample) override
    {
        if (metric_.needs_position && !has_position(sample)) {
            return;
        }
        const double x = metric_.signal(sample, setup_);
        sum_ += x;
        squares_ += x * x;
        min_ = std::min(min_, x);
        max_ = std::max(max_, x);
        last_ = x;
        count_ += 1.0;
    }

    MetricValue value() const override
    {
        return {count_ > 0.0 ? fold() : nan, ""};
    }

  private:
    double fold() const
    {
        const double mean = sum_ / count_;
        switch (metric_.fold) {
        case Fold::mean:
            return mean;
        case Fold::rms:
            return std::sqrt(squares_ / count_);
        case Fold::deviation:
            return std::sqrt(std::max(0.0, squares_ / count_ - mean * mean));
        case Fold::max:
            return max_;
        case Fold::min:
            return min_;
        case Fold::max_abs:
            return std::max(std::fabs(min_), std::fabs(max_));
        case Fold::span:
            return max_ - min_;
        case Fold::last:
            return last_;
        }
        return nan;
    }

    const FoldedMetric &metric_;
    const Setup &setup_;
    double sum_ = 0.0, squares_ = 0.0, last_ = 0.0, count_ = 0.0;
    double min_ = std::numeric_limits<double>::infinity();
    double max_ = -std::numeric_limits<double>::infinity();
};

} // namespace

static const std::vector<SpecialMetric> &special_metrics()
{
    static const std::vector<SpecialMetric> table = [] {
        std::vector<SpecialMetric> list = motion_metrics();
        const std::vector<SpecialMetric> angle = angle_metrics();
        list.insert(list.end(), angle.begin(), angle.end());
        const std::vector<SpecialMetric> drive = drive_metrics();
        list.insert(list.end(), drive.begin(), drive.end());
        const std::vector<SpecialMetric> identify = identify_metrics();
        list.insert(list.end(), identify.begin(), identify.end());
        const std::vector<SpecialMetric> power = power_metrics();
        list.insert(list.end(), power.begin(), power.end());
        const std::vector<SpecialMetric> start = start_metrics();
        list.insert(list.end(), start.begin(), start.end());
        const std::vector<SpecialMetric> voltage = voltage_metrics();
        list.insert(list.end(), voltage.begin(), voltage.end());
        return list;
    }();
    return table;
}

bool has_position(const Sample &sample)
{
    return sample.rig.state == RIG_RUNNING || sample.rig.state == RIG_STOPPING;
}

const std::vector<MetricInfo> &metric_infos()
{
    static const std::vector<MetricInfo> infos = [] {
        std::vector<MetricInfo> list;
        for (const FoldedMetric &metric : folded_metrics) {
            list.push_back({metric.name, metric.unit, metric.help, false, false, {}});
        }
        for (const SpecialMetric &metric : special_metrics()) {
            list.push_back(metric.info);
        }
        return list;
    }();
    return infos;
}

const MetricInfo *find_metric(const std::string &name)
{
    for (const MetricInfo &info : metric_infos()) {
        if (info.name == name) {
            return &info;
        }
    }
    return nullptr;
}

std::vector<std::string> metric_names()
{
    std::vector<std::string> names;
    for (const MetricInfo &info : metric_infos()) {
        names.push_back(info.name);
    }
    return names;
}

std::unique_ptr<Metric> make_metric(const Expectation &expectation, const Setup &setup)
{
    for (const FoldedMetric &metric : folded_metrics) {
        if (expectation.metric == metric.name) {
            return std::make_unique<FoldMetric>(metric, setup);
        }
    }
    for (const SpecialMetric &metric : special_metrics()) {
        if (expectation.metric == metric.info.name) {
            return metric.make(expectation, setup);
        }
    }
    return nullptr;
}

} // namespace pmsim
