#include "tools/pmsim/methods.h"

namespace pmsim
{

// What the methods of the lists say that they implement.
static std::vector<Method> claimed(std::vector<Method> all)
{
#define PM_CLAIM(number, parameter_name, proof)                                                              \
    all.at(number - 1).implemented = true;                                                                   \
    all.at(number - 1).parameter = parameter_name;                                                           \
    all.at(number - 1).scenario = proof;
#include "tools/pmsim/methods_of_lists.def"
#undef PM_CLAIM
    return all;
}

const std::vector<Method> &methods()
{
    static const bool IMPLEMENTED = true, NOT_YET = false;
    static const std::vector<Method> table = claimed({
#define PM_METHOD(row, section, name, state, parameter, scenario)                                            \
    {row, section, name, state, parameter, scenario},
#include "tools/pmsim/methods.def"
#undef PM_METHOD
    });
    return table;
}

} // namespace pmsim
