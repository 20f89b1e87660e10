// Writes and reads recorded control periods; the format is in record.h.
#ifndef PMSIM_RECORD_FILE_H
#define PMSIM_RECORD_FILE_H

#include <string>
#include <vector>

#include "tools/pmsim/scenario.h"

extern "C" {
#include "tools/pmsim/record.h"
}

namespace pmsim
{

struct Recording {
    Parameters params;
    uint32_t slow_divider = 0;
    std::vector<record_period_t> periods;
};

Recording record_scenario(const Scenario &scenario, uint64_t most_periods);
void write_recording(const Recording &recording, const std::string &path);

} // namespace pmsim

#endif
