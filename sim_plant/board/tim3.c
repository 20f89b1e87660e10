#include "sim_plant/board/tim3.h"

#include "sim_plant/board/board_chip.h"

enum { CR1 = 0x00, CR2 = 0x04, SMCR = 0x08, EGR = 0x14, CCMR1 = 0x18, ARR = 0x2C, CCR1 = 0x34 };

#define CEN       0x1u
#define OC1REF    0x40u /* of MMS */
#define RESET_BY  0x04u /* SMCR: reset mode, trigger ITR0, which is TIM1 */
#define PWM_2_PRE 0x78u /* CCMR1: PWM mode 2 with preload */

static const board_register_t list[] = {
    {CR1, "CR1", 0, CEN, 0},       {CR2, "CR2", 0, 0x70u, 0},     {SMCR, "SMCR", 0, 0x77u, 0},
    {EGR, "EGR", 0, 0x1u, 0},      {CCMR1, "CCMR1", 0, 0x78u, 0}, {ARR, "ARR", 0xFFFFu, 0xFFFFu, 0},
    {CCR1, "CCR1", 0, 0xFFFFu, 0},
};

void tim3_init(tim3_t *tim, board_chip_t *chip)
{
    *tim = (tim3_t){.chip = chip};
    board_registers_init(&tim->regs, chip->cpu, "TIM3", list, sizeof list / sizeof *list);
}

static void due(void *owner, uint64_t cycle)
{
    tim3_t *tim = owner;
    cpu_alarm(tim->chip->cpu, tim, UINT64_MAX, due);
    tim1_triggered(&tim->chip->tim1);
    (void)cycle;
}

void tim3_reset(tim3_t *tim)
{
    board_registers_reset(&tim->regs);
    cpu_alarm(tim->chip->cpu, tim, UINT64_MAX, due);
}

/* Channel 1 is high from CCR1 on: with 0 always, so that it has no edge. */
void tim3_restart(tim3_t *tim, uint64_t cycle, uint64_t next)
{
    const uint32_t *value = tim->regs.value;
    if ((value[CR1 / 4] & CEN) == 0u) {
        return;
    }
    if (value[CR2 / 4] != OC1REF || value[SMCR / 4] != RESET_BY || value[CCMR1 / 4] != PWM_2_PRE) {
        cpu_fail(tim->chip->cpu, "TIM3 runs in a mode that is not modelled");
        return;
    }
    const uint64_t edge = cycle + value[CCR1 / 4];
    const bool comes = value[CCR1 / 4] != 0u && value[CCR1 / 4] <= value[ARR / 4] && edge < next;
    cpu_alarm(tim->chip->cpu, tim, comes ? edge : UINT64_MAX, due);
}

static bool tim3_read(void *self, uint32_t offset, uint32_t *value)
{
    tim3_t *tim = self;
    return board_registers_read(&tim->regs, offset, value);
}

static bool tim3_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    tim3_t *tim = self;
    bool known = board_registers_write(&tim->regs, offset, value, mask);
    *board_register(&tim->regs, EGR) = 0u;
    return known;
}

cpu_device_t tim3_device(tim3_t *tim)
{
    return (cpu_device_t){"TIM3", 0x40000400u, 0x400u, tim, tim3_read, tim3_write};
}
