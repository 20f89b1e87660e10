#include "tools/pmsim_board/figures_report.h"

#include <cstdio>

namespace pmsim
{
namespace
{

const char *const mode_names[FIGURE_MODES] = {"off",   "calibrate", "pulses",    "identify",
                                              "align", "open_loop", "injection", "blend",
                                              "flux",  "weakening", "six_step"};
const char *const event_names[FIGURE_EVENTS] = {"limited", "fault", "swap"};
const char *const interrupt_names[FIGURE_INTERRUPTS] = {"control", "monitor", "slow", "can", "console"};

double mean(uint64_t sum, uint64_t count)
{
    return count > 0 ? double(sum) / double(count) : 0.0;
}

std::string row(const std::string &name, const interrupt_figure_t &f)
{
    const figure_t &i = f.instructions;
    if (i.count == 0) {
        return "";
    }
    char line[200];
    std::snprintf(line, sizeof line, "%-20s %9llu  %6llu %7.1f %6llu   %7.1f %7.1f %7.1f %6llu\n",
                  name.c_str(), static_cast<unsigned long long>(i.count),
                  static_cast<unsigned long long>(i.least), mean(i.sum, i.count),
                  static_cast<unsigned long long>(i.most), mean(f.cycles_low, i.count),
                  mean(f.cycles.sum, i.count), mean(f.cycles_high, i.count),
                  static_cast<unsigned long long>(f.cycles.most));
    return line;
}

} // namespace

std::vector<std::pair<std::string, double>> figure_values(const figures_t &figures)
{
    std::vector<std::pair<std::string, double>> values;
    const auto add = [&values](const std::string &name, const interrupt_figure_t &f) {
        if (f.instructions.count > 0) {
            values.emplace_back(name + ".mean", mean(f.instructions.sum, f.instructions.count));
            values.emplace_back(name + ".worst", double(f.instructions.most));
            values.emplace_back(name + ".cycles", mean(f.cycles.sum, f.cycles.count));
            values.emplace_back(name + ".cycles_worst", double(f.cycles.most));
        }
    };
    for (int n = 0; n < FIGURE_MODES; ++n) {
        add(std::string("control.") + mode_names[n], figures.mode[n]);
    }
    for (int n = 0; n < FIGURE_EVENTS; ++n) {
        add(std::string("control.") + event_names[n], figures.event[n]);
    }
    for (int n = 0; n < FIGURE_INTERRUPTS; ++n) {
        add(interrupt_names[n], figures.interrupt[n]);
    }
    const auto &control = figures.interrupt[FIGURE_CONTROL];
    if (figures.period_cycles > 0) {
        values.emplace_back("control.worst_percent",
                            100.0 * double(control.cycles.most) / double(figures.period_cycles));
    }
    if (figures.cycles > 0) {
        values.emplace_back("load_percent",
                            100.0 * (1.0 - double(figures.cycles_asleep) / double(figures.cycles)));
    }
    values.emplace_back("latency_cycles", double(figures.latency_most));
    values.emplace_back("stack_bytes", double(figures.stack_most));
    values.emplace_back("resets", double(figures.resets));
    values.emplace_back("refused", double(figures.refused));
    if (figures.bus_frames > 0) {
        values.emplace_back("bus_frames", double(figures.bus_frames));
        values.emplace_back("bus_idle", double(figures.bus_idle));
    }
    values.emplace_back("identical", double(figures.identical));
    return values;
}

std::string figure_table(const figures_t &figures)
{
    std::string text =
        "                         times   instructions           estimated cycles\n"
        "                                  least    mean   most       low typical    high   most\n";
    for (int n = 0; n < FIGURE_MODES; ++n) {
        text += row(std::string("control, ") + mode_names[n], figures.mode[n]);
    }
    for (int n = 0; n < FIGURE_EVENTS; ++n) {
        text += row(std::string("  of these, ") + event_names[n], figures.event[n]);
    }
    for (int n = 0; n < FIGURE_INTERRUPTS; ++n) {
        text += row(interrupt_names[n], figures.interrupt[n]);
    }
    char line[300];
    const auto &control = figures.interrupt[FIGURE_CONTROL];
    const double percent =
        figures.period_cycles > 0 ? 100.0 * double(control.cycles.most) / double(figures.period_cycles) : 0.0;
    const double load =
        figures.cycles > 0 ? 100.0 * (1.0 - double(figures.cycles_asleep) / double(figures.cycles)) : 0.0;
    std::snprintf(
        line, sizeof line,
        "worst control interrupt %.1f %% of the period, latency %llu cycles at most; processor load %.1f %% "
        "at %.0f MHz\nstack %u bytes; resets %u; drive's memory the same as on the host after %llu "
        "interrupts\n",
        percent, static_cast<unsigned long long>(figures.latency_most), load, 1e-6 * double(figures.clock_Hz),
        figures.stack_most, figures.resets, static_cast<unsigned long long>(figures.identical));
    text += line;
    if (figures.bus_frames > 0) {
        std::snprintf(line, sizeof line, "bus: %llu frames of others, %.0f a second; found idle %llu times\n",
                      static_cast<unsigned long long>(figures.bus_frames),
                      double(figures.bus_frames) / figures.simulated_s,
                      static_cast<unsigned long long>(figures.bus_idle));
        text += line;
    }
    return text;
}

std::string figure_json(const figures_t &figures)
{
    std::string text = "{";
    for (const auto &[name, value] : figure_values(figures)) {
        char field[120];
        std::snprintf(field, sizeof field, "%s\n  \"%s\": %.10g", text.size() > 1 ? "," : "", name.c_str(),
                      value);
        text += field;
    }
    return text + "\n}\n";
}

} // namespace pmsim
