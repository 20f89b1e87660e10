// Flux-map CSV: as it is, and as one half of a symmetrical map. A map that is accepted must make a plant.
#include <fstream>

#include <unistd.h>

#include "tests/fuzz/exercise.h"
#include "tools/pmsim/flux_map.h"

// The reader takes a path: a file of this process, in memory where there is such a folder.
static std::string write_file(const uint8_t *data, size_t size)
{
    static const std::string path = [] {
        const std::string folder = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp";
        return folder + "/pm_fuzz_" + std::to_string(getpid()) + ".csv";
    }();
    std::ofstream(path, std::ios::binary) << fuzz::text_of(data, size);
    return path;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const std::string path = write_file(data, size);
    for (const char *mirror : {"false", "true"}) {
        const std::string machine = "name: table\nflux_map: {table: " + path + ", mirror_q: " + mirror +
                                    "}\nelectrical: {R_s_ohm: 1, pole_pairs: 2}\nmechanics: {J_kgm2: 1e-3}\n";
        try {
            fuzz::exercise(pmsim::read_machine(pmsim::Value::from_text(machine, "/machine.yaml")), 0.5);
        } catch (const pmsim::InputError &) {
        }
    }
    unlink(path.c_str());
    return 0;
}
