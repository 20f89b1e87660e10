#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/commands.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/plant_run.h"
#include "tools/pmsim/settings_option.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

namespace fs = std::filesystem;

struct Options {
    std::string machine, input, out;
    std::vector<std::string> floating, settings;
};

// A line on a terminal, ten times a second, once the run has taken two seconds.
class ProgressLine
{
  public:
    ~ProgressLine()
    {
        if (shown_) {
            std::fprintf(stderr, "\r%40s\r", "");
        }
    }

    void show(double fraction)
    {
        const auto now = Clock::now();
        if (now < next_) {
            return;
        }
        next_ = now + std::chrono::milliseconds(100);
        shown_ = true;
        std::fprintf(stderr, "\rpmsim plant: %3.0f %% ", 100.0 * fraction);
        std::fflush(stderr);
    }

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point next_ = Clock::now() + std::chrono::seconds(2);
    bool shown_ = false;
};

// Before the work, so that it is not lost.
void check_out(const Options &options)
{
    const fs::path out = options.out;
    std::error_code none;
    if (fs::is_directory(out, none) ||
        (out.has_parent_path() && !fs::is_directory(out.parent_path(), none))) {
        throw InputError(options.out + ": cannot be written: " +
                         (fs::is_directory(out, none) ? "it is a folder" : "there is no such folder"));
    }
    refuse_input_as_output(options.out);
}

void write_all(const std::string &path, const std::string &text)
{
    std::ofstream file(path, std::ios::binary);
    if (file) {
        file << text;
        if (file.flush()) {
            return;
        }
        if (fs::is_regular_file(path)) {
            fs::remove(path); // half a table would look like a whole one
        }
    }
    throw InputError(path + ": cannot be written");
}

// Without the drive its parameters do nothing.
void refuse_parameters(const Settings &settings, const Value &document)
{
    const std::vector<std::string> variables = variable_names(Map(document));
    for (const auto &[name, value] : settings) {
        const std::string parameter = name.rfind("drive.", 0) == 0 ? name.substr(6) : name;
        if (find_parameter(parameter) &&
            std::find(variables.begin(), variables.end(), name) == variables.end()) {
            throw InputError("--set " + name + ": a parameter of the drive has no effect on the plant alone" +
                             did_you_mean(nearest_key(parameter)));
        }
    }
}

void run(const Options &options)
{
    const Settings settings = parse_settings(options.settings);
    const Value document = Value::from_file(options.machine);
    refuse_parameters(settings, document);
    const PlantFile file = read_plant_file(document, settings);
    const unsigned floating = floating_legs(options.floating, file.setup);
    const Csv input = load_plant_input(options.input, file.setup, floating);
    check_out(options);
    PlantOutput output;
    if (isatty(STDERR_FILENO) != 0) {
        ProgressLine line;
        output = run_plant(
            file, input, [&line](double fraction) { line.show(fraction); }, floating);
    } else {
        output = run_plant(file, input, nullptr, floating);
    }
    write_all(options.out, output.csv);
    print_notes(file.setup);
    print_note(output.note);
}

} // namespace

void add_plant_command(Command &app)
{
    Command *command = app.add_subcommand(
        "plant", "Run a machine alone, on given phase voltages (no firmware, no inverter)");
    auto options = std::make_shared<Options>();
    command
        ->add_option("machine", options->machine,
                     "machine file, or any YAML with `machine:`, sections over it and `start: {theta_e_deg}`")
        ->required();
    command->add_option("--input", options->input, "CSV file: what is applied")->required();
    command->add_option("--out", options->out, "CSV file to write: what the machine does")->required();
    command
        ->add_option("--float", options->floating,
                     "a terminal that is off while the others are fed: a, b, c, x, y or z; once for each")
        ->one_each();
    command->add_option("--set", options->settings, settings_help())->one_each();
    command->footer(
        "Input columns, in any order: t_s, va_V, vb_V, vc_V, held from each row to the next (two sets and\n"
        "open windings also vx_V, vy_V, vz_V); optional load_Nm, held too, and omega_mech_rad_s, a speed "
        "that\n"
        "is imposed and moves linearly from row to row.\n"
        "Output, one row for each input row, the state at its time: t_s, ia_A, ib_A, ic_A (ix_A, iy_A, "
        "iz_A),\n"
        "theta_e_rad, omega_mech_rad_s, torque_Nm, psi_d_Vs, psi_q_Vs, v_neutral_V (of two sets "
        "v_neutral_abc_V,\n"
        "v_neutral_xyz_V): star point against the mean of its terminals; then the voltages of terminals "
        "that\n"
        "float, which need none in the input.\n"
        "Starts without current, at rest or at the imposed speed, with theta_e = 0 unless `start` says\n"
        "otherwise; the last row's voltages have no effect. 1 s in 100 us rows takes about 0.1 s; progress "
        "is\n"
        "shown after 2 s. On an error nothing is written and the exit code is 2.\n\n"
        "Example:\n"
        "  printf 't_s,va_V,vb_V,vc_V\\n0,0,9,0\\n1e-4,0,9,0\\n2e-4,0,0,0\\n3e-4,0,0,0\\n' > in.csv\n"
        "  pmsim plant sim_plant/machines/teknic_m2310p.yaml --input in.csv --out out.csv\n"
        "File formats: docs/pmsim.md");
    command->callback([options] { run(*options); });
}

} // namespace pmsim
