#include "tools/pmsim/methods.h"

namespace pmsim
{

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
#define PM_METHOD(row, section, name, state, parameter, scenario)                                            \
    {row, section, name, state, parameter, scenario},
#include "tools/pmsim/methods.def"
#undef PM_METHOD
    });
    return table;
}

} // namespace pmsim
