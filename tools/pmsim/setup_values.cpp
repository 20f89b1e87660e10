// How the values of setup_fields.cpp are read.
#include <cmath>

#include "tools/pmsim/setup_fields.h"

namespace pmsim
{
namespace
{

const double degree = 0.017453292519943295;
const int max_order = 999;
const int trapezoid_max_order = 31; // the 31st of a 120 degree trapezoid is 0.1 % of the EMF

const std::vector<std::string> connections = {"star", "open"}; // in the order of plant_connection_t
const std::vector<std::string> shunts = {"in_line", "low_side", "single_shunt"};
const std::vector<std::string> references = {"mean", "half_link", "neutral"};

template <class Enum> Enum read_choice(const Value &value, const std::vector<std::string> &names)
{
    const std::string word = value.word(names);
    int index = 0;
    while (names[static_cast<size_t>(index)] != word) {
        ++index;
    }
    return static_cast<Enum>(index);
}

int set_count(const Setup &setup)
{
    return setup.plant.winding.sets == 2 ? 2 : 1;
}

void read_list(const Value &value, int count, const std::string &what, const Field &field, double *first)
{
    const std::vector<Value> items = value.list();
    if (items.size() != static_cast<size_t>(count)) {
        value.fail("expected one value per " + what);
    }
    const bool in_degrees = std::string(field.key).find("_deg") != std::string::npos;
    for (size_t i = 0; i < items.size(); ++i) {
        first[i] = items[i].number(field.min, field.max) * (in_degrees ? degree : 1.0);
    }
}

void read_list(Setup &setup, const Field &field, const List &list, const Value &value)
{
    const int sets = set_count(setup);
    switch (list.per) {
    case Per::leg:
        read_legs(value, leg_count(setup.plant), field.min, field.max, list.first);
        break;
    case Per::phase:
        read_list(value, 3 * sets, sets == 1 ? "phase: [a, b, c]" : "phase: [a, b, c, x, y, z]", field,
                  list.first);
        break;
    case Per::pair:
        read_list(value, 3 * sets, sets == 1 ? "pair: [ab, bc, ca]" : "pair: [ab, bc, ca, xy, yz, zx]", field,
                  list.first);
        break;
    case Per::set:
        read_list(value, sets, sets == 1 ? "set: [abc]" : "set: [abc, xyz]", field, list.first);
        break;
    }
}

// sim_plant/winding.h: n = 2 mod 3. What a phase inductance has of order 4 is -4 of the saliency.
int read_saliency_order(const Value &value)
{
    const int order = static_cast<int>(value.integer(-max_order, max_order));
    const auto possible = [](int n) { return (n % 3 + 3) % 3 == 2; };
    if (!possible(order)) {
        value.fail(std::to_string(order) +
                   " is no order of a winding of three equal phases: it can have 2, 5, 8, 11 ... and -1, -4, "
                   "-7, -10 ..." +
                   (possible(-order) ? "; did you mean " + std::to_string(-order) + "?" : ""));
    }
    return order;
}

void read_harmonics(const Field &field, const Harmonics &harmonics, const Value &value)
{
    const std::vector<Value> items = value.list();
    if (items.size() > static_cast<size_t>(harmonics.room)) {
        value.fail("at most " + std::to_string(harmonics.room) + " harmonics");
    }
    std::vector<plant_harmonic_t> read;
    for (const Value &item : items) {
        const Map map(item, {"order", harmonics.amplitude_key, "phase_deg"});
        plant_harmonic_t h{};
        h.order = harmonics.min_order == orders_of_saliency
                      ? read_saliency_order(map.at("order"))
                      : static_cast<int>(map.at("order").integer(harmonics.min_order, max_order));
        h.amplitude = map.at(harmonics.amplitude_key).number(field.min, field.max);
        if (const auto phase = map.find("phase_deg")) {
            h.phase_rad = phase->number(-360, 360) * degree;
        }
        for (const plant_harmonic_t &other : read) {
            if (other.order == h.order) {
                map.at("order").fail("order " + std::to_string(h.order) + " stands here a second time");
            }
        }
        read.push_back(h);
    }
    for (size_t i = 0; i < static_cast<size_t>(harmonics.room); ++i) {
        harmonics.first[i] = i < read.size() ? read[i] : plant_harmonic_t{};
    }
}

struct Reader { // what to do with each kind of member
    Setup &setup;
    const Field &field;
    const Value &value;

    void operator()(double *number) const
    {
        *number = value.number(field.min, field.max);
    }
    void operator()(int *whole) const
    {
        *whole = static_cast<int>(value.integer(int64_t(field.min), int64_t(field.max)));
    }
    void operator()(uint32_t *count) const
    {
        *count = static_cast<uint32_t>(value.integer(int64_t(field.min), int64_t(field.max)));
    }
    void operator()(bool *flag) const
    {
        *flag = value.flag();
    }
    void operator()(plant_connection_t *connection) const
    {
        *connection = read_choice<plant_connection_t>(value, connections);
    }
    void operator()(plant_shunt_t *shunt) const
    {
        *shunt = read_choice<plant_shunt_t>(value, shunts);
    }
    void operator()(plant_reference_t *reference) const
    {
        *reference = read_choice<plant_reference_t>(value, references);
    }
    void operator()(const List &list) const
    {
        read_list(setup, field, list, value);
    }
    void operator()(const Harmonics &harmonics) const
    {
        read_harmonics(field, harmonics, value);
    }
};

} // namespace

void read_field(Setup &setup, const Field &field, const Value &value)
{
    std::visit(Reader{setup, field, value}, field.target(setup));
}

int leg_count(const plant_config_t &plant)
{
    return plant.winding.sets == 2 || plant.winding.connection == PLANT_OPEN ? 6 : 3;
}

const std::vector<std::string> &leg_names()
{
    static const std::vector<std::string> names = {"a", "b", "c", "x", "y", "z"};
    return names;
}

void read_legs(const Value &value, int legs, double min, double max, double *first)
{
    const std::vector<Value> items = value.list();
    if (items.size() != static_cast<size_t>(legs)) {
        value.fail(legs == 3 ? "expected one value per leg: [a, b, c]"
                             : "expected one value per leg: [a, b, c, x, y, z]");
    }
    for (size_t leg = 0; leg < items.size(); ++leg) {
        first[leg] = items[leg].number(min, max);
    }
}

// EMF of phase A: -omega times a sum of n psi_n sin(n theta). A trapezoid whose ramp takes the angle r on
// either side of its zero crossing has sine components in proportion to sin(n r) / n^2.
void expand_trapezoid(Setup &setup)
{
    if (setup.trapezoid_flat_deg < 0.0) {
        return;
    }
    const double r = (90.0 - 0.5 * setup.trapezoid_flat_deg) * degree;
    plant_harmonic_t *const emf = setup.plant.winding.emf;
    int count = 0;
    for (int n = 3; n <= trapezoid_max_order && count < PLANT_HARMONICS; n += 2) {
        const double ratio = r > 0.0 ? std::sin(n * r) / std::sin(r) : n; // a square wave at the limit
        emf[count++] = {n, setup.plant.machine.psi_m_Wb * ratio / (double(n) * n * n), 0.0};
    }
    while (count < PLANT_HARMONICS) {
        emf[count++] = {};
    }
}

} // namespace pmsim
