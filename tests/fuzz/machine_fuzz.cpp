// Machine files: `pmsim plant FILE`.
#include "tests/fuzz/exercise.h"
#include "tools/pmsim/scenario_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try {
        const pmsim::Value document = pmsim::Value::from_text(fuzz::text_of(data, size), "machine.yaml");
        if (!pmsim::Map(document).has("machine")) { // a scenario has its own target
            const pmsim::PlantFile file = pmsim::read_plant_file(document);
            fuzz::exercise(file.setup, 0.5);
        }
    } catch (const pmsim::InputError &) { // how a file is refused; any other exception is a finding
    }
    return 0;
}
