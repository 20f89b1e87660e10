// A figure of a validation test: checked against its bound, kept in the test report, and appended as a line
//   id,value,bound,unit,section
// to the file that the environment variable PMDRIVE_MEASURED names. docs/plant.md is made from those lines.
#ifndef TESTS_REFERENCE_MEASURED_H
#define TESTS_REFERENCE_MEASURED_H

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace reference
{

// The section is that of METHODS.md, or the effect of its 0.2. The unit is that of value and bound.
inline void measured(const std::string &id, double value, double bound, const std::string &unit,
                     const std::string &section)
{
    std::ostringstream figure;
    figure.precision(3);
    figure << value;
    ::testing::Test::RecordProperty(id, figure.str());
    EXPECT_LE(value, bound) << id << " in " << unit << ", METHODS.md " << section; // also fails for NaN

    const char *file = std::getenv("PMDRIVE_MEASURED");
    if (file != nullptr && *file != '\0') {
        std::ostringstream line;
        line << id << ',' << figure.str() << ',' << bound << ',' << unit << ',' << section << '\n';
        std::ofstream(file, std::ios::app) << line.str(); // one write, so that parallel tests do not mix
    }
}

} // namespace reference

#endif
