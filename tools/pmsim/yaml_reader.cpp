#include "tools/pmsim/yaml_reader.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tools/pmsim/input_files.h"
#include "tools/pmsim/text.h"

namespace pmsim
{

std::string to_string(const Place &place)
{
    if (place.line == 0) {
        return place.file;
    }
    const std::string line = place.file + ":" + std::to_string(place.line);
    return place.column == 0 ? line : line + ":" + std::to_string(place.column);
}

InputError::InputError(const Place &place, const std::string &message)
    : std::runtime_error(to_string(place) + ": " + message)
{
}

InputError::InputError(const std::string &message) : std::runtime_error(message)
{
}

static Place place_of(const YAML::Mark &mark, const std::string &file)
{
    if (mark.is_null()) {
        return {file, 0, 0};
    }
    return {file, mark.line + 1, mark.column + 1};
}

Value::Value(const YAML::Node &node, std::string file, const Variables *variables)
    : node_(node), file_(std::move(file)), variables_(variables)
{
}

Value Value::from_text(const std::string &text, const std::string &name, const Variables *variables)
{
    try {
        const std::vector<YAML::Node> documents = YAML::LoadAll(text);
        if (documents.size() > 1) {
            throw InputError(place_of(documents[1].Mark(), name),
                             "a second document begins here; one is read");
        }
        return Value(documents.empty() ? YAML::Node() : documents[0], name, variables);
    } catch (const YAML::Exception &error) {
        throw InputError(place_of(error.mark, name), error.msg);
    }
}

Value Value::from_file(const std::string &path, const Variables *variables)
{
    if (std::filesystem::is_directory(path)) {
        throw InputError(path + ": cannot be read: it is a folder");
    }
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    if (!in) {
        throw InputError(path + ": cannot be read: " + std::strerror(errno));
    }
    if (!(text << in.rdbuf())) {
        throw InputError(path + (in.bad() ? ": cannot be read" : ": is empty"));
    }
    note_input(path);
    return from_text(text.str(), path, variables);
}

Place Value::place() const
{
    return place_of(node_.Mark(), file_);
}

void Value::fail(const std::string &message) const
{
    throw InputError(place(), message);
}

const YAML::Node &Value::node() const
{
    return node_;
}

const std::string &Value::file() const
{
    return file_;
}

const Variables *Value::variables() const
{
    return variables_;
}

Value Value::with(const Variables *variables) const
{
    return Value(node_, file_, variables);
}

bool Value::is_map() const
{
    return node_.IsMap();
}

bool Value::is_list() const
{
    return node_.IsSequence();
}

bool Value::is_scalar() const
{
    return node_.IsScalar();
}

std::string Value::scalar() const
{
    if (!node_.IsScalar()) {
        fail(node_.IsNull() ? "a value is missing" : "expected a single value");
    }
    return node_.Scalar();
}

const std::string &Value::variable(const std::string &name) const
{
    std::vector<std::string> known;
    if (variables_ != nullptr) {
        const auto found = variables_->find(name);
        if (found != variables_->end()) {
            return found->second;
        }
        for (const auto &entry : *variables_) {
            known.push_back(entry.first);
        }
    }
    fail("there is no variable \"$" + name + "\"" + did_you_mean(nearest(name, known)));
}

// A sum, its signs between spaces, of products of numbers and variables: "-0.5*$load + 2".
double Value::evaluate(const std::string &text) const
{
    const size_t plus = text.rfind(" + ");
    return plus == std::string::npos ? product(text)
                                     : evaluate(text.substr(0, plus)) + product(trim(text.substr(plus + 3)));
}

// With an optional leading minus: "-0.5*$load".
double Value::product(const std::string &text) const
{
    double product = 1.0;
    std::string rest = text;
    if (rest.size() > 1 && rest[0] == '-' && rest[1] == '$') {
        product = -1.0;
        rest.erase(0, 1);
    }
    for (const std::string &part : split(rest, '*')) {
        const std::string factor = trim(part);
        const bool is_variable = !factor.empty() && factor[0] == '$';
        const std::string digits = is_variable ? variable(factor.substr(1)) : factor;
        double value = 0.0;
        const char *end = digits.data() + digits.size();
        const auto result = std::from_chars(digits.data(), end, value);
        if (digits.empty() || result.ptr != end) {
            std::string found = "\"" + text + "\"";
            if (is_variable) {
                found.append(" (").append(factor).append(" is \"").append(digits).append("\")");
            }
            fail("expected a number, found " + found + "; a unit belongs in the key");
        }
        if (result.ec != std::errc() || !std::isfinite(value)) {
            fail("\"" + text + "\" is not a finite number");
        }
        product *= value;
    }
    return product;
}

double Value::number(double min, double max) const
{
    const std::string text = scalar();
    const double value = evaluate(text);
    if (!(value >= min && value <= max)) {
        const std::string shown = text.find('$') == std::string::npos ? text : text + " = " + format(value);
        fail(shown + " is out of range " + format(min) + " ... " + format(max));
    }
    return value;
}

int64_t Value::integer(int64_t min, int64_t max) const
{
    const double value = number(static_cast<double>(min), static_cast<double>(max));
    if (value != std::floor(value)) {
        fail("expected a whole number, found " + scalar());
    }
    return static_cast<int64_t>(value);
}

std::string Value::text() const
{
    std::string text = scalar();
    if (text.size() > 1 && text[0] == '$') {
        text = variable(text.substr(1));
    }
    return text;
}

bool Value::flag() const
{
    const std::string value = text();
    if (value == "true") {
        return true;
    }
    if (value != "false") {
        fail("expected true or false, found \"" + value + "\"");
    }
    return false;
}

std::string Value::word(const std::vector<std::string> &known) const
{
    std::string value = text();
    if (std::find(known.begin(), known.end(), value) == known.end()) {
        fail("\"" + value + "\" is not known here; one of: " + join(known, ", ") +
             did_you_mean(nearest(value, known)));
    }
    return value;
}

std::vector<Value> Value::list() const
{
    if (!node_.IsSequence()) {
        fail("expected a list");
    }
    std::vector<Value> values;
    for (const YAML::Node &item : node_) {
        values.emplace_back(item, file_, variables_);
    }
    return values;
}

Map::Map(const Value &value) : value_(value)
{
    open();
}

Map::Map(const Value &value, const std::vector<std::string> &known) : value_(value)
{
    open();
    for (const std::string &key : keys_) {
        if (std::find(known.begin(), known.end(), key) == known.end()) {
            throw InputError(places_.at(key), unknown("key", key, known));
        }
    }
}

void Map::open()
{
    if (!value_.is_map()) {
        value_.fail("expected keys with values (a mapping)");
    }
    for (const auto &entry : value_.node()) {
        const Place place = place_of(entry.first.Mark(), value_.file());
        if (!entry.first.IsScalar()) {
            throw InputError(place, "a key must be a word");
        }
        const std::string key = entry.first.Scalar();
        if (!places_.emplace(key, place).second) {
            throw InputError(place, "key \"" + key + "\" stands here a second time; first at line " +
                                        std::to_string(places_.at(key).line));
        }
        keys_.push_back(key);
    }
}

bool Map::has(const std::string &key) const
{
    return places_.count(key) != 0;
}

std::optional<Value> Map::find(const std::string &key) const
{
    if (!has(key)) {
        return std::nullopt;
    }
    const YAML::Node node = value_.node()[key];
    if (node.IsNull()) { // whose place is where the next one begins
        throw InputError(key_place(key), "key \"" + key + "\": a value is missing");
    }
    return Value(node, value_.file(), value_.variables());
}

Value Map::at(const std::string &key) const
{
    if (!has(key)) {
        value_.fail("key \"" + key + "\" is missing");
    }
    return *find(key);
}

const std::vector<std::string> &Map::keys() const
{
    return keys_;
}

Place Map::key_place(const std::string &key) const
{
    return places_.at(key);
}

const Value &Map::value() const
{
    return value_;
}

} // namespace pmsim
