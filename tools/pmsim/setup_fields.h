// The keys of all sections but `drive` and `flux_map`: limits, when a machine file must give them, and the
// member they set. Internal to setup*.cpp.
#ifndef PMSIM_SETUP_FIELDS_H
#define PMSIM_SETUP_FIELDS_H

#include <variant>

#include "tools/pmsim/setup.h"

namespace pmsim
{

enum class Need {
    optional,
    always, // in a machine file
    core,   // unless there is a flux map, which takes its place
    drive   // to run the firmware
};

enum class Per { leg, phase, pair, set }; // what a list has one value for; pair: AB, BC, CA of each set

struct List {
    double *first;
    Per per;
};

constexpr int orders_of_saliency = 0; // as min_order: those that three equal phases can have (winding.h)

struct Harmonics {
    plant_harmonic_t *first;
    int room, min_order;
    const char *amplitude_key;
};

using Target = std::variant<double *, int *, uint32_t *, bool *, plant_connection_t *, plant_shunt_t *,
                            plant_reference_t *, List, Harmonics>;

struct Field {
    const char *section, *key;
    double min, max; // of a list of harmonics: of the amplitude
    Need need;
    Target (*target)(Setup &);
};

const std::vector<Field> &setup_fields();
void read_field(Setup &setup, const Field &field, const Value &value);

// Fills winding.emf from trapezoid_flat_deg, if there is one, and the magnets' flux.
void expand_trapezoid(Setup &setup);

} // namespace pmsim

#endif
