#include "sim_plant/board/gpio.h"

#include "sim_plant/board/board_chip.h"

#include <stddef.h>

enum {
    MODER = 0x00,
    OTYPER = 0x04,
    OSPEEDR = 0x08,
    PUPDR = 0x0C,
    IDR = 0x10,
    ODR = 0x14,
    BSRR = 0x18,
    AFRL = 0x20,
    AFRH = 0x24,
    BRR = 0x28
};
enum { INPUT, OUTPUT, ALTERNATE, ANALOG };
enum { PULL_UP = 1 };

/* PA13 to PA15 and PB3, PB4 are the debugger's after reset. */
#define PORT_LIST(MODES, SPEEDS, PULLS)                                                                      \
    {                                                                                                        \
        {MODER, "MODER", MODES, 0xFFFFFFFFu, 0}, {OTYPER, "OTYPER", 0, 0, 0},                                \
            {OSPEEDR, "OSPEEDR", SPEEDS, 0xFFFFFFFFu, 0}, {PUPDR, "PUPDR", PULLS, 0xFFFFFFFFu, 0},           \
            {IDR, "IDR", 0, 0, 0}, {ODR, "ODR", 0, 0xFFFFu, 0}, {BSRR, "BSRR", 0, 0xFFFFFFFFu, 0},           \
            {AFRL, "AFRL", 0, 0xFFFFFFFFu, 0}, {AFRH, "AFRH", 0, 0xFFFFFFFFu, 0},                            \
            {BRR, "BRR", 0, 0xFFFFu, 0},                                                                     \
    }
#define PORT_REGISTERS 10

static const board_register_t list[GPIO_PORTS][PORT_REGISTERS] = {
    PORT_LIST(0xABFFFFFFu, 0x0C000000u, 0x64000000u),
    PORT_LIST(0xFFFFFEBFu, 0x000000C0u, 0x00000100u),
    PORT_LIST(0xFFFFFFFFu, 0, 0),
};

void gpio_init(gpio_t *gpio, board_chip_t *chip)
{
    static const char *const name[] = {"GPIOA", "GPIOB", "GPIOC"};
    for (int n = 0; n < GPIO_PORTS; n++) {
        gpio->bank[n] = (gpio_bank_t){.chip = chip, .which = (gpio_port_t)n};
        board_registers_init(&gpio->bank[n].regs, chip->cpu, name[n], list[n], PORT_REGISTERS);
    }
}

void gpio_reset(gpio_t *gpio)
{
    for (int n = 0; n < GPIO_PORTS; n++) {
        board_registers_reset(&gpio->bank[n].regs);
    }
}

static uint32_t mode(const gpio_bank_t *bank, int number)
{
    return board_field(bank->regs.value[MODER / 4], 2 * number, 2);
}

bool gpio_connects(const gpio_t *gpio, gpio_pin_t pin)
{
    const gpio_bank_t *bank = &gpio->bank[pin.port];
    uint32_t functions = bank->regs.value[(pin.number < 8 ? AFRL : AFRH) / 4];
    return mode(bank, pin.number) == ALTERNATE &&
           (int)board_field(functions, 4 * (pin.number % 8), 4) == pin.function;
}

bool gpio_analog(const gpio_t *gpio, gpio_port_t port, int number)
{
    return mode(&gpio->bank[port], number) == ANALOG;
}

bool gpio_drives_high(const gpio_t *gpio, gpio_port_t port, int number)
{
    const gpio_bank_t *bank = &gpio->bank[port];
    return mode(bank, number) == OUTPUT && board_field(bank->regs.value[ODR / 4], number, 1) == 1u;
}

/* The board's: button to ground with a resistor to 3.3 V, break input, else the pull resistor. */
static bool outside(const gpio_bank_t *bank, int number)
{
    const board_wiring_t *wiring = &bank->chip->wiring;
    if (bank->which == PORT_C && number == 10) {
        return !wiring->button;
    }
    if (bank->which == PORT_A && number == 15) {
        return wiring->break_held;
    }
    return board_field(bank->regs.value[PUPDR / 4], 2 * number, 2) == PULL_UP;
}

static uint32_t levels(const gpio_bank_t *bank)
{
    uint32_t levels = 0u;
    for (int n = 0; n < 16; n++) {
        uint32_t is = mode(bank, n);
        bool high = is == OUTPUT ? board_field(bank->regs.value[ODR / 4], n, 1) == 1u : outside(bank, n);
        levels |= is != ANALOG && high ? 1u << n : 0u;
    }
    return levels;
}

static bool gpio_read(void *self, uint32_t offset, uint32_t *value)
{
    gpio_bank_t *bank = self;
    if (offset == IDR) {
        *value = levels(bank);
        return true;
    }
    return board_registers_read(&bank->regs, offset, value);
}

static bool gpio_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    gpio_bank_t *bank = self;
    if (!board_registers_write(&bank->regs, offset, value, mask)) {
        return false;
    }
    uint32_t *odr = board_register(&bank->regs, ODR);
    if (offset == BSRR || offset == BRR) {
        uint32_t meant = value & mask;
        uint32_t set = offset == BSRR ? meant & 0xFFFFu : 0u;
        uint32_t clear = offset == BSRR ? meant >> 16 : meant;
        *odr = (*odr & ~clear) | set; /* setting wins: RM0440 9.4.7 */
        *board_register(&bank->regs, offset) = 0u;
    }
    board_pins_changed(bank->chip);
    return true;
}

cpu_device_t gpio_device(gpio_t *gpio, gpio_port_t port)
{
    static const char *const name[] = {"GPIOA", "GPIOB", "GPIOC"};
    return (cpu_device_t){name[port], 0x48000000u + 0x400u * port, 0x400u, &gpio->bank[port], gpio_read,
                          gpio_write};
}
