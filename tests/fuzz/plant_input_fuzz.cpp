// The CSV of `pmsim plant MACHINE --input FILE`, for a machine with three legs and one with six.
#include "tests/fuzz/exercise.h"
#include "tools/pmsim/plant_run.h"
#include "tools/pmsim/scenario_file.h"

// The time to integrate grows with the duration, and with the voltage and speed that a row may ask for.
static bool is_short(const pmsim::Csv &input)
{
    const double most_s = 1e-3;
    const std::vector<double> &t_s = input.column("t_s");
    return input.rows() <= 50 && t_s.back() - t_s.front() <= most_s;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const pmsim::PlantFile machines[] = {pmsim::load_plant_file("sim_plant/machines/spm_400.yaml", {}),
                                                pmsim::load_plant_file("sim_plant/machines/ow_400.yaml", {})};
    const std::string text = fuzz::text_of(data, size);
    for (const pmsim::PlantFile &machine : machines) {
        try {
            const pmsim::Csv input = pmsim::read_plant_input(text, "input.csv", machine.setup);
            if (is_short(input)) {
                pmsim::run_plant(machine, input);
            }
        } catch (const pmsim::InputError &) {
        }
    }
    return 0;
}
