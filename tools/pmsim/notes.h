// What reading a machine has to tell the user, on standard error: the command goes on.
#ifndef PMSIM_NOTES_H
#define PMSIM_NOTES_H

#include <cstdio>
#include <string>

#include "tools/pmsim/setup.h"

namespace pmsim
{

inline void print_note(const std::string &note)
{
    if (!note.empty()) {
        std::fprintf(stderr, "note: %s\n", note.c_str());
    }
}

inline void print_notes(const Setup &setup)
{
    if (setup.flux_map) {
        print_note(setup.flux_map->note);
        const std::string warning =
            flux_table_warning(*setup.flux_map, setup.plant.machine.R_s_ohm, setup.plant.machine.pole_pairs);
        if (!warning.empty()) {
            std::fprintf(stderr, "warning: %s\n", warning.c_str());
        }
    }
}

} // namespace pmsim

#endif
