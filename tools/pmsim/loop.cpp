#include "tools/pmsim/loop.h"

#include <algorithm>
#include <cmath>

namespace pmsim
{

uint64_t period_count(const Scenario &scenario)
{
    return static_cast<uint64_t>(std::llround(scenario.duration_s * scenario.setup.plant.inverter.f_pwm_Hz));
}

// A scenario that waits for the fault PARAMETERS wants to see what the drive does with bad ones.
static bool refusal_expected(const Scenario &scenario)
{
    return std::any_of(scenario.expect.begin(), scenario.expect.end(), [](const Expectation &expectation) {
        return expectation.metric == "fault" && expectation.equals == "PARAMETERS";
    });
}

static bool asks_identified(const Scenario &scenario)
{
    return std::any_of(scenario.expect.begin(), scenario.expect.end(), [](const Expectation &expectation) {
        return expectation.metric.rfind("identify_", 0) == 0;
    });
}

static rig_t *create(const Scenario &scenario)
{
    char error[200];
    rig_t *rig = rig_create(&scenario.setup.plant, scenario.theta_e_rad, scenario.setup.params.get(),
                            refusal_expected(scenario), error, sizeof error);
    if (rig == nullptr) {
        const std::string reason = error, plant = "plant: ";
        if (reason.rfind(plant, 0) == 0) {
            refuse_plant(scenario.setup, reason.substr(plant.size()));
        }
        throw InputError(scenario.setup.name + ": " + error);
    }
    return rig;
}

Loop::Loop(const Scenario &scenario)
    : rig_(create(scenario)), profile_(scenario, rig_.get()),
      period_s_(1.0 / scenario.setup.plant.inverter.f_pwm_Hz)
{
    sample_.rig.asks_identified = asks_identified(scenario);
}

void Loop::play()
{
    profile_.play(double(k_++) * period_s_, sample_.rig.state, sample_.rig.truth.omega_mech_rad_s);
}

const Sample &Loop::step()
{
    play();
    rig_step(rig_.get(), &sample_.rig);
    sample_.load_Nm = profile_.load_Nm();
    sample_.speed_ref_rad_s = profile_.speed_ref_rad_s();
    sample_.direction = profile_.direction();
    return sample_;
}

rig_t *Loop::rig() const
{
    return rig_.get();
}

record_period_t Loop::record() const
{
    record_period_t record;
    rig_record(rig_.get(), &record);
    return record;
}

uint32_t Loop::slow_divider() const
{
    return rig_slow_divider(rig_.get());
}

void Loop::step_plant(const record_period_t &record)
{
    plant_truth_windings(rig_plant(rig_.get()), &sample_.rig.truth);
    play();
    rig_step_plant(rig_.get(), &record);
}

bool Loop::step_drive(const record_period_t &record)
{
    play();
    return rig_step_drive(rig_.get(), &record);
}

} // namespace pmsim
