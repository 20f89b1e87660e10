#include "sim_plant/board/tim1.h"

#include "sim_plant/board/board_chip.h"
#include "sim_plant/board/tim1_break.h"
#include "sim_plant/board/tim1_outputs.h"

#include <math.h>
#include <stdint.h>

#define PERIOD_SAME 2.5e-4 /* half a count of the shortest period */

#define UG   0x1u
#define COMG 0x20u
#define BG   0x80u
#define CMS1 0x20u
#define ARPE 0x80u

#define UPDATE_IS_OUT 2u /* MMS */

static const board_register_t list[] = {
    {TIM1_CR1, "CR1", 0, TIM1_CEN | CMS1 | ARPE, 0x10u},
    {TIM1_CR2, "CR2", 0, 0x00F00070u | TIM1_CCUS | TIM1_CCPC, 0},
    {TIM1_SMCR, "SMCR", 0, 0x70u, 0},
    {TIM1_SR, "SR", 0, TIM1_UIF, TIM1_BIF | TIM1_SBIF},
    {TIM1_EGR, "EGR", 0, UG | COMG | BG, 0},
    {TIM1_CCMR1, "CCMR1", 0, 0x00007878u, 0},
    {TIM1_CCMR2, "CCMR2", 0, 0x00007878u, 0},
    {TIM1_CCER, "CCER", 0, 0x555u, 0},
    {TIM1_CNT, "CNT", 0, 0, 0},
    {TIM1_ARR, "ARR", 0xFFFFu, 0xFFFFu, 0},
    {TIM1_RCR, "RCR", 0, 0xFFFFu, 0},
    {TIM1_CCR1, "CCR1", 0, 0xFFFFu, 0},
    {TIM1_CCR2, "CCR2", 0, 0xFFFFu, 0},
    {TIM1_CCR3, "CCR3", 0, 0xFFFFu, 0},
    {TIM1_CCR4, "CCR4", 0, 0xFFFFu, 0},
    {TIM1_BDTR, "BDTR", 0, 0x000FBFFFu, 0},
    {TIM1_AF1, "AF1", 1u, 0x17u, 0},
};

static void trigger(void *owner, uint64_t cycle);

void tim1_init(tim1_t *tim, board_chip_t *chip)
{
    *tim = (tim1_t){.chip = chip};
    board_registers_init(&tim->regs, chip->cpu, "TIM1", list, sizeof list / sizeof *list);
}

void tim1_reset(tim1_t *tim)
{
    board_registers_reset(&tim->regs);
    tim->reload = 0xFFFFu;
    tim->repetitions = 0u;
    tim->counting = tim->frozen = tim->top = tim->armed_before = false;
    tim->update = UINT64_MAX;
    for (int n = 0; n < 4; n++) {
        tim->compare[n] = 0u;
    }
    tim->enables = tim->modes[0] = tim->modes[1] = 0u;
    cpu_alarm(tim->chip->cpu, tim, UINT64_MAX, trigger);
    tim->chip->wiring.in_step = false;
    tim1_outputs(tim);
}

bool tim1_counting(const tim1_t *tim)
{
    return tim->counting;
}

bool tim1_main_output(const tim1_t *tim)
{
    return (tim->regs.value[TIM1_BDTR / 4] & TIM1_MOE) != 0u && !tim->frozen;
}

uint64_t tim1_next_update(const tim1_t *tim)
{
    return tim->update;
}

uint32_t tim1_period(const tim1_t *tim)
{
    return (tim->regs.value[TIM1_RCR / 4] + 1u) * tim->reload;
}

bool tim1_follows_plant(const tim1_t *tim)
{
    double plant_s = 1.0 / plant_inverter(tim->chip->plant)->f_pwm_Hz;
    double period_s = (double)tim1_period(tim) / tim->chip->rcc.clock_Hz;
    return tim->counting && tim->top && tim->regs.value[TIM1_RCR / 4] == 1u &&
           fabs(period_s / plant_s - 1.0) <= PERIOD_SAME;
}

