// The section flux_map with formulas. Tables are another target's: here a path would be any file's.
#include "tests/fuzz/exercise.h"
#include "tools/pmsim/flux_map.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try {
        const pmsim::Value section = pmsim::Value::from_text(fuzz::text_of(data, size), "machine.yaml");
        if (!pmsim::Map(section).has("table")) {
            pmsim::read_flux_map(section);
        }
    } catch (const pmsim::InputError &) {
    }
    return 0;
}
