// Which methods of the book are here, and of which class each is (METHODS.md 1.6.1, row 11). Data: methods.def, method_classes.def.
#ifndef PMSIM_METHODS_H
#define PMSIM_METHODS_H

#include <string>
#include <vector>

namespace pmsim
{

// As numbers of bits.
enum class ClassBit {
#define PM_CLASS(name, word, help) name,
#include "tools/pmsim/method_classes.def"
#undef PM_CLASS
};

struct MethodClass {
    unsigned mask;
    std::string word, help;
};

struct Method {
    int row;
    std::string section, name;
    unsigned classes; // masks, at least one
    bool implemented;
    std::string parameter; // selects or tunes it; empty: always on; none: in no image yet
    std::string scenario;  // in tests/scenario
};

const std::vector<Method> &methods();
const std::vector<MethodClass> &method_classes();

} // namespace pmsim

#endif
