#include "rig.h"

#include <cstdarg>
#include <cstdio>
#include <stdexcept>

extern "C" {

uint64_t cpu_now(const cpu_t *cpu)
{
    return cpu->now;
}

void cpu_fail(cpu_t *cpu, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (cpu->error.empty()) {
        cpu->error = text;
    }
}

void cpu_irq(cpu_t *cpu, int irq, bool level)
{
    cpu->lines[irq] = level;
}

void cpu_alarm(cpu_t *cpu, void *owner, uint64_t cycle, cpu_alarm_t alarm)
{
    cpu->alarms.erase(owner);
    if (cycle != UINT64_MAX) {
        cpu->alarms[owner] = {cycle, alarm};
    }
}

void cpu_add_device(cpu_t *cpu, const cpu_device_t *device)
{
    cpu->devices.push_back(*device);
}

uint8_t *cpu_memory(cpu_t *cpu, uint32_t address, uint32_t size)
{
    bool inside = address >= FLASH_BASE && address - FLASH_BASE + size <= FLASH_SIZE;
    return inside ? cpu->flash.data() + (address - FLASH_BASE) : nullptr;
}

void cpu_code_changed(cpu_t *, uint32_t, uint32_t)
{
}

void cpu_halt(cpu_t *cpu, bool halted)
{
    cpu->halted = halted;
}

void cpu_stall(cpu_t *cpu, uint32_t, uint64_t until_cycle)
{
    cpu->stalled_until = until_cycle;
}
}

namespace rig
{

Chip::Chip(const plant_config_t &config)
{
    const char *error = nullptr;
    plant = plant_create(&config, 0.0, &error);
    if (plant == nullptr) {
        throw std::runtime_error(error);
    }
    chip = new board_chip_t;
    board_chip_init(chip, &processor, plant);
    board_chip_reset(chip, RCC_POWER_RESET);
}

Chip::~Chip()
{
    board_chip_free(chip);
    delete chip;
    plant_destroy(plant);
}

static const cpu_device_t *device_at(const cpu &processor, uint32_t address)
{
    for (const cpu_device_t &d : processor.devices) {
        if (address - d.base < d.size) {
            return &d;
        }
    }
    throw std::runtime_error("no device");
}

void Chip::write(uint32_t address, uint32_t value, uint32_t mask)
{
    const cpu_device_t *d = device_at(processor, address);
    if (!d->write(d->self, address - d->base, value, mask)) {
        cpu_fail(&processor, "refused");
    }
}

uint32_t Chip::read(uint32_t address)
{
    const cpu_device_t *d = device_at(processor, address);
    uint32_t value = 0;
    if (d->read == nullptr || !d->read(d->self, address - d->base, &value)) {
        cpu_fail(&processor, "refused");
    }
    return value;
}

void Chip::set(uint32_t address, uint32_t bits)
{
    write(address, read(address) | bits);
}

void Chip::run(uint64_t cycles)
{
    uint64_t until = processor.now + cycles;
    for (;;) {
        void *owner = nullptr;
        cpu::alarm_t first{until, nullptr};
        for (const auto &[who, alarm] : processor.alarms) {
            if (alarm.cycle <= first.cycle && (owner == nullptr || alarm.cycle < first.cycle)) {
                owner = who;
                first = alarm;
            }
        }
        if (owner == nullptr) {
            processor.now = until;
            return;
        }
        processor.alarms.erase(owner);
        processor.now = first.cycle > processor.now ? first.cycle : processor.now;
        first.call(owner, first.cycle);
    }
}

void Chip::run_s(double seconds)
{
    run(rcc_cycles(&chip->rcc, seconds));
}

void Chip::run_period()
{
    uint64_t update = tim1_next_update(&chip->tim1);
    run(update - processor.now);
    tim1_update(&chip->tim1);
    adc_sample_until(&chip->adc, update);
    plant_pwm_t pwm{};
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        pwm.compare[leg][0] = pwm.compare[leg][1] = chip->tim1.compare[leg];
        pwm.driven[leg] = chip->wiring.driven[leg];
        pwm.state[leg] = chip->wiring.state[leg];
    }
    plant_set_pwm(plant, &pwm);
    plant_run_period(plant);
    chip->wiring.start = update;
    board_told(chip);
    chip->wiring.in_step = tim1_follows_plant(&chip->tim1);
}

