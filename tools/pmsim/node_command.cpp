#include "tools/pmsim/node_command.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>

#include "tools/pmsim/loop.h"
#include "tools/pmsim/names.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/settings_option.h"

extern "C" {
#include "hal/linux/can_link.h"
#include "hal/linux/gpio_line.h"
}

namespace pmsim
{
namespace
{

using Clock = std::chrono::steady_clock;

constexpr double slice_s = 1e-3; // between two looks at the bus and the clock
constexpr double behind_s = 0.2; // so late the simulation gives up catching up, and says so

volatile std::sig_atomic_t interrupted = 0;

void interrupt(int)
{
    interrupted = 1;
}

template <typename T> using Owned = std::unique_ptr<T, void (*)(T *)>;

Owned<can_link_t> open_link(const std::string &name)
{
    char error[200];
    Owned<can_link_t> link(can_link_open(name.c_str(), error, sizeof error), &can_link_close);
    if (!link) {
        throw InputError(error);
    }
    return link;
}

Owned<gpio_line_t> open_line(const std::string &name, gpio_use_t use)
{
    char error[200] = "";
    Owned<gpio_line_t> line(name.empty() ? nullptr : gpio_line_open(name.c_str(), use, error, sizeof error),
                            &gpio_line_close);
    if (!line && !name.empty()) {
        throw InputError(error);
    }
    return line;
}

// The bridge is held off while the enable line is low, and from an edge of the fault line until the enable
// line has been low once more, or for good without one.
class Lines
{
  public:
    explicit Lines(const NodeOptions &options)
        : enable_(open_line(options.gpio_enable, GPIO_INPUT)),
          fault_(open_line(options.gpio_fault, GPIO_EDGES))
    {
    }

    bool hold_off()
    {
        const bool enabled =
            !enable_ || gpio_line_get(enable_.get()) == 1; // a line that fails is not enabled
        if (fault_ && gpio_line_edges(fault_.get()) != 0) {
            faulted_ = true;
        }
        if (enable_ && !enabled) {
            faulted_ = false;
        }
        return !enabled || faulted_;
    }

  private:
    Owned<gpio_line_t> enable_, fault_;
    bool faulted_ = false;
};

class Node
{
  public:
    Node(const Scenario &scenario, const NodeOptions &options)
        : loop_(scenario), link_(open_link(options.can)), lines_(options),
          period_s_(1.0 / scenario.setup.plant.inverter.f_pwm_Hz)
    {
    }

    const char *where() const
    {
        return can_link_where(link_.get());
    }

    // One slice of simulated time, between two exchanges of frames.
    const Sample &advance()
    {
        take_frames();
        rig_set_can_state(loop_.rig(), can_link_state(link_.get()));
        const bool hold = lines_.hold_off();
        if (hold != held_) {
            rig_set_hw_fault(loop_.rig(), hold);
            held_ = hold;
        }
        const Sample *sample = nullptr;
        for (double passed_s = 0.0; passed_s < slice_s - 0.5 * period_s_; passed_s += period_s_) {
            sample = &loop_.step();
            give_frames();
        }
        return *sample;
    }

  private:
    void take_frames()
    {
        if (!waiting_) {
            waiting_ = can_link_receive(link_.get(), &frame_);
        }
        while (waiting_ && rig_send(loop_.rig(), &frame_)) {
            waiting_ = can_link_receive(link_.get(), &frame_);
        }
    }

    void give_frames()
    {
        hal_can_frame_t frame;
        while (rig_receive(loop_.rig(), &frame)) {
            can_link_send(link_.get(), &frame);
        }
    }

    Loop loop_;
    Owned<can_link_t> link_;
    Lines lines_;
    double period_s_;
    hal_can_frame_t frame_{}; // has come, but the drive's ring was full
    bool waiting_ = false, held_ = false;
};

void show(double t_s, const Sample &sample)
{
    std::printf("\r%8.1f s  %-12s %9.2f rad/s  %8.3f Nm  fault %-3d", t_s,
                name_of(state_names(), sample.rig.state).c_str(), sample.rig.truth.omega_mech_rad_s,
                sample.rig.truth.torque_Nm, sample.rig.fault);
    std::fflush(stdout);
}

} // namespace

int run_node(const NodeOptions &options)
{
    const ScenarioFile file(options.scenario, parse_settings(options.settings));
    const Scenario scenario = file.scenario(file.runs().front());
    print_notes(scenario.setup);
    Node node(scenario, options);
    std::printf("node on %s; Ctrl-C ends\n", node.where());
    std::fflush(stdout);
    std::signal(SIGINT, interrupt);
    std::signal(SIGTERM, interrupt);

    Clock::time_point start = Clock::now();
    double t_s = 0.0, origin_s = 0.0, shown_s = 0.0;
    while (interrupted == 0 && (options.duration_s == 0.0 || t_s < options.duration_s)) {
        const Sample &sample = node.advance();
        t_s += slice_s;
        const double wall_s = origin_s + std::chrono::duration<double>(Clock::now() - start).count();
        if (wall_s > t_s + behind_s) {
            std::fprintf(stderr, "\npmsim node: %.2f s behind real time, going on from here\n", wall_s - t_s);
            start = Clock::now();
            origin_s = t_s;
        } else if (wall_s < t_s) {
            std::this_thread::sleep_for(std::chrono::duration<double>(t_s - wall_s));
        }
        if (!options.quiet && t_s >= shown_s) {
            show(t_s, sample);
            shown_s = t_s + 0.2;
        }
    }
    std::printf("\n");
    return 0;
}

void add_node_options(CLI::App &command, NodeOptions &options)
{
    command.add_option(
        "--can", options.can,
        "bus: an interface (can0, vcan0), socketcand:HOST:PORT (listens), slcan:/dev/pts/N, or slcan: for "
        "a new pseudo-terminal");
    command.add_option("--gpio-enable", options.gpio_enable,
                       "CHIP:LINE[!]: the bridge is held off while this line is not active");
    command.add_option(
        "--gpio-fault", options.gpio_fault,
        "CHIP:LINE[!]: an edge of this line holds the bridge off until the enable line has been off");
    command.add_option("--duration", options.duration_s, "seconds; default: until interrupted");
}

} // namespace pmsim
