// Small text helpers shared by the readers and the reports.
#ifndef PMSIM_TEXT_H
#define PMSIM_TEXT_H

#include <optional>
#include <string>
#include <vector>

namespace pmsim
{

std::vector<std::string> split(const std::string &text, char separator);
std::string trim(const std::string &text);
std::string join(const std::vector<std::string> &words, const std::string &separator);
std::string format(double value, int digits = 6); // shortest at this many significant digits
std::string json_text(const std::string &text);   // quoted
std::string json_number(double value);            // null when not finite

std::optional<std::string> nearest(const std::string &word, const std::vector<std::string> &known);
std::string did_you_mean(const std::optional<std::string> &word); // "" or "; did you mean ...?"

// "unknown key "R_s_mohm": wrong unit; did you mean "R_s_ohm"?"
std::string unknown(const std::string &what, const std::string &word, const std::vector<std::string> &known);

} // namespace pmsim

#endif
