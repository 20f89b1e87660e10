// A formula of two variables in a YAML value: "psi_d/L_d + c*psi_d*(psi_d^2 + psi_q^2)^2".
//
// Operators + - * / ^ and comparisons with ?:, functions of muParser (sqrt, exp, log, tanh, atan, abs, min
// ...), the constant pi and those given. An unknown name, an error of syntax and a formula that changes a
// variable are refused with the place of the value and the column within the formula. Cost: 50 to 100 ns a
// call. Tests: tests/unit/pmsim/flux_map_test.cpp.
#ifndef PMSIM_EXPRESSION_H
#define PMSIM_EXPRESSION_H

#include <array>
#include <map>
#include <memory>
#include <string>

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

using Constants = std::map<std::string, double>;

Constants read_constants(const Value &value); // a mapping of names to numbers

class Expression
{
  public:
    Expression(const Value &value, const std::array<std::string, 2> &variables, const Constants &constants);
    ~Expression();
    Expression(Expression &&) noexcept;

    double operator()(double x, double y) const; // may be infinite or not a number
    const Value &value() const;

  private:
    struct Parser;
    Value value_;
    std::unique_ptr<Parser> parser_;
};

} // namespace pmsim

#endif
