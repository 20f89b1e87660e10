// The --set option, the same for every command that takes a scenario.
#ifndef PMSIM_SETTINGS_OPTION_H
#define PMSIM_SETTINGS_OPTION_H

#include <string>
#include <vector>

#include "tools/pmsim/scenario_file.h"

namespace pmsim
{

inline const char *settings_help()
{
    return "name=value, may be repeated: a drive parameter in SI (flux_bandwidth=30), a key of a section "
           "(inverter.dead_time_s=0), a variable of the scenario's sweep (angle=35: that value only), or "
           "another machine "
           "(machine=FILE)";
}

inline Settings parse_settings(const std::vector<std::string> &words)
{
    Settings settings;
    for (const std::string &word : words) {
        const size_t equals = word.find('=');
        if (equals == std::string::npos || equals == 0) {
            throw InputError("--set " + word + ": expected name=value");
        }
        settings.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    }
    return settings;
}

} // namespace pmsim

#endif
