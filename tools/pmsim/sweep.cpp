// `sweep:` and `cases:` of a scenario: which runs one file stands for.
#include <algorithm>
#include <cctype>
#include <cmath>

#include "tools/pmsim/scenario_file.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const size_t max_runs = 100000;

// "0, 5, ... 355" from {from: 0, to: 355, step: 5}; both ends belong to it.
std::vector<std::string> read_grid(const Value &value)
{
    const Map map(value, {"from", "to", "step"});
    const double from = map.at("from").number(-1e9, 1e9);
    const double to = map.at("to").number(from, 1e9);
    const double step = map.at("step").number(1e-9, 1e9);
    std::vector<std::string> values;
    const double count = std::floor((to - from) / step + 1e-9);
    if (count >= double(max_runs)) {
        value.fail("more than " + std::to_string(max_runs) + " values");
    }
    for (int i = 0; i <= int(count); ++i) {
        values.push_back(format(from + i * step, 12));
    }
    return values;
}

std::vector<std::string> read_axis(const Value &value)
{
    if (value.is_map()) {
        return read_grid(value);
    }
    std::vector<std::string> values;
    for (const Value &item : value.list()) {
        values.push_back(item.text());
    }
    if (values.empty()) {
        value.fail("the list is empty");
    }
    return values;
}

struct Case {
    std::string name;
    Variables variables;
};

std::vector<Case> read_cases(const Value &value)
{
    std::vector<Case> cases;
    std::vector<std::string> first_keys;
    for (const Value &item : value.list()) {
        const Map map(item);
        Case one;
        for (const std::string &key : map.keys()) {
            (key == "name" ? one.name : one.variables[key]) = map.at(key).text();
        }
        if (one.name.empty()) {
            for (const auto &entry : one.variables) {
                one.name += (one.name.empty() ? "" : " ") + entry.first + "=" + entry.second;
            }
        }
        const auto has_its_name = [&one](const Case &other) { return other.name == one.name; };
        if (std::any_of(cases.begin(), cases.end(), has_its_name)) {
            item.fail("a second case of the name \"" + one.name + "\"");
        }
        if (!cases.empty()) {
            for (const auto &entry : cases.front().variables) {
                map.at(entry.first); // every case gives the same variables
            }
            if (one.variables.size() != cases.front().variables.size()) {
                item.fail("gives a variable that the first case does not give");
            }
        }
        cases.push_back(one);
    }
    if (cases.empty()) {
        value.fail("the list is empty");
    }
    return cases;
}

// Whether a value at or below this node contains $name.
bool uses(const YAML::Node &node, const std::string &name)
{
    if (node.IsScalar()) {
        const std::string &text = node.Scalar();
        const std::string variable = "$" + name;
        for (size_t at = text.find(variable); at != std::string::npos; at = text.find(variable, at + 1)) {
            const size_t end = at + variable.size();
            if (end == text.size() ||
                (std::isalnum(static_cast<unsigned char>(text[end])) == 0 && text[end] != '_')) {
                return true;
            }
        }
        return false;
    }
    return std::any_of(node.begin(), node.end(), [&name](const auto &item) {
        return uses(item.IsDefined() ? item : item.second, name);
    });
}

} // namespace

void refuse_unused_variables(const Map &document)
{
    const auto is_used = [&document](const std::string &name) {
        const auto &keys = document.keys();
        return std::any_of(keys.begin(), keys.end(), [&](const std::string &key) {
            return key != "sweep" && key != "cases" && uses(document.at(key).node(), name);
        });
    };
    const auto refuse = [&is_used](const Map &map) {
        for (const std::string &key : map.keys()) {
            if (key != "name" && !is_used(key)) {
                throw InputError(map.key_place(key),
                                 "variable \"" + key + "\" is used nowhere: each run is the same");
            }
        }
    };
    if (const auto cases = document.find("cases")) {
        refuse(Map(cases->list().front()));
    }
    if (const auto sweep = document.find("sweep")) {
        refuse(Map(*sweep));
    }
}

std::vector<std::string> variable_names(const Map &document)
{
    std::vector<std::string> names;
    if (const auto cases = document.find("cases")) {
        const Variables first = read_cases(*cases).front().variables;
        for (const auto &entry : first) {
            names.push_back(entry.first);
        }
        names.emplace_back("case");
    }
    if (const auto sweep = document.find("sweep")) {
        const Map axes(*sweep);
        for (const std::string &key : axes.keys()) {
            names.push_back(key);
        }
    }
    return names;
}

std::vector<Run> expand_runs(const Map &document, const Variables &fixed)
{
    std::vector<Run> runs(1);
    if (const auto cases = document.find("cases")) {
        runs.clear();
        for (const Case &one : read_cases(*cases)) {
            const auto only = fixed.find("case");
            if (only == fixed.end() || only->second == one.name) {
                runs.push_back({one.name, one.variables, {}});
                runs.back().variables["case"] = one.name;
                for (const auto &entry : fixed) {
                    if (one.variables.count(entry.first) != 0) {
                        runs.back().variables[entry.first] = entry.second;
                    }
                }
            }
        }
        if (runs.empty()) {
            cases->fail("there is no case \"" + fixed.at("case") + "\"");
        }
    }
    const auto sweep = document.find("sweep");
    if (!sweep) {
        return runs;
    }
    const Map axes(*sweep);
    for (const std::string &key : axes.keys()) {
        const auto one = fixed.find(key);
        const std::vector<std::string> values =
            one != fixed.end() ? std::vector<std::string>{one->second} : read_axis(axes.at(key));
        std::vector<Run> product;
        if (runs.size() * values.size() > max_runs) {
            sweep->fail("more than " + std::to_string(max_runs) + " runs");
        }
        for (const Run &run : runs) {
            for (const std::string &value : values) {
                product.push_back(run);
                product.back().name.append(run.name.empty() ? "" : " ").append(key).append("=").append(value);
                if (!product.back().variables.emplace(key, value).second) {
                    throw InputError(axes.key_place(key), "variable \"" + key + "\" is given by cases too");
                }
            }
        }
        runs = std::move(product);
    }
    return runs;
}

} // namespace pmsim
