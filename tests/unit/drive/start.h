// A start of the drive on the plant: switching inverter, dead time, converter noise and delay.
#ifndef TESTS_UNIT_DRIVE_START_H
#define TESTS_UNIT_DRIVE_START_H

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/application.h"
#include "tests/support/plants.h"

namespace start
{

class Start
{
  public:
    Start(const plant_config_t &plant, const drive_params_t &params, double theta_rad)
        : config_(plant), params_(params), plant_(plant_create(&config_, theta_rad, &error_), &plant_destroy)
    {
        EXPECT_TRUE(sim_loop_init(&loop, plant_.get(), &params_).ok);
        drive_command_t c = {};
        c.enable = true;
        drive_command(&loop.app.drive, &c);
    }

    drive_t &drive()
    {
        return loop.app.drive;
    }

    void period()
    {
        sim_loop_step(&loop);
    }

    // Periods until `until` holds, or 1.5 s.
    template <typename Until> int run(Until until)
    {
        int k = 0;
        for (; k < 15000 && !until(drive()); ++k) {
            period();
        }
        return k;
    }

    int run_to(procedure_id_t id)
    {
        return run([id](const drive_t &d) { return d.sequence.procedure == id; });
    }

    int run_past(procedure_id_t id)
    {
        run_to(id);
        return run([id](const drive_t &d) { return d.sequence.procedure != id; });
    }

    plant_t *plant()
    {
        return plant_.get();
    }

    double error_rad()
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return bench::wrapped(t.theta_e_rad - bench::rad(drive_status(&drive())->theta));
    }

    plant_truth_t truth()
    {
        plant_truth_t t;
        plant_truth(plant_.get(), &t);
        return t;
    }

  private:
    plant_config_t config_;
    drive_params_t params_;
    const char *error_ = nullptr;
    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;

  public:
    sim_loop_t loop = {};
};

} // namespace start

#endif
