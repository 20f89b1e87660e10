#include "tools/pmsim/methods.h"

namespace pmsim
{

const std::vector<Method> &methods()
{
    static const bool IMPLEMENTED = true, NOT_YET = false;
    static const std::vector<Method> table = {
#define PM_METHOD(row, section, name, state, parameter, scenario)                                            \
    {row, section, name, state, parameter, scenario},
#include "tools/pmsim/methods.def"
#undef PM_METHOD
    };
    return table;
}

} // namespace pmsim
