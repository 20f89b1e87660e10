// The lines beside a live node, as they stand beside a drive board: the bridge is held off
//   - while the enable line is not active or cannot be read;
//   - from the moment at which the fault line is active, has had an edge or cannot be read, until it is not
//     active and the enable line has been off; without an enable line for good.
// A line that is not named holds nothing. Looked at once per slice of the node, edges are kept by the kernel.
#ifndef PMSIM_NODE_LINES_H
#define PMSIM_NODE_LINES_H

#include <memory>
#include <string>

extern "C" {
#include "hal/linux/gpio_line.h"
}

namespace pmsim
{

class NodeLines
{
  public:
    NodeLines(const std::string &enable, const std::string &fault); // InputError: no such line, or taken

    const char *hold_off(); // why; null: nothing does

  private:
    using Line = std::unique_ptr<gpio_line_t, void (*)(gpio_line_t *)>;

    static Line open(const std::string &name, gpio_use_t use);

    Line enable_, fault_;
    bool faulted_ = false;
};

} // namespace pmsim

#endif
