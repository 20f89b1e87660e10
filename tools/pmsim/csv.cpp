#include "tools/pmsim/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

#include "tools/pmsim/input_files.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const char byte_order_mark[] = "\xef\xbb\xbf"; // spreadsheets write it

bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

// Shown in a message: control characters and endless lines do not belong on a terminal.
std::string quoted(const std::string &word)
{
    const size_t most = 40;
    return json_text(word.size() > most ? word.substr(0, most) + "..." : word);
}

double read_number(const char *first, const char *last, const Place &place, const std::string &column)
{
    while (first < last && is_blank(*first)) {
        ++first;
    }
    while (last > first && is_blank(last[-1])) {
        --last;
    }
    const std::string word(first, last);
    if (last - first > 1 && first[0] == '+' && first[1] != '-') {
        ++first;
    }
    double value = 0.0;
    const auto result = std::from_chars(first, last, value);
    if (first == last || result.ptr != last) {
        throw InputError(place, "expected a number for " + column + ", found " + quoted(word));
    }
    if (result.ec != std::errc() || !std::isfinite(value)) {
        throw InputError(place, quoted(word) + " for " + column + " is not a finite number");
    }
    return value;
}

} // namespace

Csv::Csv(std::string file) : file_(std::move(file))
{
}

Csv Csv::from_text(const std::string &text, const std::string &name, const CsvColumns &known)
{
    Csv csv(name);
    csv.read(text, known);
    return csv;
}

Csv Csv::from_file(const std::string &path, const CsvColumns &known)
{
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    if (!in || !(text << in.rdbuf())) { // a directory opens but cannot be read, and an empty file too
        throw InputError(path + ": cannot be read, or is empty");
    }
    note_input(path);
    return from_text(text.str(), path, known);
}

void Csv::read(const std::string &text, const CsvColumns &known)
{
    size_t at = text.compare(0, 3, byte_order_mark) == 0 ? 3 : 0;
    int number = 0;
    while (at < text.size()) {
        const size_t end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        at = end + 1;
        ++number;
        if (line[0] == '#' || std::all_of(line.begin(), line.end(), is_blank)) {
            continue;
        }
        if (names_.empty()) {
            read_header(line, number, known);
        } else {
            read_row(line, number);
        }
    }
    if (lines_.empty()) {
        throw InputError(file_ + ": " + (names_.empty() ? "there is no header line" : "there are no rows"));
    }
}

void Csv::read_header(const std::string &line, int number, const CsvColumns &known)
{
    const Place place{file_, number, 0};
    std::vector<std::string> all = known.required;
    all.insert(all.end(), known.optional.begin(), known.optional.end());
    for (const std::string &part : split(line, ',')) {
        const std::string name = trim(part.substr(0, part.find('\r')));
        if (std::find(all.begin(), all.end(), name) == all.end()) {
            throw InputError(place, name.find(';') != std::string::npos
                                        ? "columns are separated by commas, not by semicolons"
                                        : unknown("column", name.substr(0, 40), all));
        }
        if (has(name)) {
            throw InputError(place, "column \"" + name + "\" stands here a second time");
        }
        names_.push_back(name);
    }
    for (const std::string &name : known.required) {
        if (!has(name)) {
            throw InputError(place, "column \"" + name + "\" is missing");
        }
    }
    columns_.resize(names_.size());
}

void Csv::read_row(const std::string &line, int number)
{
    const Place place{file_, number, 0};
    const size_t count = 1 + static_cast<size_t>(std::count(line.begin(), line.end(), ','));
    if (count != names_.size()) {
        throw InputError(place, "expected " + std::to_string(names_.size()) + " values, found " +
                                    std::to_string(count));
    }
    const char *first = line.data(), *const end = first + line.size();
    for (size_t column = 0; column < count; ++column) {
        const char *last = std::find(first, end, ',');
        columns_[column].push_back(read_number(first, last, place, names_[column]));
        first = last + 1;
    }
    lines_.push_back(number);
}

size_t Csv::rows() const
{
    return lines_.size();
}

bool Csv::has(const std::string &name) const
{
    return std::find(names_.begin(), names_.end(), name) != names_.end();
}

const std::vector<double> &Csv::column(const std::string &name) const
{
    const auto found = std::find(names_.begin(), names_.end(), name);
    return columns_.at(static_cast<size_t>(found - names_.begin()));
}

int Csv::line(size_t row) const
{
    return lines_.at(row);
}

const std::string &Csv::file() const
{
    return file_;
}

void Csv::fail(size_t row, const std::string &reason) const
{
    throw InputError(Place{file_, line(row), 0}, reason);
}

} // namespace pmsim
