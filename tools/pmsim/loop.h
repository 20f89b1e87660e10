// The rig with its profile: the closed loop of a scenario, period by period.
#ifndef PMSIM_LOOP_H
#define PMSIM_LOOP_H

#include <memory>

#include "tools/pmsim/metrics.h"
#include "tools/pmsim/profile.h"

namespace pmsim
{

uint64_t period_count(const Scenario &scenario);

class Loop
{
  public:
    explicit Loop(const Scenario &scenario); // the scenario must outlive it

    const Sample &step(); // one control period
    rig_t *rig() const;
    record_period_t record() const; // of the last one
    uint32_t slow_divider() const;

    // The same period with half of the loop, the rest from a record; false: the drive's output differs.
    void step_plant(const record_period_t &record);
    bool step_drive(const record_period_t &record);

  private:
    struct Deleter {
        void operator()(rig_t *rig) const
        {
            rig_destroy(rig);
        }
    };

    void play();

    std::unique_ptr<rig_t, Deleter> rig_;
    Profile profile_;
    Sample sample_{};
    double period_s_;
    uint64_t k_ = 0;
};

} // namespace pmsim

#endif
