// Metrics that are more than one folded signal: times, faults, travel, energy.
#ifndef PMSIM_METRICS_SPECIAL_H
#define PMSIM_METRICS_SPECIAL_H

#include "tools/pmsim/metrics.h"

namespace pmsim
{

bool has_position(const Sample &sample);
std::vector<MetricInfo> special_metric_infos();
std::unique_ptr<Metric> make_special_metric(const Expectation &expectation, const Setup &setup);

} // namespace pmsim

#endif
