// What a live node tells its user: each change as a line with its time, and on a terminal a line of live
// values below.
#ifndef PMSIM_NODE_LOG_H
#define PMSIM_NODE_LOG_H

#include <string>

#include "hal/can_frame.h"
#include "tools/pmsim/metrics.h"

namespace pmsim
{

class NodeLog
{
  public:
    explicit NodeLog(bool quiet);

    void drive(double t_s, const rig_sample_t &sample);
    void bus(double t_s, hal_can_state_t state);
    void lines(double t_s, const char *holding); // null: released
    void say(double t_s, const std::string &text);

    void end(); // of the live line

  private:
    void show(double t_s, const rig_sample_t &sample);

    bool quiet_, live_;
    double next_s_ = 0.0;
    int state_ = -1, fault_ = 0;
    hal_can_state_t bus_ = HAL_CAN_ACTIVE;
    const char *holding_ = nullptr;
};

} // namespace pmsim

#endif
