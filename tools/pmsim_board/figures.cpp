#include "tools/pmsim_board/figures.h"

#include <algorithm>
#include <mutex>

#include "tools/pmsim_board/figures_report.h"

namespace
{

std::mutex mutex;
figures_t total;

void merge(figure_t &to, const figure_t &from)
{
    if (from.count == 0) {
        return;
    }
    to.least = to.count == 0 ? from.least : std::min(to.least, from.least);
    to.most = std::max(to.most, from.most);
    to.count += from.count;
    to.sum += from.sum;
}

void merge(interrupt_figure_t &to, const interrupt_figure_t &from)
{
    merge(to.instructions, from.instructions);
    merge(to.cycles, from.cycles);
    to.cycles_low += from.cycles_low;
    to.cycles_high += from.cycles_high;
}

} // namespace

void figure_add(figure_t *figure, uint64_t value)
{
    figure->least = figure->count == 0 ? value : std::min(figure->least, value);
    figure->most = std::max(figure->most, value);
    figure->sum += value;
    figure->count++;
}

void figures_merge(const figures_t *figures)
{
    const std::lock_guard<std::mutex> lock(mutex);
    for (int n = 0; n < FIGURE_MODES; ++n) {
        merge(total.mode[n], figures->mode[n]);
    }
    for (int n = 0; n < FIGURE_EVENTS; ++n) {
        merge(total.event[n], figures->event[n]);
    }
    for (int n = 0; n < FIGURE_INTERRUPTS; ++n) {
        merge(total.interrupt[n], figures->interrupt[n]);
    }
    total.latency_most = std::max(total.latency_most, figures->latency_most);
    total.identical += figures->identical;
    total.cycles += figures->cycles;
    total.cycles_asleep += figures->cycles_asleep;
    total.clock_Hz = figures->clock_Hz;
    total.period_cycles = figures->period_cycles;
    total.stack_most = std::max(total.stack_most, figures->stack_most);
    total.resets += figures->resets;
    total.bus_frames += figures->bus_frames;
    total.bus_idle += figures->bus_idle;
    total.refused += figures->refused;
    total.simulated_s += figures->simulated_s;
}

namespace pmsim
{

figures_t all_figures()
{
    const std::lock_guard<std::mutex> lock(mutex);
    return total;
}

} // namespace pmsim
