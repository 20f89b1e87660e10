#include "tools/pmsim/methods.h"

namespace pmsim
{

namespace
{

enum : unsigned {
#define PM_CLASS(name, word, help) name = 1U << static_cast<unsigned>(ClassBit::name),
#include "tools/pmsim/method_classes.def"
#undef PM_CLASS
};

constexpr unsigned classes_of_rows[] = {
#define PM_METHOD(row, section, name, classes, state, parameter, scenario) (classes),
#include "tools/pmsim/methods.def"
#undef PM_METHOD
};

constexpr unsigned all_classes()
{
    unsigned all = 0;
    for (const unsigned classes : classes_of_rows) {
        if (classes == 0) {
            return 0; // a row without
        }
        all |= classes;
    }
    return all;
}

// Of every class of the book's list a method, or it says that the book has none.
static_assert((all_classes() | LINE_TO_LINE | FREEWHEELING) == 2U * FREEWHEELING - 1U &&
              (all_classes() & LINE_TO_LINE) == 0 && (all_classes() & FREEWHEELING) == 0);

} // namespace

// What the methods of the lists say that they implement.
static std::vector<Method> claimed(std::vector<Method> all)
{
    static const struct {
        size_t row;
        const char *parameter, *scenario;
    } claims[] = {
#define PM_CLAIM(row, parameter, scenario) {row, parameter, scenario},
#include "tools/pmsim/methods_of_lists.def"
#undef PM_CLAIM
    };
    for (const auto &claim : claims) {
        Method &method = all.at(claim.row - 1);
        method.implemented = true;
        method.parameter = claim.parameter;
        method.scenario = claim.scenario;
    }
    return all;
}

const std::vector<Method> &methods()
{
    static const bool IMPLEMENTED = true, NOT_YET = false;
    static const std::vector<Method> table = claimed({
#define PM_METHOD(row, section, name, classes, state, parameter, scenario)                                   \
    {row, section, name, classes, state, parameter, scenario},
#include "tools/pmsim/methods.def"
#undef PM_METHOD
    });
    return table;
}

const std::vector<MethodClass> &method_classes()
{
    static const std::vector<MethodClass> table = {
#define PM_CLASS(name, word, help) {name, word, help},
#include "tools/pmsim/method_classes.def"
#undef PM_CLASS
    };
    return table;
}

} // namespace pmsim
