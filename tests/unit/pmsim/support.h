// Shared by the tests of pmsim: texts of errors, a small machine and a small scenario.
#ifndef PMSIM_TEST_SUPPORT_H
#define PMSIM_TEST_SUPPORT_H

#include <string>

#include "tools/pmsim/yaml_reader.h"

// What the user would read, or "no error".
template <class Action> std::string error_of(Action action)
{
    try {
        action();
    } catch (const pmsim::InputError &error) {
        return error.what();
    }
    return "no error";
}

inline std::string replaced(std::string text, const std::string &from, const std::string &to)
{
    const size_t at = text.find(from);
    return at == std::string::npos ? "the test is wrong" : text.replace(at, from.size(), to);
}

// A short scenario on IPM-1000; file names are relative to the source root, where tests run.
inline std::string small_scenario()
{
    return "title: small\n"
           "machine: sim_plant/machines/ipm_1000.yaml\n"
           "start: {theta_e_deg: 30}\n"
           "duration_s: 0.3\n"
           "profile:\n"
           "  - {t_s: 0, mode: speed, speed_rel: 0.1, enable: true}\n"
           "expect:\n"
           "  - {metric: fault, equals: NONE, book: \"1.1\"}\n";
}

#endif
