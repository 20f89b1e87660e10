#include "sim_plant/board/tim4.h"

#include "sim_plant/board/board_chip.h"

enum { CR1 = 0x00, CR2 = 0x04, SMCR = 0x08, EGR = 0x14, CCMR1 = 0x18, CNT = 0x24, ARR = 0x2C, CCR1 = 0x34 };

#define CEN       0x1u
#define OC1REF    0x40u /* of MMS */
#define RESET_BY  0x04u /* SMCR: reset mode, trigger ITR0, which is TIM1 */
#define PWM_1_PRE 0x68u /* CCMR1: PWM mode 1 with preload */

static const board_register_t list[] = {
    {CR1, "CR1", 0, CEN, 0},           {CR2, "CR2", 0, 0x70u, 0},     {SMCR, "SMCR", 0, 0x77u, 0},
    {EGR, "EGR", 0, 0x1u, 0},          {CCMR1, "CCMR1", 0, 0x78u, 0}, {CNT, "CNT", 0, 0, 0},
    {ARR, "ARR", 0xFFFFu, 0xFFFFu, 0}, {CCR1, "CCR1", 0, 0xFFFFu, 0},
};

void tim4_init(tim4_t *tim, board_chip_t *chip)
{
    *tim = (tim4_t){.chip = chip};
    board_registers_init(&tim->regs, chip->cpu, "TIM4", list, sizeof list / sizeof *list);
}

static void falls(void *owner, uint64_t cycle)
{
    tim4_t *tim = owner;
    cpu_alarm(tim->chip->cpu, tim, UINT64_MAX, falls);
    tim->high = false;
    adc_trigger(&tim->chip->adc, cycle, ADC_BY_TIM4, false);
}

void tim4_reset(tim4_t *tim)
{
    board_registers_reset(&tim->regs);
    tim->high = false;
    cpu_alarm(tim->chip->cpu, tim, UINT64_MAX, falls);
}

/* Channel 1 is high below CCR1: with 0 never, and without an edge between two periods that it is high throughout. */
void tim4_restart(tim4_t *tim, uint64_t cycle, uint64_t next)
{
    const uint32_t *value = tim->regs.value;
    if ((value[CR1 / 4] & CEN) == 0u) {
        return;
    }
    if (value[CR2 / 4] != OC1REF || value[SMCR / 4] != RESET_BY || value[CCMR1 / 4] != PWM_1_PRE) {
        cpu_fail(tim->chip->cpu, "TIM4 runs in a mode that is not modelled");
        return;
    }
    const uint64_t edge = cycle + value[CCR1 / 4];
    const bool was_high = tim->high;
    tim->since = cycle;
    tim->high = value[CCR1 / 4] != 0u;
    cpu_alarm(tim->chip->cpu, tim, tim->high && edge < next ? edge : UINT64_MAX, falls);
    if (tim->high != was_high) {
        adc_trigger(&tim->chip->adc, cycle, ADC_BY_TIM4, tim->high);
    }
}

static bool tim4_read(void *self, uint32_t offset, uint32_t *value)
{
    tim4_t *tim = self;
    const bool counts = (tim->regs.value[CR1 / 4] & CEN) != 0u;
    *board_register(&tim->regs, CNT) =
        counts ? (uint32_t)((cpu_now(tim->chip->cpu) - tim->since) & 0xFFFFu) : 0u;
    return board_registers_read(&tim->regs, offset, value);
}

static bool tim4_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    tim4_t *tim = self;
    const bool counted = (tim->regs.value[CR1 / 4] & CEN) != 0u;
    bool known = board_registers_write(&tim->regs, offset, value, mask);
    *board_register(&tim->regs, EGR) = 0u;
    if (!counted) {
        tim->since = cpu_now(tim->chip->cpu);
    }
    return known;
}

cpu_device_t tim4_device(tim4_t *tim)
{
    return (cpu_device_t){"TIM4", 0x40000800u, 0x400u, tim, tim4_read, tim4_write};
}
