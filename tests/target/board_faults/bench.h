// The flashed image on the emulated board with IPM-1000 wound for its voltage and current, its parameters in flash,
// commands over CAN.
#ifndef TESTS_TARGET_BOARD_FAULTS_BENCH_H
#define TESTS_TARGET_BOARD_FAULTS_BENCH_H

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim_plant/board/board.h"
#include "tests/contract/firmware.h"
#include "tests/support/plants.h"

extern "C" {
#include "firmware/app/app.h"
#include "firmware/params/store.h"
#include "sim_plant/board/board_inside.h"
#include "tools/pmsim_board/image_memory.h"
#include "tools/pmsim_board/master.h"
}

namespace bench
{

extern const char *image, *contract; // paths, from the command line

// The board's full scales over those of METHODS.md 0.3.
constexpr double kVolts = BOARD_V_FULL_SCALE_V / 450, kAmperes = BOARD_I_FULL_SCALE_A / 10;

plant_config_t plant_config();
drive_params_t params();

class Bench
{
  public:
    explicit Bench(const plant_config_t &config = plant_config(), const char *elf_path = image);
    ~Bench();
    Bench(const Bench &) = delete;
    Bench &operator=(const Bench &) = delete;

    void store(int page, const drive_params_t &parameters, uint32_t sequence);
    void boot();
    void run_ms(double ms); // the run must not end with an error
    void command(bool enable, drive_mode_t mode = DRIVE_MODE_CURRENT, int32_t speed_mrad_s = 0,
                 int32_t current_mA = 12000, bool clear = false);
    void running(); // on, with a current of 12 A that turns slowly
    bool bridge_on() const;
    std::string console() const;
    plant_truth_t truth() const;
    const image_memory_t *watched();
    // In place of the instructions behind the main loop's sleep; gives back what was there.
    std::vector<uint16_t> patch(const std::vector<uint16_t> &code);
    void put_back(const std::vector<uint16_t> &code);

    plant_t *plant;
    board_t *board;

  private:
    master_t master_{};
    bool started_ = false;
    uint32_t patched_ = 0;
};

} // namespace bench

#endif
