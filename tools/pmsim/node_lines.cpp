#include "tools/pmsim/node_lines.h"

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

NodeLines::Line NodeLines::open(const std::string &name, gpio_use_t use)
{
    char error[200] = "";
    Line line(name.empty() ? nullptr : gpio_line_open(name.c_str(), use, error, sizeof error),
              &gpio_line_close);
    if (!line && !name.empty()) {
        throw InputError(error);
    }
    return line;
}

NodeLines::NodeLines(const std::string &enable, const std::string &fault)
    : enable_(open(enable, GPIO_INPUT)), fault_(open(fault, GPIO_EDGES))
{
}

const char *NodeLines::hold_off()
{
    const bool enabled = !enable_ || gpio_line_get(enable_.get()) == 1;
    if (fault_) {
        const bool bad = gpio_line_edges(fault_.get()) != 0 || gpio_line_get(fault_.get()) != 0;
        faulted_ = bad || (faulted_ && (enabled || !enable_));
    }
    if (!enabled) {
        return "enable line off";
    }
    return faulted_ ? "fault line" : nullptr;
}

} // namespace pmsim
