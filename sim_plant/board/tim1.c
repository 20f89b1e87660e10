#include "sim_plant/board/tim1.h"

#include "sim_plant/board/board_chip.h"
#include "sim_plant/board/tim1_break.h"

#include <math.h>
#include <stdint.h>

#define PERIOD_SAME 2.5e-4 /* half a count of the shortest period */

#define UG   0x1u
#define COMG 0x20u
#define BG   0x80u
#define CCPC 0x1u
#define CCUS 0x4u
#define OSSR 0x800u
#define CMS1 0x20u
#define ARPE 0x80u

#define FORCED_LOW  4u
#define FORCED_HIGH 5u
#define PWM_1       6u
#define PWM_2       7u

#define OC4           0xFF00u /* in CCMR2 */
#define UPDATE_IS_OUT 2u      /* MMS */
#define ITR2          2u      /* TS: TIM3 */

static const board_register_t list[] = {
    {TIM1_CR1, "CR1", 0, TIM1_CEN | CMS1 | ARPE, 0x10u},
    {TIM1_CR2, "CR2", 0, 0x00F00070u | CCUS | CCPC, 0},
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

static const gpio_pin_t pin[BOARD_LEGS][2] = {
    {{PORT_A, 8, 6}, {PORT_C, 13, 4}},
    {{PORT_A, 9, 6}, {PORT_A, 12, 6}},
    {{PORT_A, 10, 6}, {PORT_B, 15, 4}},
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

static uint32_t mode(const tim1_t *tim, int channel)
{
    return board_field(tim->modes[channel / 2], 4 + 8 * (channel % 2), 3);
}

static bool preloaded(const tim1_t *tim, int channel)
{
    uint32_t ccmr = tim->regs.value[(channel < 2 ? TIM1_CCMR1 : TIM1_CCMR2) / 4];
    return board_field(ccmr, 3 + 8 * (channel % 2), 1) == 1u;
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
    if (tim->counting && at > 0u && at <= tim->reload && (mode(tim, 3) == PWM_1 || mode(tim, 3) == PWM_2)) {
        uint64_t carrier = 2u * (uint64_t)tim->reload;
        uint64_t edge = mode(tim, 3) == PWM_2 ? at : carrier - at;
        cycle = after + (edge + carrier - since_bottom(tim, after)) % carrier;
        cycle += cycle == after ? carrier : 0u;
    }
    cpu_alarm(tim->chip->cpu, tim, cycle, trigger);
}

static void trigger(void *owner, uint64_t cycle)
{
    tim1_t *tim = owner;
    if (board_field(tim->regs.value[TIM1_CR2 / 4], 20, 4) == 7u) {
        adc_trigger(&tim->chip->adc, cycle);
    }
    plan_trigger(tim, cycle);
}

static void check_carrier(const tim1_t *tim)
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

/* What the plant has to follow, on every rise of the main output; the carrier from the first update event on.
 */
static void check_arming(const tim1_t *tim)
{
    const plant_inverter_t *inverter = plant_inverter(tim->chip->plant);
    double step_s = 0.0;
    double dead_s = tim1_dead_time_s(tim, &step_s);
    if (fabs(dead_s - inverter->dead_time_s) > 1.001 * step_s) {
        cpu_fail(tim->chip->cpu, "TIM1_BDTR: dead time %.1f ns, the plant's is %.1f ns", 1e9 * dead_s,
                 1e9 * inverter->dead_time_s);
    }
    if (tim->updates > 0u) {
        check_carrier(tim);
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
    }
    if (tim->updates++ == 0u && tim1_main_output(tim)) {
        check_carrier(tim);
    }
}

static void check_leg(const tim1_t *tim, int leg)
{
    cpu_t *cpu = tim->chip->cpu;
    for (int n = 0; n < 2; n++) {
        if (!gpio_connects(&tim->chip->gpio, pin[leg][n])) {
            cpu_fail(cpu, "TIM1: channel %d%s is driven, but P%c%d is not its pin (AF%d)", leg + 1,
                     n == 1 ? "N" : "", 'A' + (int)pin[leg][n].port, pin[leg][n].number,
                     pin[leg][n].function);
        }
    }
    if (!preloaded(tim, leg)) {
        cpu_fail(cpu, "TIM1: channel %d is driven without preload", leg + 1);
    }
    if ((tim->regs.value[TIM1_BDTR / 4] & OSSR) == 0u && board_field(tim->enables, 4 * leg, 3) != 5u) {
        cpu_fail(cpu, "TIM1: channel %d leaves a gate without a level (OSSR)", leg + 1);
    }
}

/* RM0440 28.3.17: with both outputs on they are complementary, with dead time; one alone follows OCxREF without, OCxN as
 * well, so that mode 2 has the lower switch on where mode 1 has the upper one off. */
static plant_leg_state_t state_of(const tim1_t *tim, int leg)
{
    static const struct {
        uint32_t enables, mode;
        plant_leg_state_t state;
    } known[] = {
        {5u, PWM_1, PLANT_LEG_PWM},        {1u, PWM_1, PLANT_LEG_UPPER},    {4u, PWM_2, PLANT_LEG_LOWER},
        {5u, FORCED_HIGH, PLANT_LEG_HIGH}, {5u, FORCED_LOW, PLANT_LEG_LOW},
    };
    const uint32_t enables = board_field(tim->enables, 4 * leg, 3);
    for (size_t n = 0; n < sizeof known / sizeof *known; n++) {
        if (known[n].enables == enables && known[n].mode == mode(tim, leg)) {
            return known[n].state;
        }
    }
    cpu_fail(tim->chip->cpu, "TIM1: outputs %u of channel %d in mode %u are not modelled", (unsigned)enables,
             leg + 1, (unsigned)mode(tim, leg));
    return PLANT_LEG_PWM;
}

/* Without the dead-time generator between them one switch would close while the other opens. */
static void check_change(const tim1_t *tim, int leg, plant_leg_state_t to)
{
    const plant_leg_state_t from = tim->chip->wiring.state[leg];
    const bool upper = from == PLANT_LEG_UPPER || from == PLANT_LEG_HIGH;
    const bool unsafe = (upper && to == PLANT_LEG_LOWER) ||
                        (from == PLANT_LEG_LOW && to == PLANT_LEG_UPPER) ||
                        (from == PLANT_LEG_LOWER && (to == PLANT_LEG_UPPER || to == PLANT_LEG_HIGH));
    if (unsafe && tim->chip->wiring.driven[leg]) {
        cpu_fail(tim->chip->cpu, "TIM1: channel %d goes from one switch to the other without dead time",
                 leg + 1);
    }
}

void tim1_outputs(tim1_t *tim)
{
    bool driven[BOARD_LEGS];
    plant_leg_state_t state[BOARD_LEGS] = {PLANT_LEG_PWM};
    bool on = tim1_main_output(tim);
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        driven[leg] = on && board_field(tim->enables, 4 * leg, 3) != 0u;
        if (driven[leg]) {
            state[leg] = state_of(tim, leg);
            check_leg(tim, leg);
            check_change(tim, leg, state[leg]);
        }
    }
    if (on && !tim->armed_before) {
        check_arming(tim);
    }
    tim->armed_before = on;
    board_drive(tim->chip, driven, state);
}

static bool waits_for_com(const tim1_t *tim)
{
    return (tim->regs.value[TIM1_CR2 / 4] & CCPC) != 0u;
}

/* What CCER and CCMR say of the legs takes effect. */
static void commutate(tim1_t *tim)
{
    tim->enables = tim->regs.value[TIM1_CCER / 4];
    tim->modes[0] = tim->regs.value[TIM1_CCMR1 / 4];
    tim->modes[1] = tim->regs.value[TIM1_CCMR2 / 4];
    tim1_outputs(tim);
}

void tim1_triggered(tim1_t *tim)
{
    const bool com = (tim->regs.value[TIM1_CR2 / 4] & CCUS) != 0u;
    if (com && waits_for_com(tim) && board_field(tim->regs.value[TIM1_SMCR / 4], 4, 3) == ITR2) {
        commutate(tim);
    }
}

static void write_modes(tim1_t *tim, uint32_t offset, uint32_t before)
{
    const uint32_t now = tim->regs.value[offset / 4];
    const bool waits = waits_for_com(tim);
    const uint32_t at_once = !waits ? UINT32_MAX : offset == TIM1_CCMR2 ? OC4 : 0u;
    if (tim->counting && ((now ^ before) & at_once) != 0u) {
        cpu_fail(tim->chip->cpu, "TIM1: change of modes while counting is not modelled");
    }
    uint32_t *mode = &tim->modes[offset == TIM1_CCMR2 ? 1 : 0];
    *mode = (*mode & ~at_once) | (now & at_once);
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
    if ((events & COMG) != 0u && waits_for_com(tim)) {
        commutate(tim);
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
        write_modes(tim, offset, before);
        break;
    case TIM1_CR2:
        if (tim->counting && tim->regs.value[offset / 4] != before) {
            cpu_fail(tim->chip->cpu, "TIM1: change of modes while counting is not modelled");
        }
        break;
    case TIM1_CCER:
        if (!waits_for_com(tim) && tim->regs.value[TIM1_CCER / 4] != before) {
            commutate(tim);
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
        if (offset >= TIM1_CCR1 && offset <= TIM1_CCR4 && !preloaded(tim, (int)(offset - TIM1_CCR1) / 4)) {
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
