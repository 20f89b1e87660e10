#include "bench.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

namespace bench
{

const char *image = nullptr;
const char *contract = nullptr;

constexpr uint32_t store_address = 0x0801F000;

plant_config_t plant_config()
{
    plant_config_t c = plants::ipm_1000();
    const double ohms = kVolts / kAmperes;
    c.machine.R_s_ohm *= ohms;
    c.machine.L_d0_H *= ohms;
    c.machine.L_q0_H *= ohms;
    c.machine.c_A_Wb5 *= kAmperes / std::pow(kVolts, 5);
    c.machine.psi_m_Wb *= kVolts;
    c.mech.J_kgm2 *= kVolts * kAmperes;
    c.mech.B_Nms *= kVolts * kAmperes;
    c.mech.locked = true;
    c.inverter.v_switch_V *= kVolts;
    c.inverter.v_diode_V *= kVolts;
    c.dclink.v_source_V *= kVolts;
    c.dclink.r_source_ohm *= ohms;
    c.dclink.c_F /= ohms;
    c.sensor.i_full_scale_A = BOARD_I_FULL_SCALE_A;
    c.sensor.v_full_scale_V = BOARD_V_FULL_SCALE_V;
    c.sensor.shunt = PLANT_LOW_SIDE;
    return c;
}

drive_params_t params()
{
    const std::map<std::string, double> factors = {
        {"V", kVolts},  {"A", kAmperes},          {"ohm", kVolts / kAmperes},  {"H", kVolts / kAmperes},
        {"Wb", kVolts}, {"F", kAmperes / kVolts}, {"kg m2", kVolts * kAmperes}};
    drive_params_t p;
    drive_params_default(&p);
    for (int32_t n = 0; n < DRIVE_PARAM_COUNT; ++n) {
        const auto id = static_cast<drive_param_id_t>(n);
        const auto found = factors.find(drive_param_text[id].unit);
        if (found != factors.end()) {
            const double value = std::round(found->second * drive_param_get(&p, id));
            const drive_param_info_t &range = drive_param_table[id]; // the limits are open to their ends
            drive_param_set(&p, id, int32_t(std::clamp<double>(value, range.min, range.max)));
        }
    }
    p.i_full_scale = int32_t(std::lround(1e3 * BOARD_I_FULL_SCALE_A));
    p.v_full_scale = int32_t(std::lround(1e3 * BOARD_V_FULL_SCALE_V));
    return p;
}

Bench::Bench(const plant_config_t &config, const char *elf_path)
{
    const char *reason = nullptr;
    char error[300] = "";
    plant = plant_create(&config, 0.3, &reason);
    board = plant != nullptr ? board_create(elf_path, plant, error, sizeof error) : nullptr;
    if (board == nullptr) {
        throw std::runtime_error(reason != nullptr ? reason : error);
    }
}

Bench::~Bench()
{
    board_destroy(board);
    plant_destroy(plant);
}

void Bench::store(int page, const drive_params_t &parameters, uint32_t sequence)
{
    uint32_t words[STORE_WORDS];
    uint32_t used = app_page(&parameters, sequence, words);
    board_program(board, store_address + 2048u * static_cast<uint32_t>(page), words, used * sizeof words[0]);
}

void Bench::boot()
{
    ASSERT_TRUE(board_boot(board, 0.2)) << board_error(board);
}

void Bench::run_ms(double ms)
{
    auto periods = static_cast<int>(ms * 10.0);
    for (int n = 0; n < periods; n++) {
        ASSERT_TRUE(board_run_period(board)) << board_error(board);
    }
}

void Bench::command(bool enable, drive_mode_t mode, int32_t speed_mrad_s, int32_t current_mA, bool clear)
{
    drive_command_t command = {};
    command.enable = enable;
    command.mode = mode;
    command.speed_mrad_s = speed_mrad_s;
    command.current_mA = current_mA;
    if (!started_) {
        const drive_params_t p = params();
        master_ = master_make(board, &p);
        master_start(&master_);
        started_ = true;
    }
    if (clear) {
        master_clear_fault(&master_, &command);
    } else {
        master_send(&master_, &command);
    }
}

void Bench::running()
{
    store(0, params(), 1);
    boot();
    run_ms(5);
    for (int n = 0; n < 20 && watched()->drive.state != DRIVE_RUNNING; n++) {
        command(true, DRIVE_MODE_CURRENT, 0);
        run_ms(100);
    }
    command(true, DRIVE_MODE_CURRENT, 0);
    run_ms(100);
    ASSERT_EQ(watched()->drive.state, DRIVE_RUNNING) << console();
    ASSERT_TRUE(bridge_on());
}

bool Bench::bridge_on() const
{
    return board_bridge_on(board);
}

std::string Bench::console() const
{
    return board_console(board);
}

plant_truth_t Bench::truth() const
{
    plant_truth_t t;
    plant_truth(plant, &t);
    return t;
}

const image_memory_t *Bench::watched()
{
    return static_cast<const image_memory_t *>(board_variable(board, "app_instance", sizeof(image_memory_t)));
}

std::vector<uint16_t> Bench::patch(const std::vector<uint16_t> &code)
{
    for (int n = 0; n < 100 && !cpu_sleeping(board_cpu(board)); n++) {
        run_ms(0.1);
    }
    EXPECT_TRUE(cpu_sleeping(board_cpu(board)));
    patched_ = cpu_pc(board_cpu(board)) & ~1u;
    std::vector<uint16_t> before(code.size());
    board_read_flash(board, patched_, before.data(), 2 * before.size());
    put_back(code);
    return before;
}

void Bench::put_back(const std::vector<uint16_t> &code)
{
    board_program(board, patched_, code.data(), 2 * code.size());
}

} // namespace bench

int main(int argc, char **argv)
{
    testing::InitGoogleMock(&argc, argv);
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s pmdrive.elf hal_contract.elf [--gtest_...]\n", argv[0]);
        return 2;
    }
    bench::image = argv[1];
    bench::contract = argv[2];
    return RUN_ALL_TESTS();
}