bool Chip::line(int irq) const
{
    auto found = processor.lines.find(irq);
    return found != processor.lines.end() && found->second;
}

std::string Chip::take_error()
{
    std::string error;
    error.swap(processor.error);
    return error;
}

void Chip::supply_clocks()
{
    set(rcc + 0x4C, 0x42007);
    set(rcc + 0x58, 0x12020001);
    set(rcc + 0x60, 0x801);
    write(rcc + 0x88, 0x02000000);
}

void Chip::clock_170MHz()
{
    set(rcc, 0x10000);
    run_s(3e-3);
    write(rcc + 0x0C, 0x01005513);
    set(rcc, 0x1000000);
    run_s(50e-6);
    write(pwr + 0x80, 0);
    write(flash, 0x40704);
    write(rcc + 0x08, 0x83);
    run_s(2e-6);
    write(rcc + 0x08, 0x03);
}

static void alternate(Chip *c, uint32_t port, int pin, uint32_t function)
{
    uint32_t afr = port + (pin < 8 ? 0x20 : 0x24);
    int at = 4 * (pin % 8);
    c->write(afr, (c->read(afr) & ~(0xFu << at)) | function << at);
    c->write(port, (c->read(port) & ~(3u << (2 * pin))) | 2u << (2 * pin));
}

void Chip::pins()
{
    const int a[] = {8, 9, 10, 12};
    for (int pin : a) {
        alternate(this, gpioa, pin, 6);
    }
    alternate(this, gpioc, 13, 4);
    alternate(this, gpiob, 15, 4);
    alternate(this, gpioa, 15, 9);
    alternate(this, gpioa, 11, 9);
    alternate(this, gpiob, 9, 9);
    alternate(this, gpiob, 3, 7);
}

void Chip::gates(uint32_t dead_time, uint32_t bkf)
{
    write(tim1, 0xA0);
    write(tim1 + 0x04, 7u << 20);
    write(tim1 + 0x2C, counts);
    write(tim1 + 0x18, 0x6868);
    write(tim1 + 0x1C, 0x7868);
    write(tim1 + 0x40, counts - 1);
    write(tim1 + 0x60, 0x17);
    write(tim1 + 0x30, 0);
    write(tim1 + 0x14, 1);
    write(tim1 + 0x44, dead_time | 0x3C00 | 0x200 | bkf << 16);
}

void Chip::amplifiers()
{
    for (uint32_t n = 0; n < 3; n++) {
        write(opamp + 4 * n, 0x1 | 0x80 | 2u << 5 | 11u << 14);
    }
}

void Chip::comparators(uint32_t code)
{
    write(dac3 + 0x3C, 0x38003);
    write(dac3 + 0x08, code);
    write(dac3 + 0x14, code);
    write(dac3, 0x10001);
    run_s(20e-6);
    for (uint32_t offset : {0x0u, 0x4u, 0xCu}) {
        write(comp + offset, 0x10041);
    }
}

void Chip::converters(uint32_t trigger)
{
    write(adc12 + 8, 3u << 16);
    for (uint32_t adc : {adc1, adc2}) {
        write(adc + 0x08, 0);
        write(adc + 0x08, 0x10000000);
        run_s(21e-6);
        write(adc + 0x08, 0x90000000);
        run_s(10e-6);
        write(adc + 0x08, 0x10000001);
        run_s(2e-6);
    }
    write(adc1 + 0x14, 1u << 9 | 6u << 15);
    write(adc1 + 0x18, 6u << 3 | 1u << 6);
    write(adc2 + 0x14, 1u << 3 | 1u << 9);
    write(adc1 + 0x4C, trigger | 3u << 9 | 12u << 15);
    write(adc2 + 0x4C, trigger | 3u << 9 | 1u << 15);
    write(adc1 + 0x04, 0x40);
    write(adc2 + 0x08, 0x10000008);
    write(adc1 + 0x08, 0x10000008);
}

void Chip::start_timer()
{
    set(tim1, 1);
    write(tim1 + 0x30, 1);
    chip->wiring.start = processor.now;
}

void Chip::all(uint32_t comparator_code)
{
    supply_clocks();
    clock_170MHz();
    pins();
    amplifiers();
    comparators(comparator_code);
    gates();
    converters();
    start_timer();
    run_period();
}

} // namespace rig
