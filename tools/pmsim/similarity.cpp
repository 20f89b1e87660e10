#include "tools/pmsim/similarity.h"

#include <cmath>
#include <map>
#include <optional>

#include "firmware/params/parameters.h"
#include "tools/pmsim/setup_fields.h"

namespace pmsim
{
namespace
{

struct Powers {
    int v, i;
};

// As keys of files, the firmware's table and metrics write them.
const std::map<std::string, Powers> powers = {
    {"V", {1, 0}},       {"A", {0, 1}},     {"ohm", {1, -1}},  {"H", {1, -1}},
    {"Wb", {1, 0}},      {"Vs", {1, 0}},    {"F", {-1, 1}},    {"Nm", {1, 1}},
    {"N m", {1, 1}},     {"Nms", {1, 1}},   {"N m s", {1, 1}}, {"Nms2", {1, 1}},
    {"kgm2", {1, 1}},    {"kg m2", {1, 1}}, {"W", {1, 1}},     {"Wb5", {-5, 1}}, // A / Wb^5
    {"A/Wb^2", {-2, 1}}, {"Nm/A", {1, 0}},
};

struct Scaler {
    double factor;

    void operator()(double *number) const
    {
        *number *= factor;
    }
    void operator()(const List &list) const
    {
        const int count = list.per == Per::set ? PLANT_SETS : PLANT_LEGS;
        for (int n = 0; n < count; ++n) {
            list.first[n] *= factor;
        }
    }
    void operator()(const Harmonics &harmonics) const
    {
        for (int n = 0; n < harmonics.room; ++n) {
            harmonics.first[n].amplitude *= factor;
        }
    }
    template <class Other> void operator()(Other * /* counts and choices */) const
    {
    }
};

std::optional<OwnSensors> board;

std::string key_of(const Field &field, const Target &target)
{
    const auto *harmonics = std::get_if<Harmonics>(&target);
    return harmonics != nullptr ? harmonics->amplitude_key : field.key;
}

} // namespace

double Similarity::of_unit(const std::string &unit) const
{
    const auto found = powers.find(unit);
    return found == powers.end() ? 1.0 : std::pow(v, found->second.v) * std::pow(i, found->second.i);
}

double Similarity::of_key(const std::string &key) const
{
    return of_unit(key.substr(key.rfind('_') + 1));
}

void make_similar(Setup &setup, const Similarity &similarity)
{
    if (setup.flux_map) {
        throw InputError(setup.file + ": a machine with a flux map cannot be wound again");
    }
    for (const Field &field : setup_fields()) {
        const Target target = field.target(setup);
        std::visit(Scaler{similarity.of_key(key_of(field, target))}, target);
    }
    for (int32_t n = 0; n < int32_t(DRIVE_PARAM_COUNT); ++n) {
        const auto id = static_cast<drive_param_id_t>(n);
        const double factor = similarity.of_unit(drive_param_text[id].unit);
        if (factor != 1.0) {
            set_parameter_si(*setup.params, id, factor * parameter_si(*setup.params, id));
        }
    }
    setup.similarity = similarity;
}

void use_board(const OwnSensors &sensors)
{
    board = sensors;
}

void fit_board(Setup &setup)
{
    if (!board) {
        return;
    }
    plant_sensor_t &sensor = setup.plant.sensor;
    if (board->similar) {
        make_similar(setup, {board->v_full_scale_V / sensor.v_full_scale_V,
                             board->i_full_scale_A / sensor.i_full_scale_A});
    }
    sensor.i_full_scale_A = board->i_full_scale_A;
    sensor.v_full_scale_V = board->v_full_scale_V;
    if (setup.given.count("sensor.shunt") == 0) {
        sensor.shunt = PLANT_LOW_SIDE;
        sensor.settle_s = board->settle_s;
    }
    derive_board_parameters(setup);
}

} // namespace pmsim
