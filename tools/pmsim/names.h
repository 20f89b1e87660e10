// Names of the drive's states, modes, faults and limits as scenarios and traces write them.
#ifndef PMSIM_NAMES_H
#define PMSIM_NAMES_H

#include <string>
#include <vector>

namespace pmsim
{

inline const std::vector<std::string> &state_names()
{
    static const std::vector<std::string> names = {"off",     "calibrating", "finding",
                                                   "running", "stopping",    "fault"};
    return names;
}

inline const std::vector<std::string> &mode_names()
{
    static const std::vector<std::string> names = {"speed",    "torque",   "duty",   "current",
                                                   "identify", "saliency", "neutral"};
    return names;
}

// By fault code, from 0.
inline const std::vector<std::string> &fault_names()
{
    static const std::vector<std::string> names = {
        "NONE",
#define PM_FAULT(name, text) #name,
#include "firmware/drive/fault.def"
#undef PM_FAULT
    };
    return names;
}

// By commissioning_state_t and commissioning_reason_t.
inline const std::vector<std::string> &identify_state_names()
{
    static const std::vector<std::string> names = {"idle", "running", "done", "failed"};
    return names;
}

inline const std::vector<std::string> &identify_reason_names()
{
    static const std::vector<std::string> names = {"NONE",        "NO_CURRENT", "UNEVEN", "IMPLAUSIBLE",
                                                   "NOT_TURNING", "ABORTED",    "ROUND",  "TURNED"};
    return names;
}

// By bit of DRIVE_LIMIT_...
inline const std::vector<std::string> &limit_names()
{
    static const std::vector<std::string> names = {"current",    "voltage", "temperature",
                                                   "dc_voltage", "speed",   "slip"};
    return names;
}

inline std::string name_of(const std::vector<std::string> &names, int index)
{
    const auto i = static_cast<size_t>(index);
    return i < names.size() ? names[i] : "?" + std::to_string(index);
}

} // namespace pmsim

#endif
