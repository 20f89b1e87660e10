// The figures as people and tests want them.
#ifndef PMSIM_BOARD_FIGURES_REPORT_H
#define PMSIM_BOARD_FIGURES_REPORT_H

#include <string>
#include <utility>
#include <vector>

#include "tools/pmsim_board/figures.h"

namespace pmsim
{

figures_t all_figures();

// Name -> value, e.g. control.flux.mean (instructions), control.worst, load_percent, stack_bytes.
std::vector<std::pair<std::string, double>> figure_values(const figures_t &figures);

std::string figure_table(const figures_t &figures);
std::string figure_json(const figures_t &figures);

} // namespace pmsim

#endif
