#include "tools/pmsim/node_command.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>

#include "tools/pmsim/command_line.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/node_lines.h"
#include "tools/pmsim/node_log.h"
#include "tools/pmsim/notes.h"
#include "tools/pmsim/pace.h"
#include "tools/pmsim/settings_option.h"

extern "C" {
#include "hal/linux/can_link.h"
}

namespace pmsim
{
namespace
{

using Clock = std::chrono::steady_clock;

constexpr double slice_s = 1e-3; // about, between two looks at the bus, the lines and the clock

volatile std::sig_atomic_t interrupted = 0;

void interrupt(int)
{
    interrupted = 1;
}

using Link = std::unique_ptr<can_link_t, void (*)(can_link_t *)>;

Link open_link(const std::string &name)
{
    char error[200];
    Link link(can_link_open(name.c_str(), error, sizeof error), &can_link_close);
    if (!link) {
        throw InputError(error);
    }
    return link;
}

class Node
{
  public:
    Node(const Scenario &scenario, const NodeOptions &options)
        : loop_(scenario), link_(open_link(options.can)), lines_(options.gpio_enable, options.gpio_fault),
          log_(options.quiet), period_s_(1.0 / scenario.setup.plant.inverter.f_pwm_Hz),
          periods_(std::max(1L, std::lround(slice_s / period_s_)))
    {
    }

    const char *where() const
    {
        return can_link_where(link_.get());
    }
    double t_s() const
    {
        return double(k_) * period_s_;
    }
    NodeLog &log()
    {
        return log_;
    }

    // One slice of simulated time, between two exchanges of frames.
    void advance()
    {
        take_frames();
        const hal_can_state_t bus = can_link_state(link_.get());
        rig_set_can_state(loop_.rig(), bus);
        const char *holding = lines_.hold_off();
        if ((holding != nullptr) != held_) {
            held_ = holding != nullptr;
            rig_set_hw_fault(loop_.rig(), held_);
        }
        log_.bus(t_s(), bus);
        log_.lines(t_s(), holding);
        const Sample *sample = nullptr;
        for (long n = 0; n < periods_; ++n) {
            sample = &loop_.step();
            give_frames();
        }
        k_ += static_cast<uint64_t>(periods_);
        log_.drive(t_s(), sample->rig);
    }

    std::string traffic() const
    {
        return std::to_string(taken_) + " frames taken, " + std::to_string(given_) + " sent" +
               (unsent_ == 0 ? "" : ", " + std::to_string(unsent_) + " found no room or no listener");
    }

  private:
    void take_frames()
    {
        if (!waiting_) {
            waiting_ = can_link_receive(link_.get(), &frame_);
        }
        while (waiting_ && rig_send(loop_.rig(), &frame_)) {
            ++taken_;
            waiting_ = can_link_receive(link_.get(), &frame_);
        }
    }

    void give_frames()
    {
        hal_can_frame_t frame;
        while (rig_receive(loop_.rig(), &frame)) {
            ++(can_link_send(link_.get(), &frame) ? given_ : unsent_);
        }
    }

    Loop loop_;
    Link link_;
    NodeLines lines_;
    NodeLog log_;
    double period_s_;
    long periods_; // of a slice
    uint64_t k_ = 0, taken_ = 0, given_ = 0, unsent_ = 0;
    hal_can_frame_t frame_{}; // has come, but the drive's ring was full
    bool waiting_ = false, held_ = false;
};

void catch_signals()
{
    struct sigaction action = {};
    action.sa_handler = interrupt;
    action.sa_flags = SA_RESTART;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

// Until the time is over or the user has interrupted.
Pace keep_pace(Node &node, double duration_s)
{
    const Clock::time_point start = Clock::now();
    const auto wall_s = [start] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    Pace pace;
    while (interrupted == 0 && (duration_s == 0.0 || node.t_s() < duration_s)) {
        node.advance();
        const Pace::Step step = pace.at(node.t_s(), wall_s());
        if (step.lost_s > 0.0) {
            node.log().end();
            std::fprintf(stderr, "pmsim node: at %.3f s: %.3f s behind real time, going on from here\n",
                         node.t_s(), step.lost_s);
        } else if (step.wait_s > 0.0) {
            std::this_thread::sleep_for(std::chrono::duration<double>(step.wait_s));
        }
    }
    return pace;
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
    catch_signals();
    const Pace pace = keep_pace(node, options.duration_s);
    node.log().end();
    if (!options.quiet) {
        std::printf("%.3f s, at most %.1f ms late", node.t_s(), 1e3 * pace.latest_s());
        if (pace.lost_s() > 0.0) {
            std::printf(", %.3f s lost", pace.lost_s());
        }
        std::printf("; %s\n", node.traffic().c_str());
    }
    return 0;
}

void add_node_options(Command &command, NodeOptions &options)
{
    command.add_option(
        "--can", options.can,
        "bus: an interface (can0, vcan0), socketcand:HOST:PORT (listens), slcan:/dev/pts/N, or slcan: for "
        "a new pseudo-terminal");
    command.add_option("--gpio-enable", options.gpio_enable,
                       "CHIP:LINE[!]: the bridge is held off while this line is not active");
    command.add_option(
        "--gpio-fault", options.gpio_fault,
        "CHIP:LINE[!]: once active, this line holds the bridge off until the enable line has been off");
    command.add_option("--duration", options.duration_s, "seconds; default: until interrupted")->positive();
}

} // namespace pmsim
