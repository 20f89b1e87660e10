#include "sim_plant/board/tim1_break.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <stddef.h>

#define LOCK_1    0x000F70FFu /* BKF, AOE, BKP, BKE, DTG */
#define LOCK_2    0x00000C00u /* OSSR, OSSI */
#define BKE       0x1000u
#define BKINE     0x1u
#define COMPARE_S 17e-9 /* of COMP: DS12589 5.3.23, typical */

static const gpio_pin_t break_pin = {PORT_A, 15, 9};

double tim1_dead_time_s(const tim1_t *tim, double *step_s)
{
    uint32_t dtg = tim->regs.value[TIM1_BDTR / 4] & 0xFFu;
    double tick_s = 1.0 / tim->chip->rcc.clock_Hz;
    uint32_t unit = dtg < 128u ? 1u : (dtg < 192u ? 2u : (dtg < 224u ? 8u : 16u));
    uint32_t units = dtg < 128u ? dtg : (dtg < 192u ? 64u + dtg % 64u : 32u + dtg % 32u);
    *step_s = unit * tick_s;
    return units * unit * tick_s;
}

uint32_t tim1_lock(const tim1_t *tim, uint32_t offset, uint32_t value)
{
    uint32_t bdtr = tim->regs.value[TIM1_BDTR / 4];
    uint32_t level = board_field(bdtr, 8, 2);
    if (level == 0u) {
        return value;
    }
    if (offset == TIM1_BDTR) {
        uint32_t kept = 0x300u | LOCK_1 | (level >= 2u ? LOCK_2 : 0u);
        return (bdtr & kept) | (value & ~kept);
    }
    bool locked = offset == TIM1_AF1 || (level == 3u && (offset == TIM1_CCMR1 || offset == TIM1_CCMR2));
    return locked ? tim->regs.value[offset / 4] : value;
}

/* RM0440 table of BKF: samples at a share of the clock. */
static double filter_s(const tim1_t *tim)
{
    static const uint8_t samples[16] = {0, 2, 4, 8, 6, 8, 6, 8, 6, 8, 5, 6, 8, 5, 6, 8};
    static const uint8_t divider[16] = {1, 1, 1, 1, 2, 2, 4, 4, 8, 8, 16, 16, 16, 32, 32, 32};
    uint32_t bkf = board_field(tim->regs.value[TIM1_BDTR / 4], 16, 4);
    return (double)samples[bkf] * divider[bkf] / tim->chip->rcc.clock_Hz;
}

bool tim1_break_by_comparator(const tim1_t *tim, int leg, double *delay_s)
{
    static const uint32_t enable[BOARD_LEGS] = {0x2u, 0x4u, 0x10u}; /* COMP1, 2, 4 */
    *delay_s = COMPARE_S + filter_s(tim);
    return (tim->regs.value[TIM1_BDTR / 4] & BKE) != 0u &&
           (tim->regs.value[TIM1_AF1 / 4] & enable[leg]) != 0u;
}

static bool input_active(const tim1_t *tim)
{
    uint32_t bdtr = tim->regs.value[TIM1_BDTR / 4];
    uint32_t af1 = tim->regs.value[TIM1_AF1 / 4];
    bool high = (af1 & BKINE) != 0u && gpio_connects(&tim->chip->gpio, break_pin) &&
                (tim->chip->wiring.break_held || tim->pulsed);
    high = high || plant_break_held(tim->chip->plant);
    return (bdtr & BKE) != 0u && high == (board_field(bdtr, 13, 1) == 1u);
}

static void stop(tim1_t *tim, uint32_t flag)
{
    *board_register(&tim->regs, TIM1_SR) |= flag;
    *board_register(&tim->regs, TIM1_BDTR) &= ~TIM1_MOE;
    tim1_outputs(tim);
}

void tim1_check_break(tim1_t *tim)
{
    if (input_active(tim)) {
        stop(tim, TIM1_BIF);
    }
    const rcc_t *rcc = &tim->chip->rcc;
    bool system = rcc_failed(rcc) || board_misc_breaks(&tim->chip->misc, rcc_supply_low(rcc));
    if (system && (tim->regs.value[TIM1_BDTR / 4] & BKE) != 0u) {
        stop(tim, TIM1_SBIF);
    }
}

static void pulse_changes(void *owner, uint64_t cycle)
{
    tim1_t *tim = (tim1_t *)(void *)((char *)owner - offsetof(tim1_t, pulsed));
    tim->pulsed = !tim->pulsed;
    cpu_alarm(tim->chip->cpu, owner, tim->pulsed ? tim->pulse_end : UINT64_MAX, pulse_changes);
    (void)cycle;
    tim1_check_break(tim);
}

void tim1_pulse_break(tim1_t *tim, uint64_t cycle, uint64_t cycles)
{
    uint64_t filter = (uint64_t)lrint(filter_s(tim) * tim->chip->rcc.clock_Hz);
    bool passes = cycles >= filter && cycles > 0u;
    tim->pulsed = false;
    tim->pulse_end = cycle + filter + cycles;
    cpu_alarm(tim->chip->cpu, &tim->pulsed, passes ? cycle + filter : UINT64_MAX, pulse_changes);
}

void tim1_break(tim1_t *tim)
{
    if ((tim->regs.value[TIM1_BDTR / 4] & BKE) != 0u) {
        stop(tim, TIM1_BIF);
    }
}

void tim1_system_break(tim1_t *tim)
{
    tim1_check_break(tim);
}

void tim1_clear_flags(tim1_t *tim, uint32_t keep)
{
    *board_register(&tim->regs, TIM1_SR) &= keep;
    tim1_check_break(tim);
}

void tim1_write_bdtr(tim1_t *tim, uint32_t before)
{
    uint32_t *bdtr = board_register(&tim->regs, TIM1_BDTR);
    board_catch_up(tim->chip, cpu_now(tim->chip->cpu));
    if (((*bdtr ^ before) & ~TIM1_MOE) != 0u) {
        board_set_comparators(tim->chip);
    }
    tim1_check_break(tim); /* MOE does not rise while a break is active */
    tim1_outputs(tim);
}
