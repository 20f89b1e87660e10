// The chip's devices without a processor: one stands in that only keeps time, alarms, interrupt lines and the
// first error. Registers are written and read by address, as an image would.
#ifndef TESTS_UNIT_BOARD_RIG_H
#define TESTS_UNIT_BOARD_RIG_H

#include <cstdint>
#include <map>
#include <string>
#include <vector>

extern "C" {
#include "sim_plant/board/board_chip.h"
}

struct cpu {
    uint64_t now = 0;
    std::vector<cpu_device_t> devices;
    struct alarm_t {
        uint64_t cycle;
        cpu_alarm_t call;
    };
    std::map<void *, alarm_t> alarms;
    std::map<int, bool> lines;
    std::vector<uint8_t> flash = std::vector<uint8_t>(FLASH_SIZE, 0xFF);
    std::string error;
    bool halted = false;
    uint64_t stalled_until = 0;
};

namespace rig
{

constexpr uint32_t rcc = 0x40021000, pwr = 0x40007000, flash = 0x40022000, gpioa = 0x48000000,
                   gpiob = 0x48000400, gpioc = 0x48000800, tim1 = 0x40012C00, tim2 = 0x40000000,
                   adc1 = 0x50000000, adc2 = 0x50000100, adc12 = 0x50000300, opamp = 0x40010300,
                   comp = 0x40010200, dac3 = 0x50001000, fdcan = 0x40006400, can_ram = 0x4000A400,
                   iwdg = 0x40003000, usart2 = 0x40004400;

constexpr uint32_t counts = 4250; // 20 kHz at 170 MHz

inline plant_config_t plant_config()
{
    plant_config_t c{};
    c.machine = {0.1, 50e-6, 50e-6, 0.0, 5e-3, 7};
    c.mech.J_kgm2 = 1e-4;
    c.mech.locked = true;
    c.inverter.f_pwm_Hz = 20e3;
    c.inverter.timer_counts = counts;
    c.inverter.dead_time_s = 500e-9;
    c.dclink.v_source_V = 24.0;
    c.sensor.shunt = PLANT_LOW_SIDE;
    c.sensor.i_full_scale_A = 60.0;
    c.sensor.v_full_scale_V = 34.3;
    return c;
}

class Chip
{
  public:
    explicit Chip(const plant_config_t &config = plant_config());
    ~Chip();
    Chip(const Chip &) = delete;
    Chip &operator=(const Chip &) = delete;

    void write(uint32_t address, uint32_t value, uint32_t mask = 0xFFFFFFFF);
    uint32_t read(uint32_t address);
    void set(uint32_t address, uint32_t bits); // read, or, write
    void run(uint64_t cycles);
    void run_s(double seconds);
    void run_period(); // as board.c does: to TIM1's next update event, and the plant behind it
    bool line(int irq) const;
    std::string take_error();

    // What an image does; each leaves no error.
    void supply_clocks();
    void clock_170MHz();
    void pins();
    void gates(uint32_t dead_time = 85, uint32_t bkf = 0); // TIM1 as the image has it, not started
    void amplifiers();
    void comparators(uint32_t code);
    void converters(uint32_t trigger = 1u | 8u << 2 | 1u << 7); // up to armed sequences; JL, JEXTSEL, JEXTEN
    void start_timer();
    void all(uint32_t comparator_code = 0x0F0);

    cpu processor;
    plant_t *plant;
    board_chip_t *chip; // large
};

} // namespace rig

#endif
