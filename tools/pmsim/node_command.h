// A drive and its plant as a live node on a CAN bus, in real time: `pmsim node`, and `pmsim board --can`.
#ifndef PMSIM_NODE_COMMAND_H
#define PMSIM_NODE_COMMAND_H

#include <string>
#include <vector>

namespace pmsim
{

class Command;

struct NodeOptions {
    std::string scenario, can, gpio_enable, gpio_fault;
    std::vector<std::string> settings;
    double duration_s = 0.0; // 0: until interrupted
    bool quiet = false;
};

void add_node_options(Command &command, NodeOptions &options); // but the scenario and the settings

// Returns when the time is over or the user has interrupted.
int run_node(const NodeOptions &options);

} // namespace pmsim

#endif
