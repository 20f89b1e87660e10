#include "sim_plant/board/tim1_outputs.h"

#include "sim_plant/board/board_chip.h"
#include "sim_plant/board/tim1_break.h"

#include <math.h>
#include <stdint.h>

#define OSSR 0x800u
#define OC4  0xFF00u /* in CCMR2 */
#define ITR2 2u      /* TS: TIM3 */

#define FORCED_LOW  4u
#define FORCED_HIGH 5u

static const gpio_pin_t pin[BOARD_LEGS][2] = {
    {{PORT_A, 8, 6}, {PORT_C, 13, 4}},
    {{PORT_A, 9, 6}, {PORT_A, 12, 6}},
    {{PORT_A, 10, 6}, {PORT_B, 15, 4}},
};

uint32_t tim1_mode(const tim1_t *tim, int channel)
{
    return board_field(tim->modes[channel / 2], 4 + 8 * (channel % 2), 3);
}

bool tim1_preloaded(const tim1_t *tim, int channel)
{
    uint32_t ccmr = tim->regs.value[(channel < 2 ? TIM1_CCMR1 : TIM1_CCMR2) / 4];
    return board_field(ccmr, 3 + 8 * (channel % 2), 1) == 1u;
}

/* What the plant has to follow, on every rise of the main output; the carrier from the first update event on. */
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
        tim1_check_carrier(tim);
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
    if (!tim1_preloaded(tim, leg)) {
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
        {5u, TIM1_PWM_1, PLANT_LEG_PWM},
        {1u, TIM1_PWM_1, PLANT_LEG_UPPER},
        {4u, TIM1_PWM_2, PLANT_LEG_LOWER},
        {5u, FORCED_HIGH, PLANT_LEG_HIGH},
        {5u, FORCED_LOW, PLANT_LEG_LOW},
        {5u, TIM1_PWM_2, PLANT_LEG_INVERTED},
        {4u, TIM1_PWM_1, PLANT_LEG_LOWER_INVERTED},
    };
    const uint32_t enables = board_field(tim->enables, 4 * leg, 3);
    for (size_t n = 0; n < sizeof known / sizeof *known; n++) {
        if (known[n].enables == enables && known[n].mode == tim1_mode(tim, leg)) {
            return known[n].state;
        }
    }
    cpu_fail(tim->chip->cpu, "TIM1: outputs %u of channel %d in mode %u are not modelled", (unsigned)enables,
             leg + 1, (unsigned)tim1_mode(tim, leg));
    return PLANT_LEG_PWM;
}

/* Without the dead-time generator between them one switch would close while the other opens. */
static void check_change(const tim1_t *tim, int leg, plant_leg_state_t to)
{
    const plant_leg_state_t from = tim->chip->wiring.state[leg];
    const bool upper = from == PLANT_LEG_UPPER || from == PLANT_LEG_HIGH;
    const bool lower = from == PLANT_LEG_LOWER || from == PLANT_LEG_LOWER_INVERTED;
    const bool unsafe = (upper && (to == PLANT_LEG_LOWER || to == PLANT_LEG_LOWER_INVERTED)) ||
                        (from == PLANT_LEG_LOW && to == PLANT_LEG_UPPER) ||
                        (lower && (to == PLANT_LEG_UPPER || to == PLANT_LEG_HIGH));
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

bool tim1_waits_for_com(const tim1_t *tim)
{
    return (tim->regs.value[TIM1_CR2 / 4] & TIM1_CCPC) != 0u;
}

void tim1_commutate(tim1_t *tim)
{
    tim->enables = tim->regs.value[TIM1_CCER / 4];
    tim->modes[0] = tim->regs.value[TIM1_CCMR1 / 4];
    tim->modes[1] = tim->regs.value[TIM1_CCMR2 / 4];
    tim1_outputs(tim);
}

void tim1_triggered(tim1_t *tim)
{
    const bool com = (tim->regs.value[TIM1_CR2 / 4] & TIM1_CCUS) != 0u;
    if (com && tim1_waits_for_com(tim) && board_field(tim->regs.value[TIM1_SMCR / 4], 4, 3) == ITR2) {
        tim1_commutate(tim);
    }
}

void tim1_write_modes(tim1_t *tim, uint32_t offset, uint32_t before)
{
    const uint32_t now = tim->regs.value[offset / 4];
    const bool waits = tim1_waits_for_com(tim);
    const uint32_t at_once = !waits ? UINT32_MAX : offset == TIM1_CCMR2 ? OC4 : 0u;
    if (tim->counting && ((now ^ before) & at_once) != 0u) {
        cpu_fail(tim->chip->cpu, "TIM1: change of modes while counting is not modelled");
    }
    uint32_t *mode = &tim->modes[offset == TIM1_CCMR2 ? 1 : 0];
    *mode = (*mode & ~at_once) | (now & at_once);
}
