#include "tools/pmsim/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "tools/pmsim/text.h"

namespace pmsim
{

static std::string value_text(const Outcome &outcome)
{
    return outcome.value.text.empty() ? format(outcome.value.number, 4) : outcome.value.text;
}

// For people: a metric that saw nothing has no number.
static std::string shown(const Outcome &outcome)
{
    return outcome.value.text.empty() && std::isnan(outcome.value.number) ? "no sample" : value_text(outcome);
}

// Of the seeds' worst runs, by how far they are from the bound.
static void rank_seeds(Verdict &verdict, const std::map<std::string, Outcome> &worst_of_seed)
{
    std::vector<Outcome> ranked;
    ranked.reserve(worst_of_seed.size());
    for (const auto &entry : worst_of_seed) {
        ranked.push_back(entry.second);
    }
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const Outcome &a, const Outcome &b) { return a.margin < b.margin; });
    verdict.seeds = ranked.size();
    verdict.median = ranked[ranked.size() / 2];
    verdict.best = ranked.back();
}

static std::string json_value(const Outcome &outcome)
{
    return outcome.value.text.empty() ? json_number(outcome.value.number) : json_text(outcome.value.text);
}

std::vector<Verdict> verdicts(const ScenarioFile &file, const SweepResult &result)
{
    std::vector<Verdict> list;
    std::vector<std::map<std::string, Outcome>> worst_of_seed;
    for (size_t run = 0; run < result.runs.size(); ++run) {
        const std::vector<Expectation> expect = file.scenario(file.runs()[run]).expect;
        list.resize(expect.size());
        worst_of_seed.resize(expect.size());
        for (size_t i = 0; i < expect.size(); ++i) {
            const Outcome &outcome = result.runs[run].outcomes[i];
            Verdict &verdict = list[i];
            if (verdict.runs == 0 || outcome.margin < verdict.worst.margin) {
                verdict.expectation = expect[i];
                verdict.worst = outcome;
                verdict.worst_run = run;
            }
            verdict.passed += outcome.pass ? 1 : 0;
            verdict.runs++;
            const Variables &variables = file.runs()[run].variables;
            const auto seed = variables.find("seed");
            const auto [known, is_new] =
                worst_of_seed[i].try_emplace(seed != variables.end() ? seed->second : "", outcome);
            if (!is_new && outcome.margin < known->second.margin) {
                known->second = outcome;
            }
        }
    }
    for (size_t i = 0; i < list.size(); ++i) {
        rank_seeds(list[i], worst_of_seed[i]);
    }
    return list;
}

bool all_pass(const std::vector<Verdict> &list)
{
    for (const Verdict &verdict : list) {
        if (verdict.passed != verdict.runs) {
            return false;
        }
    }
    return true;
}

size_t worst_run(const std::vector<Verdict> &list)
{
    const Verdict *worst = nullptr;
    for (const Verdict &verdict : list) {
        const bool first_failed = verdict.passed != verdict.runs;
        if (worst == nullptr || first_failed || verdict.worst.margin < worst->worst.margin) {
            worst = &verdict;
        }
        if (first_failed) {
            break;
        }
    }
    return worst != nullptr ? worst->worst_run : 0;
}

std::string verdict_lines(const ScenarioFile &file, const std::vector<Verdict> &list)
{
    size_t width = 0;
    for (const Verdict &verdict : list) {
        width = std::max(width, verdict.expectation.label.size());
    }
    std::string text;
    for (const Verdict &verdict : list) {
        const Expectation &e = verdict.expectation;
        char line[512];
        std::snprintf(line, sizeof line, "%s  %-*s  %9s  %s%s%s  (%s)",
                      verdict.passed == verdict.runs ? "PASS" : "FAIL", static_cast<int>(width),
                      e.label.c_str(), shown(verdict.worst).c_str(), bound_text(e).c_str(),
                      e.unit.empty() || e.unit == "1" ? "" : " ", e.unit == "1" ? "" : e.unit.c_str(),
                      e.book.c_str());
        text += line;
        if (file.runs().size() > 1) {
            text += "  " + std::to_string(verdict.passed) + " of " + std::to_string(verdict.runs) +
                    ", worst: " + file.runs()[verdict.worst_run].name;
        }
        if (verdict.seeds > 1) {
            text += "; median of " + std::to_string(verdict.seeds) + " seeds " + shown(verdict.median);
        }
        text += '\n';
    }
    return text;
}

std::string verdict_json(const ScenarioFile &file, const std::vector<Verdict> &list, double simulated_s,
                         double wall_s)
{
    std::string text = "{\"title\": " + json_text(file.title()) +
                       ", \"pass\": " + (all_pass(list) ? "true" : "false") +
                       ", \"runs\": " + std::to_string(file.runs().size()) +
                       ", \"simulated_s\": " + json_number(simulated_s) +
                       ", \"wall_s\": " + json_number(wall_s) + ", \"expectations\": [";
    const char *separator = "\n";
    for (const Verdict &verdict : list) {
        const Expectation &e = verdict.expectation;
        text += separator;
        text += "  {\"name\": " + json_text(e.label) + ", \"metric\": " + json_text(e.metric) +
                ", \"pass\": " + (verdict.passed == verdict.runs ? "true" : "false") +
                ", \"value\": " + json_value(verdict.worst) + ", \"median\": " + json_value(verdict.median) +
                ", \"best\": " + json_value(verdict.best) + ", \"seeds\": " + std::to_string(verdict.seeds) +
                ", \"bound\": " + json_text(bound_text(e)) + ", \"unit\": " + json_text(e.unit) +
                ", \"book\": " + json_text(e.book) + ", \"passed\": " + std::to_string(verdict.passed) +
                ", \"of\": " + std::to_string(verdict.runs) +
                ", \"worst_run\": " + json_text(file.runs()[verdict.worst_run].name) + "}";
        separator = ",\n";
    }
    return text + "\n]}\n";
}

static std::string csv_text(const std::string &text)
{
    if (text.find_first_of(",\"") == std::string::npos) {
        return text;
    }
    std::string quoted = "\"";
    for (const char c : text) {
        quoted += c == '"' ? "\"\"" : std::string(1, c);
    }
    return quoted + '"';
}

std::string runs_csv(const ScenarioFile &file, const SweepResult &result)
{
    std::string text = "run";
    for (const auto &entry : file.runs().front().variables) {
        text += "," + entry.first;
    }
    const Scenario first = file.scenario(file.runs().front());
    for (const Expectation &expectation : first.expect) {
        text += ",\"" + expectation.label + "\",pass";
    }
    text += '\n';
    for (size_t run = 0; run < result.runs.size(); ++run) {
        text += std::to_string(run);
        for (const auto &entry : file.runs()[run].variables) {
            text += ',' + csv_text(entry.second);
        }
        for (const Outcome &outcome : result.runs[run].outcomes) {
            text += "," + value_text(outcome) + (outcome.pass ? ",1" : ",0");
        }
        text += '\n';
    }
    return text;
}

} // namespace pmsim