/* Counts since the underflow, within one carrier of 2 ARR. */
static uint64_t since_bottom(const tim1_t *tim, uint64_t cycle)
{
    uint64_t since = cycle - tim->extreme + (tim->top ? tim->reload : 0u);
    return since % (2u * (uint64_t)tim->reload);
}

static uint32_t count(const tim1_t *tim)
{
    if (!tim->counting) {
        return 0u;
    }
    uint32_t since = (uint32_t)since_bottom(tim, cpu_now(tim->chip->cpu));
    return since <= tim->reload ? since : 2u * tim->reload - since;
}

/* The rising edge of OC4REF: on the way up in mode 2, on the way down in mode 1. */
static void plan_trigger(tim1_t *tim, uint64_t after)
{
    uint32_t at = tim->compare[3];
    uint64_t cycle = UINT64_MAX;
    if (tim->counting && at > 0u && at <= tim->reload &&
        (tim1_mode(tim, 3) == TIM1_PWM_1 || tim1_mode(tim, 3) == TIM1_PWM_2)) {
        uint64_t carrier = 2u * (uint64_t)tim->reload;
        uint64_t edge = tim1_mode(tim, 3) == TIM1_PWM_2 ? at : carrier - at;
        cycle = after + (edge + carrier - since_bottom(tim, after)) % carrier;
        cycle += cycle == after ? carrier : 0u;
    }
    cpu_alarm(tim->chip->cpu, tim, cycle, trigger);
}

static void trigger(void *owner, uint64_t cycle)
{
    tim1_t *tim = owner;
    if (board_field(tim->regs.value[TIM1_CR2 / 4], 20, 4) == 7u) {
        adc_trigger(&tim->chip->adc, cycle, ADC_BY_TIM1, true);
    }
    plan_trigger(tim, cycle);
}

void tim1_check_carrier(const tim1_t *tim)
{
    const plant_inverter_t *inverter = plant_inverter(tim->chip->plant);
    if (!tim1_follows_plant(tim) || tim->reload != inverter->timer_counts) {
        cpu_fail(
            tim->chip->cpu,
            "TIM1 is armed with ARR %u, RCR %u and update events at %s: the plant wants %.6g Hz of %u counts "
            "and overflows",
            (unsigned)tim->reload, (unsigned)tim->regs.value[TIM1_RCR / 4],
            tim->top ? "overflows" : "underflows", inverter->f_pwm_Hz, (unsigned)inverter->timer_counts);
    }
}

static void load(tim1_t *tim)
{
    tim->reload = tim->regs.value[TIM1_ARR / 4];
    tim->repetitions = tim->regs.value[TIM1_RCR / 4];
    for (int n = 0; n < 4; n++) {
        tim->compare[n] = tim->regs.value[TIM1_CCR1 / 4 + n];
    }
    *board_register(&tim->regs, TIM1_SR) |= TIM1_UIF;
}

void tim1_update(tim1_t *tim)
{
    uint64_t halves = (tim->update - tim->extreme) / tim->reload;
    bool changed = tim->compare[3] != tim->regs.value[TIM1_CCR4 / 4];
    if (tim->regs.value[TIM1_ARR / 4] != tim->reload) {
        cpu_fail(tim->chip->cpu, "TIM1_ARR: changes while counting are not modelled");
    }
    tim->top = halves % 2u == 1u ? !tim->top : tim->top;
    tim->extreme = tim->update;
    load(tim);
    tim->update = tim->extreme + (tim->repetitions + 1u) * (uint64_t)tim->reload;
    if (changed) {
        plan_trigger(tim, tim->extreme);
    }
    if (board_field(tim->regs.value[TIM1_CR2 / 4], 4, 3) == UPDATE_IS_OUT) {
        tim3_restart(&tim->chip->tim3, tim->extreme, tim->update);
        tim4_restart(&tim->chip->tim4, tim->extreme, tim->update);
    }
    if (tim->updates++ == 0u && tim1_main_output(tim)) {
        tim1_check_carrier(tim);
    }
}

void tim1_freeze(tim1_t *tim, bool frozen)
{
    tim->frozen = frozen;
    tim1_outputs(tim);
}

