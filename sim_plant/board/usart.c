#include "sim_plant/board/usart.h"

#include "sim_plant/board/board_chip.h"

#include <stdint.h>
#include <stdlib.h>

#define IRQ       38
#define UE        0x01u
#define TE        0x08u
#define TCIE      0x40u
#define TXEIE     0x80u
#define TC        0x40u
#define TXE       0x80u
#define TEACK     0x00200000u
#define BITS      10u
#define BRR_LEAST 16u

enum { CR1 = 0x00, BRR = 0x0C, ISR = 0x1C, TDR = 0x28 };

static const board_register_t list[] = {
    {CR1, "CR1", 0, UE | TE | TCIE | TXEIE, 0},
    {BRR, "BRR", 0, 0xFFFFu, 0},
    {ISR, "ISR", TC | TXE, 0, 0},
    {TDR, "TDR", 0, 0xFFu, 0},
};

static const gpio_pin_t tx = {PORT_B, 3, 7};

void usart_init(usart_t *usart, board_chip_t *chip)
{
    *usart = (usart_t){.chip = chip, .room = 256};
    usart->text = calloc(1, usart->room);
    board_registers_init(&usart->regs, chip->cpu, "USART2", list, sizeof list / sizeof *list);
}

void usart_free(usart_t *usart)
{
    free(usart->text);
}

static void byte_sent(void *owner, uint64_t cycle);

void usart_reset(usart_t *usart)
{
    board_registers_reset(&usart->regs);
    usart->shifting = usart->waiting = false;
    cpu_alarm(usart->chip->cpu, usart, UINT64_MAX, byte_sent);
    cpu_irq(usart->chip->cpu, IRQ, false);
}

static void signal_state(usart_t *usart)
{
    uint32_t cr1 = usart->regs.value[CR1 / 4];
    bool on = (cr1 & UE) != 0u && (cr1 & TE) != 0u;
    uint32_t isr =
        (usart->waiting ? 0u : TXE) | (usart->shifting || usart->waiting ? 0u : TC) | (on ? TEACK : 0u);
    *board_register(&usart->regs, ISR) = isr;
    cpu_irq(usart->chip->cpu, IRQ, on && ((cr1 & TXEIE & isr) != 0u || (cr1 & TCIE & isr) != 0u));
}

static void shift_out(usart_t *usart, uint64_t cycle)
{
    usart->shifting = true;
    usart->waiting = false;
    usart->shifted = usart->next;
    cpu_alarm(usart->chip->cpu, usart, cycle + (uint64_t)BITS * usart->regs.value[BRR / 4], byte_sent);
}

static void keep(usart_t *usart, char byte)
{
    if (usart->length + 2 > usart->room) {
        char *more = realloc(usart->text, 2 * usart->room);
        if (!more) {
            return;
        }
        usart->text = more;
        usart->room *= 2;
    }
    usart->text[usart->length++] = byte;
    usart->text[usart->length] = '\0';
}

static void byte_sent(void *owner, uint64_t cycle)
{
    usart_t *usart = owner;
    usart->shifting = false;
    if (gpio_connects(&usart->chip->gpio, tx)) {
        keep(usart, (char)usart->shifted);
    } else {
        cpu_fail(usart->chip->cpu, "USART2 sends, but PB3 is not its pin (AF7)");
    }
    if (usart->waiting) {
        shift_out(usart, cycle);
    }
    signal_state(usart);
}

static bool usart_read(void *self, uint32_t offset, uint32_t *value)
{
    usart_t *usart = self;
    return board_registers_read(&usart->regs, offset, value);
}

static bool usart_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    usart_t *usart = self;
    cpu_t *cpu = usart->chip->cpu;
    bool was_on = (usart->regs.value[CR1 / 4] & UE) != 0u;
    uint32_t before = usart->regs.value[BRR / 4];
    if (!board_registers_write(&usart->regs, offset, value, mask)) {
        return false;
    }
    uint32_t cr1 = usart->regs.value[CR1 / 4];
    uint32_t divider = usart->regs.value[BRR / 4];
    if (offset == BRR && was_on && divider != before) {
        cpu_fail(cpu, "USART2_BRR: write while it is enabled");
    }
    if (offset == CR1 && (cr1 & UE) != 0u && divider < BRR_LEAST) {
        cpu_fail(cpu, "USART2_BRR: %u is less than 16", (unsigned)divider);
    }
    if (offset == TDR) {
        if ((cr1 & UE) == 0u || (cr1 & TE) == 0u || usart->waiting) {
            cpu_fail(cpu, "USART2_TDR: write while %s",
                     usart->waiting ? "it is full" : "the transmitter is off");
            return true;
        }
        usart->next = (uint8_t)value;
        usart->waiting = true;
        if (!usart->shifting) {
            shift_out(usart, cpu_now(cpu));
        }
    }
    signal_state(usart);
    return true;
}

cpu_device_t usart_device(usart_t *usart)
{
    return (cpu_device_t){"USART2", 0x40004400u, 0x400u, usart, usart_read, usart_write};
}
