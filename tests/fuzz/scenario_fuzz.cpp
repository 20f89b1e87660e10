// Scenarios: `pmsim run FILE` and `pmsim plant FILE`. A machine is named as in tests/scenario.
#include "tests/fuzz/exercise.h"
#include "tools/pmsim/scenario_file.h"

// As `pmsim run` does, but for the run itself.
static void read_runs(const pmsim::Value &document)
{
    const size_t most = 3;
    const pmsim::ScenarioFile file(document, {});
    file.title();
    for (size_t k = 0; k < file.runs().size() && k < most; ++k) {
        file.scenario(file.runs()[k]);
    }
}

static void read_plant(const pmsim::Value &document)
{
    const pmsim::PlantFile file = pmsim::read_plant_file(document);
    fuzz::exercise(file.setup, file.theta_e_rad);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    for (const auto read : {read_runs, read_plant}) {
        try {
            read(pmsim::Value::from_text(fuzz::text_of(data, size), "tests/scenario/scenario.yaml"));
        } catch (const pmsim::InputError &) {
        }
    }
    return 0;
}