static void start(tim1_t *tim)
{
    cpu_t *cpu = tim->chip->cpu;
    uint32_t cr1 = tim->regs.value[TIM1_CR1 / 4];
    if ((cr1 & CMS1) == 0u || (cr1 & ARPE) == 0u) {
        cpu_fail(cpu, "TIM1_CR1: counts other than centre-aligned 1 with preload are not modelled");
        return;
    }
    if (tim->reload != tim->regs.value[TIM1_ARR / 4] || tim->reload == 0u) {
        cpu_fail(cpu, "TIM1: started without an update event that loads ARR");
        return;
    }
    tim->counting = true;
    tim->top = false;
    tim->updates = 0u;
    tim->extreme = cpu_now(cpu);
    tim->update = tim->extreme + (tim->repetitions + 1u) * (uint64_t)tim->reload;
    plan_trigger(tim, tim->extreme);
}

static bool tim1_read(void *self, uint32_t offset, uint32_t *value)
{
    tim1_t *tim = self;
    if (offset == TIM1_SR || offset == TIM1_BDTR) {
        board_catch_up(tim->chip, cpu_now(tim->chip->cpu));
        tim1_check_break(tim);
    }
    *board_register(&tim->regs, TIM1_CNT) = count(tim);
    return board_registers_read(&tim->regs, offset, value);
}

static void write_cr1(tim1_t *tim, uint32_t before)
{
    uint32_t now = tim->regs.value[TIM1_CR1 / 4];
    if ((before & TIM1_CEN) != 0u && now != before) {
        cpu_fail(tim->chip->cpu, "TIM1_CR1: changes while counting are not modelled");
    } else if ((now & ~before & TIM1_CEN) != 0u) {
        start(tim);
    }
}

/* Events by software: an update, a commutation, a break. */
static void generate(tim1_t *tim)
{
    uint32_t events = tim->regs.value[TIM1_EGR / 4];
    *board_register(&tim->regs, TIM1_EGR) = 0u;
    if ((events & BG) != 0u) {
        tim1_break(tim);
    }
    if ((events & COMG) != 0u && tim1_waits_for_com(tim)) {
        tim1_commutate(tim);
    }
    if ((events & UG) != 0u) {
        if (tim->counting) {
            cpu_fail(tim->chip->cpu, "TIM1_EGR: update by software while counting is not modelled");
        }
        load(tim);
    }
}

static bool tim1_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    tim1_t *tim = self;
    uint32_t before = offset / 4 < BOARD_REGISTERS_MOST ? tim->regs.value[offset / 4] : 0u;
    value = tim1_lock(tim, offset, value);
    if (offset == TIM1_SR) {
        tim1_clear_flags(tim, value | ~mask);
        return true;
    }
    if (!board_registers_write(&tim->regs, offset, value, mask)) {
        return false;
    }
    switch (offset) {
    case TIM1_CR1:
        write_cr1(tim, before);
        break;
    case TIM1_EGR:
        generate(tim);
        break;
    case TIM1_CCMR1:
    case TIM1_CCMR2:
        tim1_write_modes(tim, offset, before);
        break;
    case TIM1_CR2:
        if (tim->counting && tim->regs.value[offset / 4] != before) {
            cpu_fail(tim->chip->cpu, "TIM1: change of modes while counting is not modelled");
        }
        break;
    case TIM1_CCER:
        if (!tim1_waits_for_com(tim) && tim->regs.value[TIM1_CCER / 4] != before) {
            tim1_commutate(tim);
        }
        break;
    case TIM1_BDTR:
        tim1_write_bdtr(tim, before);
        break;
    case TIM1_AF1:
        board_set_comparators(tim->chip);
        tim1_check_break(tim);
        break;
    default:
        if (offset >= TIM1_CCR1 && offset <= TIM1_CCR4 &&
            !tim1_preloaded(tim, (int)(offset - TIM1_CCR1) / 4)) {
            cpu_fail(tim->chip->cpu, "TIM1_CCR: compare values without preload are not modelled");
        }
        break;
    }
    return true;
}

cpu_device_t tim1_device(tim1_t *tim)
{
    return (cpu_device_t){"TIM1", 0x40012C00u, 0x400u, tim, tim1_read, tim1_write};
}
