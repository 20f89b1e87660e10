#include "tools/pmsim/expression.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <vector>

#include <muParser.h>

#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const size_t most_characters = 2000;

std::vector<std::string> known_names(const mu::Parser &parser)
{
    std::vector<std::string> names;
    for (const auto &entry : parser.GetVar()) {
        names.push_back(entry.first);
    }
    for (const auto &entry : parser.GetConst()) {
        names.push_back(entry.first);
    }
    for (const auto &entry : parser.GetFunDef()) {
        names.push_back(entry.first);
    }
    return names;
}

std::string reason_of(const mu::Parser &parser, const mu::Parser::exception_type &error)
{
    switch (error.GetCode()) {
    case mu::ecUNASSIGNABLE_TOKEN:
        return "unknown name \"" + error.GetToken() + "\"" +
               did_you_mean(nearest(error.GetToken(), known_names(parser)));
    case mu::ecUNEXPECTED_EOF:
        return "the formula ends too early";
    case mu::ecMISSING_PARENS:
        return "a parenthesis is missing";
    case mu::ecEMPTY_EXPRESSION:
        return "the formula is empty";
    default:
        return error.GetToken().empty() ? "no formula" : "\"" + error.GetToken() + "\" cannot stand here";
    }
}

// An assignment would change a variable. ==, <=, >= and != are comparisons.
size_t find_assignment(const std::string &text)
{
    for (size_t k = 0; k < text.size(); ++k) {
        if (text[k] == '=' && k + 1 < text.size() && text[k + 1] == '=') {
            ++k;
        } else if (text[k] == '=' && (k == 0 || std::string("<>!").find(text[k - 1]) == std::string::npos)) {
            return k;
        }
    }
    return std::string::npos;
}

[[noreturn]] void refuse(const Value &value, const std::string &reason, size_t column)
{
    value.fail(reason + ", at column " + std::to_string(column) + " of the formula");
}

// What muParser would take in ways of its own: texts, lists, assignments.
void check_characters(const Value &value, const std::string &text)
{
    if (text.size() > most_characters) {
        value.fail("the formula is longer than " + std::to_string(most_characters) + " characters");
    }
    const auto strange = std::find_if(text.begin(), text.end(), [](unsigned char c) {
        return c == '"' || c == ';' || (std::isprint(c) == 0 && std::isspace(c) == 0);
    });
    if (strange != text.end()) {
        refuse(value, "a character that no formula has", size_t(strange - text.begin()) + 1);
    }
    const size_t assignment = find_assignment(text);
    if (assignment != std::string::npos) {
        refuse(value, "\"=\" cannot stand here", assignment + 1);
    }
}

bool is_name(const std::string &word)
{
    return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) == 0 &&
           std::all_of(word.begin(), word.end(),
                       [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

} // namespace

struct Expression::Parser {
    mu::Parser formula;
    double x = 0.0, y = 0.0;
};

Constants read_constants(const Value &value)
{
    const Map map(value);
    const mu::Parser parser;
    Constants constants;
    for (const std::string &name : map.keys()) {
        if (!is_name(name) || parser.GetFunDef().count(name) != 0) {
            throw InputError(map.key_place(name), json_text(name) + " cannot be the name of a constant");
        }
        const double most = std::numeric_limits<double>::max();
        constants[name] = map.at(name).number(-most, most);
    }
    return constants;
}

Expression::Expression(const Value &value, const std::array<std::string, 2> &variables,
                       const Constants &constants)
    : value_(value), parser_(std::make_unique<Parser>())
{
    const std::string text = value.text();
    check_characters(value, text);
    mu::Parser &formula = parser_->formula;
    try {
        formula.DefineConst("pi", 3.14159265358979323846);
        for (const auto &constant : constants) {
            if (constant.first == variables[0] || constant.first == variables[1]) {
                value.fail("\"" + constant.first + "\" is a variable here and cannot be a constant");
            }
            formula.DefineConst(constant.first, constant.second);
        }
        formula.DefineVar(variables[0], &parser_->x);
        formula.DefineVar(variables[1], &parser_->y);
        formula.SetExpr(text);
        int results = 0;
        formula.Eval(results);
        if (results != 1) {
            value.fail("expected one formula, found " + std::to_string(results));
        }
    } catch (const mu::Parser::exception_type &error) {
        const size_t column = std::min(static_cast<size_t>(error.GetPos()), text.size()) + 1;
        refuse(value, reason_of(formula, error), column);
    }
}

Expression::~Expression() = default;
Expression::Expression(Expression &&) noexcept = default;

double Expression::operator()(double x, double y) const
{
    parser_->x = x;
    parser_->y = y;
    try {
        return parser_->formula.Eval();
    } catch (const mu::Parser::exception_type &) { // a domain error, where muParser was built to report it
        return std::numeric_limits<double>::quiet_NaN();
    }
}

const Value &Expression::value() const
{
    return value_;
}

} // namespace pmsim
