// Tables of numbers: a header line with column names that end in their unit, then one row per line.
//
// Comma-separated, decimal point, columns in any order; empty lines and lines that begin with # are skipped.
// Refused, as "file:line: reason": an unknown column (nearest name, "wrong unit"), one that is missing or
// stands twice, a row with another number of values, a value that is no finite number, a table without rows.
// Cost: about 50 ns a value. Tests: tests/unit/pmsim/csv_test.cpp.
#ifndef PMSIM_CSV_H
#define PMSIM_CSV_H

#include <string>
#include <vector>

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

struct CsvColumns {
    std::vector<std::string> required, optional;
};

class Csv
{
  public:
    static Csv from_file(const std::string &path, const CsvColumns &known);
    static Csv from_text(const std::string &text, const std::string &name, const CsvColumns &known);

    size_t rows() const;
    bool has(const std::string &name) const;
    const std::vector<double> &column(const std::string &name) const; // one that has(name)
    int line(size_t row) const;                                       // from 1
    const std::string &file() const;
    [[noreturn]] void fail(size_t row, const std::string &reason) const; // "file:line: reason"

  private:
    explicit Csv(std::string file);
    void read(const std::string &text, const CsvColumns &known);
    void read_header(const std::string &line, int number, const CsvColumns &known);
    void read_row(const std::string &line, int number);

    std::string file_;
    std::vector<std::string> names_;
    std::vector<std::vector<double>> columns_; // as names_
    std::vector<int> lines_;                   // of the rows
};

} // namespace pmsim

#endif
