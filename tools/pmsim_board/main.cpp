// pmsim-board: scenarios on the emulated board. `pmsim board` starts it. Linked with libunicorn, which is
// GPL-2.
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <map>

#include "sim_plant/board/board.h"
#include "tools/pmsim/command_line.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/node_command.h"
#include "tools/pmsim/run_command.h"
#include "tools/pmsim/similarity.h"
#include "tools/pmsim/yaml_reader.h"
#include "tools/pmsim_board/console.h"
#include "tools/pmsim_board/figures_report.h"
#include "tools/pmsim_board/rig_board.h"

namespace
{

using namespace pmsim;

struct BoardOptions {
    std::string image, figures, last;
    std::vector<std::string> limits;
    int load = BUS_QUIET; // a bus_noise_kind_t
    double console_s = 0.0;
    int gdb_port = -1;
    bool busy = false, similar = false, terminals = false;
};

// NAME=MOST: a line like those of the expectations. Returns whether it holds.
bool check_limit(const std::string &limit, const figures_t &figures)
{
    const size_t equals = limit.find('=');
    if (equals == std::string::npos) {
        throw InputError("--limit " + limit + ": NAME=NUMBER is wanted");
    }
    const std::string name = limit.substr(0, equals);
    size_t used = 0;
    double most = 0.0;
    try {
        most = std::stod(limit.substr(equals + 1), &used);
    } catch (const std::exception &) {
        used = 0;
    }
    if (used == 0 || used != limit.size() - equals - 1) {
        throw InputError("--limit " + limit + ": not a number");
    }
    std::string known;
    for (const auto &[found, value] : figure_values(figures)) {
        if (found == name) {
            std::printf("%s  %-36s %9.1f  <= %g\n", value <= most ? "PASS" : "FAIL", name.c_str(), value,
                        most);
            return value <= most;
        }
        known += " " + found;
    }
    throw InputError("--limit " + limit + ": no such figure in this run; there are:" + known);
}

int run(RunOptions options, const BoardOptions &board, NodeOptions node)
{
    if (board.console_s > 0.0) {
        return board_show_console(board.image.c_str(), board.console_s,
                                  board.last.empty() ? nullptr : board.last.c_str(), board.terminals);
    }
    if (options.scenario.empty()) {
        throw InputError("a scenario is wanted, or --console SECONDS");
    }
    note_input(board.image);
    if (!board.figures.empty()) {
        refuse_input_as_output(board.figures); // before the work, so that it is not lost
    }
    rig_board_image(board.image.c_str(), !node.can.empty());
    rig_board_bus_load(static_cast<bus_noise_kind_t>(board.load));
    if (board.busy) {
        rig_board_busy();
    }
    use_board({BOARD_I_FULL_SCALE_A, BOARD_V_FULL_SCALE_V, BOARD_SETTLE_S, board.similar});
    if (board.similar) {
        rig_board_similar();
    }
    if (board.gdb_port >= 0) {
        rig_board_gdb(static_cast<uint16_t>(board.gdb_port));
        options.jobs = 1;
    }
    node.scenario = options.scenario;
    node.settings = options.settings;
    node.quiet = options.quiet;
    int code = node.can.empty() ? run_and_report(options) : run_node(node);
    const figures_t figures = all_figures();
    if (!options.quiet && !options.json) {
        std::cout << figure_table(figures);
    }
    if (!board.figures.empty()) {
        refuse_input_as_output(board.figures);
        std::ofstream file(board.figures);
        file << figure_json(figures);
        if (!file.flush()) {
            throw InputError(board.figures + ": cannot be written");
        }
    }
    for (const std::string &limit : board.limits) {
        code = check_limit(limit, figures) ? code : 1;
    }
    return code;
}

} // namespace

int main(int argc, char **argv)
{
    CommandLine app(
        "pmsim board: the flashed image, unmodified, on an emulated drive board closed on the plant.");
    app.name("pmsim board");
    RunOptions options;
    BoardOptions board;
    NodeOptions node;
    app.add_option("image", board.image, "image (ELF), e.g. out/build/stm32g431/pmdrive.elf")->required();
    add_run_options(app, options);
    app.get_option("scenario")->required(false);
    app.add_option(
        "--console", board.console_s,
        "no scenario: run the image for so many seconds and print what its UART says; exit 1 when a line "
        "begins with FAIL");
    app.add_option("--until", board.last, "with --console: end at a line that begins with this");
    app.add_flag("--terminals", board.terminals,
                 "with --console: the dividers of the terminals are in place");
    app.add_option("--gdb", board.gdb_port,
                   "wait for gdb on this port of this machine (0: a free one) before the first instruction; "
                   "time stands while it has stopped the processor")
        ->range(0, 65535)
        ->excludes("--console");
    add_node_options(app, node);
    app.add_option("--bus-load", board.load,
                   "other nodes that fill the bus, at 1 Mbit/s: babble (shortest frames) or garbage (any)")
        ->words({{"babble", BUS_BABBLE}, {"garbage", BUS_GARBAGE}});
    app.add_flag(
        "--busy", board.busy,
        "beside the scenario, the bus keeps the image busy: a trace of eight signals in every period, "
        "armed again and again, and a parameter written now and then");
    app.add_flag("--similar", board.similar,
                 "the machine, its inverter and its load wound again for the board, whose converters see 60 "
                 "A and 34 V: the "
                 "same in per unit; values in the scenario with them");
    app.add_option("--figures", board.figures,
                   "write instructions, cycles, stack and load to this file (JSON)");
    app.add_option("--limit", board.limits,
                   "NAME=MOST of a figure, e.g. control.flux.mean=420; exit 1 above it")
        ->one_each();
    app.footer(
        "Prints the expectations of the scenario as `pmsim run` does, then what the processor did: "
        "instructions are\n"
        "counted, cycles estimated (docs/emulator.md). After each interrupt the drive's memory is compared, "
        "bit for\n"
        "bit, with the same code on the host.\n"
        "Exit code: 0 all pass, 1 an expectation or a limit fails, 2 bad input or the image has failed.\n\n"
        "With --can it is a live node, as `pmsim node`; commands then come over the bus alone, and the "
        "figures at its end.\n\n"
        "Examples:\n"
        "  pmsim board out/build/stm32g431/pmdrive.elf tests/scenario/demo.yaml --out out/board\n"
        "  pmsim board out/build/stm32g431/pmdrive.elf tests/scenario/node.yaml --can vcan0");
    try {
        const std::optional<int> code = app.parse(argc, argv);
        return finish(code ? *code : run(options, board, node));
    } catch (const std::exception &error) {
        std::cerr << "pmsim board: " << error.what() << '\n';
        return 2;
    }
}
