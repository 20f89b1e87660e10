// Typed access to YAML with errors that name file, line and column.
//
// A Value is a node with its place; a Map is a mapping whose keys are checked when it is opened: an unknown
// or duplicate key, and one with the wrong unit, is refused before anything is read. Any scalar may contain
// variables of the scenario ("$load"); numbers may be a product ("-0.5*$load") or a sum of products
// ("2*$a + 3*$b"). Numbers carry no unit: the unit stands in the key. Tests: tests/unit/pmsim/yaml_reader_test.cpp.
#ifndef PMSIM_YAML_READER_H
#define PMSIM_YAML_READER_H

#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace pmsim
{

struct Place {
    std::string file;
    int line = 0;   // from 1; 0: not from a file
    int column = 0; // from 1; 0: the whole line
};

std::string to_string(const Place &place);

// The user's mistake: text for the terminal, with the place.
class InputError : public std::runtime_error
{
  public:
    InputError(const Place &place, const std::string &message);
    explicit InputError(const std::string &message);
};

using Variables = std::map<std::string, std::string>;

class Value
{
  public:
    Value(const YAML::Node &node, std::string file, const Variables *variables = nullptr);

    static Value from_file(const std::string &path, const Variables *variables = nullptr);
    static Value from_text(const std::string &text, const std::string &name,
                           const Variables *variables = nullptr);

    double number(double min, double max) const;
    int64_t integer(int64_t min, int64_t max) const;
    bool flag() const;
    std::string text() const;
    std::string word(const std::vector<std::string> &known) const; // one of these
    std::vector<Value> list() const;
    bool is_map() const;
    bool is_list() const;
    bool is_scalar() const;

    Place place() const;
    const YAML::Node &node() const;
    const std::string &file() const;
    const Variables *variables() const;
    Value with(const Variables *variables) const;
    [[noreturn]] void fail(const std::string &message) const;

  private:
    std::string scalar() const;
    double evaluate(const std::string &text) const;
    double product(const std::string &text) const;
    const std::string &variable(const std::string &name) const;

    YAML::Node node_;
    std::string file_;
    const Variables *variables_;
};

class Map
{
  public:
    Map(const Value &value, const std::vector<std::string> &known);
    explicit Map(const Value &value); // any key; duplicates are still refused

    bool has(const std::string &key) const;
    std::optional<Value> find(const std::string &key) const;
    Value at(const std::string &key) const;       // refuses the file when missing
    const std::vector<std::string> &keys() const; // in the order of the file
    Place key_place(const std::string &key) const;
    const Value &value() const;

  private:
    void open();

    Value value_;
    std::vector<std::string> keys_;
    std::map<std::string, Place> places_;
};

} // namespace pmsim

#endif
