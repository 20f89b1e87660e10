// The same motor, inverter and load for other voltages and currents: wound again, so that everything is as it was in
// per unit, angles, speeds and times included. The emulated board has its own sensors, by its schematic; a machine for
// other voltages is run on it like this (`pmsim board --similar`).
//
// A value is multiplied by powers of the two ratios that follow from its unit, the end of its key: _ohm by v/i, _H by v/i,
// _Wb by v, _Nm, _kgm2 and _Nms by v i, _F by i/v.
// Tests: tests/unit/pmsim/similarity_test.cpp.
#ifndef PMSIM_SIMILARITY_H
#define PMSIM_SIMILARITY_H

#include <string>

namespace pmsim
{

struct Setup;

struct Similarity {
    double v = 1.0, i = 1.0; // voltages and currents, new over old

    double of_unit(const std::string &unit) const; // 1 for what is neither
    double of_key(const std::string &key) const;   // "v_source_V"
};

// All of the bench: machine, inverter, sensors, link, rated values, the drive's parameters. Refuses a flux map.
void make_similar(Setup &setup, const Similarity &similarity);

// A board that has sensors of its own, low-side shunts, in place of the machine file's.
struct OwnSensors {
    double i_full_scale_A, v_full_scale_V, settle_s;
    bool similar; // machines are wound for it
};

// For all scenarios that are read from now on.
void use_board(const OwnSensors &sensors);
void fit_board(Setup &setup); // nothing without use_board()

} // namespace pmsim

#endif
