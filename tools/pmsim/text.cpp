#include "tools/pmsim/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace pmsim
{

std::vector<std::string> split(const std::string &text, char separator)
{
    std::vector<std::string> parts;
    std::string part;
    std::istringstream in(text);
    while (std::getline(in, part, separator)) {
        parts.push_back(part);
    }
    if (text.empty() || text.back() == separator) {
        parts.emplace_back();
    }
    return parts;
}

std::string trim(const std::string &text)
{
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string::npos) {
        return "";
    }
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string join(const std::vector<std::string> &words, const std::string &separator)
{
    std::string text;
    for (const std::string &word : words) {
        text += (text.empty() ? "" : separator) + word;
    }
    return text;
}

std::string format(double value, int digits)
{
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
}

std::string json_text(const std::string &text)
{
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            char code[8];
            std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
            out += code;
        } else {
            out += c;
        }
    }
    return out + "\"";
}

std::string json_number(double value)
{
    return std::isfinite(value) ? format(value, 9) : "null";
}

static size_t edit_distance(const std::string &a, const std::string &b)
{
    std::vector<size_t> row(b.size() + 1);
    for (size_t j = 0; j < row.size(); ++j) {
        row[j] = j;
    }
    for (size_t i = 1; i <= a.size(); ++i) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            const size_t replace = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({replace, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row[b.size()];
}

// What a key may end with; longer units first where one ends with another.
static const char *const units[] = {
    "_A_Wb5", "_rad_s2", "_rad_s", "_kgm2", "_gcm2", "_kgcm2", "_mohm", "_ohm", "_mWb", "_Wb",   "_mNm",
    "_Nms",   "_Nm",     "_kHz",   "_Hz",   "_mH",   "_uH",    "_H",    "_mA",  "_A",   "_mV",   "_kV",
    "_V",     "_ms",     "_us",    "_ns",   "_s",    "_uF",    "_mF",   "_F",   "_nF",  "_pF",   "_mVs",
    "_Vs",    "_1_K",    "_degC",  "_K",    "_deg",  "_rad",   "_rpm",  "_rel", "_lsb", "_Nms2",
};

// The name without its unit.
static std::string stem(const std::string &key)
{
    for (const std::string unit : units) {
        const bool longer = key.size() > unit.size();
        if (longer && key.compare(key.size() - unit.size(), unit.size(), unit) == 0) {
            return key.substr(0, key.size() - unit.size());
        }
    }
    return key;
}

static std::optional<std::string> same_but_unit(const std::string &word,
                                                const std::vector<std::string> &known)
{
    for (const std::string &key : known) {
        if (stem(key) != key && (stem(key) == stem(word) || stem(key) == word)) {
            return key;
        }
    }
    return std::nullopt;
}

std::optional<std::string> nearest(const std::string &word, const std::vector<std::string> &known)
{
    std::optional<std::string> best = same_but_unit(word, known);
    if (best) {
        return best;
    }
    size_t limit = std::max<size_t>(1, (word.size() + 2) / 3);
    for (const std::string &key : known) {
        const size_t distance = edit_distance(word, key);
        if (distance <= limit && distance < key.size()) {
            best = key;
            limit = distance == 0 ? 0 : distance - 1;
        }
    }
    return best;
}

std::string did_you_mean(const std::optional<std::string> &word)
{
    return word ? "; did you mean \"" + *word + "\"?" : "";
}

std::string unknown(const std::string &what, const std::string &word, const std::vector<std::string> &known)
{
    std::string text = "unknown " + what + " \"" + word + "\"";
    if (same_but_unit(word, known)) {
        text += ": wrong unit";
    }
    const auto near = nearest(word, known);
    return text + (near ? did_you_mean(near) : "; known: " + join(known, ", "));
}

} // namespace pmsim
