// Which methods of the book are here. Data: methods.def.
#ifndef PMSIM_METHODS_H
#define PMSIM_METHODS_H

#include <string>
#include <vector>

namespace pmsim
{

struct Method {
    int row;
    std::string section, name;
    bool implemented;
    std::string parameter; // selects or tunes it; empty: always on; none: in no image yet
    std::string scenario;  // in tests/scenario
};

const std::vector<Method> &methods();

} // namespace pmsim

#endif
