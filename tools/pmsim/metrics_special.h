// Metrics that are more than one folded signal: times, travel, faults, energy.
#ifndef PMSIM_METRICS_SPECIAL_H
#define PMSIM_METRICS_SPECIAL_H

#include "tools/pmsim/metrics.h"

namespace pmsim
{

struct SpecialMetric {
    MetricInfo info;
    std::unique_ptr<Metric> (*make)(const Expectation &, const Setup &);
};

template <class T> std::unique_ptr<Metric> make_special(const Expectation &expectation, const Setup &setup)
{
    return std::make_unique<T>(expectation, setup);
}

bool has_position(const Sample &sample);
std::vector<SpecialMetric> angle_metrics();    // metrics_angle.cpp
std::vector<SpecialMetric> motion_metrics();   // metrics_motion.cpp
std::vector<SpecialMetric> drive_metrics();    // metrics_drive.cpp
std::vector<SpecialMetric> identify_metrics(); // metrics_identify.cpp
std::vector<SpecialMetric> power_metrics();    // metrics_power.cpp
std::vector<SpecialMetric> start_metrics();    // metrics_start.cpp
std::vector<SpecialMetric> voltage_metrics();  // metrics_voltage.cpp

} // namespace pmsim

#endif
