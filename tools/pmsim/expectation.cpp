// `expect:` of a scenario: reading and judging.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/pmsim/metrics.h"
#include "tools/pmsim/scenario_file.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const double most_fraction = 3.0; // of rated speed; field weakening reaches less

void read_bounds(Expectation &expectation, const Map &map, const MetricInfo &info)
{
    const auto bound = [&map](const char *key) -> std::optional<double> {
        const auto value = map.find(key);
        return value ? std::optional<double>(value->number(-1e12, 1e12)) : std::nullopt;
    };
    expectation.min = bound("min");
    expectation.max = bound("max");
    expectation.max_abs = bound("max_abs");
    if (const auto equals = map.find("equals")) {
        expectation.equals = equals->word(info.words);
    }
    const bool has_number = expectation.min || expectation.max || expectation.max_abs;
    if (info.is_word && (has_number || !expectation.equals)) {
        map.value().fail(info.name + " is a word: it needs `equals`, and nothing else");
    }
    if (!info.is_word && (!has_number || expectation.equals)) {
        map.value().fail(info.name + " is a number: it needs `max`, `min` or `max_abs`");
    }
    if (expectation.max_abs && (expectation.min || expectation.max)) {
        map.value().fail("`max_abs` stands for both ends: give it, or `min` and `max`");
    }
    if (expectation.min && expectation.max && *expectation.min > *expectation.max) {
        map.value().fail("min is above max: nothing can pass");
    }
}

void read_window(Expectation &expectation, const Map &map)
{
    const auto window = map.find("window_s");
    if (!window) {
        return;
    }
    const std::vector<Value> ends = window->list();
    if (ends.size() != 2) {
        window->fail("expected [from, to] in seconds");
    }
    expectation.t0_s = ends[0].number(0, 1e6);
    expectation.t1_s = ends[1].number(0, 1e6);
    if (expectation.t0_s >= expectation.t1_s) {
        window->fail("the window ends before it begins");
    }
}

std::string label_of(const Expectation &expectation, const Map &map, const MetricInfo &info)
{
    std::string label = expectation.metric;
    if (info.has_fraction) {
        label += "(" + format(expectation.fraction, 4) + ")";
    }
    if (map.has("window_s")) {
        label += "[" + format(expectation.t0_s, 5) + "," + format(expectation.t1_s, 5) + "]";
    }
    return label;
}

} // namespace

Expectation read_expectation(const Value &value)
{
    const Map map(value,
                  {"metric", "name", "window_s", "fraction", "min", "max", "max_abs", "equals", "book"});
    Expectation expectation;
    const Value metric = map.at("metric");
    expectation.metric = metric.text();
    const MetricInfo *info = find_metric(expectation.metric);
    if (info == nullptr) {
        metric.fail(unknown("metric", expectation.metric, metric_names()));
    }
    expectation.unit = info->unit;
    if (info->has_fraction) {
        expectation.fraction = map.at("fraction").number(0, most_fraction);
    } else if (map.has("fraction")) {
        throw InputError(map.key_place("fraction"), info->name + " takes no `fraction`");
    }
    read_window(expectation, map);
    read_bounds(expectation, map, *info);
    expectation.book = map.at("book").text();
    const auto name = map.find("name");
    expectation.label = name ? name->text() : label_of(expectation, map, *info);
    return expectation;
}

Outcome judge(const Expectation &expectation, const MetricValue &value)
{
    const double infinity = std::numeric_limits<double>::infinity();
    Outcome outcome;
    outcome.value = value;
    if (expectation.equals) {
        outcome.pass = value.text == *expectation.equals;
        outcome.margin = outcome.pass ? infinity : -infinity;
        return outcome;
    }
    if (std::isnan(value.number)) {
        outcome.margin = -infinity;
        return outcome;
    }
    double margin = infinity;
    const auto check = [&margin](double distance, double bound) {
        margin = std::min(margin, bound != 0.0 ? distance / std::fabs(bound) : distance);
    };
    if (expectation.max) {
        check(*expectation.max - value.number, *expectation.max);
    }
    if (expectation.min) {
        check(value.number - *expectation.min, *expectation.min);
    }
    if (expectation.max_abs) {
        check(*expectation.max_abs - std::fabs(value.number), *expectation.max_abs);
    }
    outcome.margin = margin;
    outcome.pass = margin >= 0.0;
    return outcome;
}

std::string bound_text(const Expectation &expectation)
{
    if (expectation.equals) {
        return "= " + *expectation.equals;
    }
    if (expectation.max_abs) {
        return "<= +-" + format(*expectation.max_abs);
    }
    if (expectation.min && expectation.max) {
        return format(*expectation.min) + " ... " + format(*expectation.max);
    }
    return expectation.max ? "<= " + format(*expectation.max) : ">= " + format(*expectation.min);
}

} // namespace pmsim
