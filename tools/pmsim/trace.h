// trace.csv: truth beside estimates, SI units in the column names. Columns: docs/pmsim.md.
#ifndef PMSIM_TRACE_H
#define PMSIM_TRACE_H

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "tools/pmsim/metrics.h"

namespace pmsim
{

class TraceWriter
{
  public:
    // One row every `decimate` periods; 0: as many as give at most 20000 rows.
    TraceWriter(const std::string &path, const Scenario &scenario, uint64_t decimate);
    void add(const Sample &sample);
    void close(); // throws when the file could not be written

  private:
    struct Closer {
        void operator()(std::FILE *file) const
        {
            std::fclose(file);
        }
    };

    std::string path_;
    plant_mech_t mech_;
    double pole_pairs_;
    std::unique_ptr<std::FILE, Closer> file_;
    uint64_t decimate_, count_ = 0;
};

} // namespace pmsim

#endif
