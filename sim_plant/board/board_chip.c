#include "sim_plant/board/board_chip.h"

#include <assert.h>

static bool clocked(const board_gate_t *gate)
{
    if (gate->enable_register == 0u ||
        rcc_enabled(&gate->chip->rcc, gate->enable_register, gate->enable_bit)) {
        return true;
    }
    cpu_fail(gate->chip->cpu, "%s: access while its clock is off", gate->inner.name);
    return false;
}

static bool gated_read(void *self, uint32_t offset, uint32_t *value)
{
    board_gate_t *gate = self;
    return clocked(gate) && gate->inner.read(gate->inner.self, offset, value);
}

static bool gated_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    board_gate_t *gate = self;
    return clocked(gate) && gate->inner.write(gate->inner.self, offset, value, mask);
}

static void add(board_chip_t *chip, cpu_device_t device, uint32_t enable_register, uint32_t enable_bit)
{
    assert(chip->gates < BOARD_FIXED_DEVICES);
    board_gate_t *gate = &chip->gate[chip->gates++];
    *gate = (board_gate_t){device, chip, enable_register, enable_bit};
    device.self = gate;
    device.read = gate->inner.read ? gated_read : NULL;
    device.write = gated_write;
    cpu_add_device(chip->cpu, &device);
}

static void add_devices(board_chip_t *chip)
{
    add(chip, rcc_device(&chip->rcc), 0u, 0u);
    add(chip, rcc_power_device(&chip->rcc), RCC_APB1ENR1, 0x10000000u);
    add(chip, flash_device(&chip->flash), RCC_AHB1ENR, 0x100u);
    add(chip, flash_memory_device(&chip->flash), 0u, 0u);
    for (int n = 0; n < GPIO_PORTS; n++) {
        add(chip, gpio_device(&chip->gpio, (gpio_port_t)n), RCC_AHB2ENR, 1u << n);
    }
    add(chip, tim1_device(&chip->tim1), RCC_APB2ENR, 0x800u);
    add(chip, tim2_device(&chip->tim2), RCC_APB1ENR1, 0x1u);
    add(chip, tim3_device(&chip->tim3), RCC_APB1ENR1, 0x2u);
    add(chip, tim4_device(&chip->tim4), RCC_APB1ENR1, 0x4u);
    add(chip, adc_device(&chip->adc), RCC_AHB2ENR, 0x2000u);
    add(chip, analog_opamp_device(&chip->analog), RCC_APB2ENR, 0x1u);
    add(chip, analog_comp_device(&chip->analog), RCC_APB2ENR, 0x1u);
    add(chip, analog_dac_device(&chip->analog), RCC_AHB2ENR, 0x40000u);
    add(chip, fdcan_device(&chip->fdcan), RCC_APB1ENR1, 0x02000000u);
    add(chip, fdcan_ram_device(&chip->fdcan), RCC_APB1ENR1, 0x02000000u);
    add(chip, iwdg_device(&chip->iwdg), 0u, 0u);
    add(chip, usart_device(&chip->usart), RCC_APB1ENR1, 0x20000u);
    add(chip, board_misc_syscfg(&chip->misc), RCC_APB2ENR, 0x1u);
    add(chip, board_misc_debug(&chip->misc), 0u, 0u);
}

void board_chip_init(board_chip_t *chip, cpu_t *cpu, plant_t *plant)
{
    *chip = (board_chip_t){.cpu = cpu, .plant = plant};
    chip->wiring.temperature_degC = 25.0;
    chip->wiring.supply_V = BOARD_SUPPLY_V;
    rcc_init(&chip->rcc, chip);
    flash_init(&chip->flash, chip, cpu_memory(cpu, FLASH_BASE, FLASH_SIZE));
    gpio_init(&chip->gpio, chip);
    tim1_init(&chip->tim1, chip);
    tim2_init(&chip->tim2, chip);
    tim3_init(&chip->tim3, chip);
    tim4_init(&chip->tim4, chip);
    adc_init(&chip->adc, chip);
    analog_init(&chip->analog, chip);
    fdcan_init(&chip->fdcan, chip);
    iwdg_init(&chip->iwdg, chip);
    usart_init(&chip->usart, chip);
    board_misc_init(&chip->misc, cpu);
    add_devices(chip);
}

void board_chip_free(board_chip_t *chip)
{
    usart_free(&chip->usart);
}

void board_chip_reset(board_chip_t *chip, uint32_t cause)
{
    tim1_reset(&chip->tim1); /* first of all the bridge */
    rcc_reset(&chip->rcc, cause);
    flash_reset(&chip->flash);
    gpio_reset(&chip->gpio);
    tim2_reset(&chip->tim2);
    tim3_reset(&chip->tim3);
    tim4_reset(&chip->tim4);
    adc_reset(&chip->adc);
    analog_reset(&chip->analog);
    fdcan_reset(&chip->fdcan);
    iwdg_reset(&chip->iwdg);
    usart_reset(&chip->usart);
    board_misc_reset(&chip->misc);
    board_set_comparators(chip);
}
