// A fan's drive in block commutation: plant with switching bridge, dead time, leg capacitance and converter. The plant says where the
// rotor is.
#ifndef TESTS_UNIT_DRIVE_FAN_H
#define TESTS_UNIT_DRIVE_FAN_H

#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "firmware/drive/drive_parts.h"
#include "hal/sim/sim_loop.h"
#include "tests/contract/bench.h"
#include "tools/pmsim/machine_file.h"

namespace fan
{

constexpr double kRated_rad_s = 314.16, kRated_Nm = 0.225;

class Fan
{
  public:
    explicit Fan(double theta_rad = 1.0, void (*change)(plant_config_t &) = nullptr)
        : setup_(pmsim::load_machine_file("sim_plant/machines/bldc_fan.yaml"))
    {
        if (change != nullptr) {
            change(setup_.plant);
        }
        pmsim::derive_board_parameters(setup_);
        const char *error = nullptr;
        plant_.reset(plant_create(&setup_.plant, theta_rad, &error));
        EXPECT_NE(plant_, nullptr) << error;
    }

    drive_params_t &params()
    {
        return *setup_.params;
    }

    plant_t *plant()
    {
        return plant_.get();
    }

    drive_t &drive()
    {
        return loop_.app.drive;
    }

    drive_fault_t fault()
    {
        return drive_status(&drive())->fault;
    }

    bool driven() const
    {
        return loop_.app.out.legs != PM_LEGS_OFF;
    }

    // What the drive was given in the last period.
    const drive_in_t &seen() const
    {
        return loop_.app.in;
    }

    void enable(drive_mode_t mode = DRIVE_MODE_SPEED)
    {
        const drive_result_t result = sim_loop_init(&loop_, plant(), &params());
        ASSERT_TRUE(result.ok) << result.reason << " (parameter " << result.param << ")";
        command_.enable = true;
        command_.mode = mode;
    }

    // A ramp to a fifth of rated speed.
    void turn(int32_t acceleration_mrad_s2)
    {
        params().acceleration = acceleration_mrad_s2;
        enable();
        speed_rel(0.2);
        run_s(1.7);
    }

    void stop()
    {
        command_.enable = false;
        drive_command(&drive(), &command_);
    }

    void speed_rel(double x)
    {
        command_.speed_mrad_s = static_cast<int32_t>(std::lround(1000 * kRated_rad_s * x));
        drive_command(&drive(), &command_);
    }

    void torque_rel(double x)
    {
        command_.torque_uNm = static_cast<int32_t>(std::lround(1e6 * kRated_Nm * x));
        drive_command(&drive(), &command_);
    }

    void duty(double x)
    {
        command_.duty_ppm = static_cast<int32_t>(std::lround(1e6 * x));
        drive_command(&drive(), &command_);
    }

    void current_A(double i)
    {
        command_.current_mA = static_cast<int32_t>(std::lround(1000 * i));
        drive_command(&drive(), &command_);
    }

    void identify(uint32_t routines, double omega_rad_s)
    {
        command_.routines = static_cast<uint8_t>(routines);
        command_.speed_mrad_s = static_cast<int32_t>(std::lround(1000 * omega_rad_s));
        command_.current_mA = 4000;
        drive_command(&drive(), &command_);
    }

    // Periods, of which the worst angle is kept while block commutation has the rotor.
    void run_s(double time_s)
    {
        worst_deg = peak_A = 0;
        for (long k = std::lround(time_s * 20e3); k > 0; --k) {
            plant_truth_t truth;
            plant_truth(plant(), &truth);
            sim_loop_step(&loop_);
            peak_A =
                std::max({peak_A, std::fabs(truth.i_A[0]), std::fabs(truth.i_A[1]), std::fabs(truth.i_A[2])});
            omega_rel = truth.omega_mech_rad_s / kRated_rad_s;
            if (drive().stage == STAGE_SIX_STEP) {
                const double error =
                    bench::wrapped(truth.theta_e_rad - bench::rad(drive_status(&drive())->theta));
                worst_deg = std::max(worst_deg, std::fabs(error) / bench::kDegree);
            }
        }
    }

    // Until there is a fault: seconds.
    double until_fault_s(double most_s)
    {
        double time_s = 0;
        for (; time_s < most_s && fault() == DRIVE_FAULT_NONE; time_s += 1e-3) {
            run_s(1e-3);
        }
        return time_s;
    }

    double worst_deg = 0, omega_rel = 0, peak_A = 0;

  private:
    pmsim::Setup setup_;
    std::unique_ptr<plant_t, decltype(&plant_destroy)> plant_{nullptr, &plant_destroy};
    sim_loop_t loop_ = {};
    drive_command_t command_ = {};
};

} // namespace fan

#endif
