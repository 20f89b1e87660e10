#include "bldc/six_step.h"

#include "firmware/params/maker.h"

#define RAIL_mV   350
#define STEPS     16   /* of the neutral's converter, */
#define CONVERTER 2048 /* steps of half its range */

static uint16_t counts(maker_t *m, drive_param_id_t id)
{
    const pm_num_t per_s = pm_num_mul(pm_num(2 * m->params->timer_counts), si(m, DRIVE_PARAM_f_pwm));
    return (uint16_t)pm_min(fixed(m, pm_num_mul(si(m, id), per_s), 0, id), UINT16_MAX);
}

/* What low-side shunts see. */
static void make_shunts(maker_t *m, pattern_config_t *c)
{
    const int32_t hidden = PM_SHARE_ONE - seen_on_time(m);
    const int32_t high = PM_SHARE_ONE - (pattern_chops_both(c->id) ? 2 : 1) * hidden;
    const bool high_alone = c->id == PATTERN_H_PWM_L_PWM;
    c->low_side = m->params->t_settle != 0;
    c->shown = pm_shl(high, Q_BITS - PM_SHARE_BITS);
    c->most = high_alone ? c->shown : PM_ONE;
    if (c->low_side && high_alone) {
        c->shown = -1;
    }
    if (c->low_side && pattern_holds_high(c->id)) {
        refuse(m, DRIVE_PARAM_pattern,
               "holds an upper switch closed, where low-side shunts see no current: use 0, 1 or 5");
    }
}

static void make_pattern(maker_t *m, pattern_config_t *c)
{
    const drive_params_t *p = m->params;
    c->id = (pattern_id_t)p->pattern;
    c->complementary = p->freewheeling != 0;
    c->half_period = (uint16_t)p->timer_counts;
    c->lead = (uint16_t)pm_max(counts(m, DRIVE_PARAM_t_lead), 1);
    const int32_t blind = c->lead + counts(m, DRIVE_PARAM_t_blank) + counts(m, DRIVE_PARAM_dead_time);
    if (blind >= p->timer_counts) {
        refuse(m, DRIVE_PARAM_t_blank, "with t_lead and dead_time beyond half a period");
    }
    c->least = (uint16_t)pm_min(blind, p->timer_counts);
    make_shunts(m, c);
    require(m, c->complementary ? 0U : NEEDS_ONE_SWITCH, DRIVE_PARAM_freewheeling);
    require(m, c->id == PATTERN_H_PWM_L_PWM ? NEEDS_ONE_SWITCH : 0U, DRIVE_PARAM_pattern);
}

/* What the open terminal rises by, per psi_m w and rad, times pi / 3. */
static pm_num_t swing_of_terminal(const maker_t *m)
{
    const pm_num_t pi_third = pm_num_mul(PM_NUM_TWO_PI, pm_num_ratio(1, 6));
    const pm_num_t sine = pm_num_ratio(3, 2), trapezoid = pm_num_mul(PM_NUM_TWO_PI, pm_num_ratio(1, 4));
    const pm_num_t slope = pm_num_mul(m->params->emf_shape == 0 ? sine : trapezoid, pi_third);
    static const uint8_t thirds[CROSSINGS_COUNT] = {3, 2, 3, 3};
    return pm_num_mul(slope, pm_num_ratio(thirds[m->params->zero_reference], 3));
}

/* What the signal of the crossings rises by in 60 degrees at the slope of its crossing, V s. */
static pm_num_t swing_of(const maker_t *m)
{
    if (m->params->zero_reference != CROSSINGS_third_harmonic) {
        return pm_num_mul(swing_of_terminal(m), si(m, DRIVE_PARAM_psi_m));
    }
    if (m->params->emf_shape == 0) { /* 9 psi_3 pi / 3 */
        const pm_num_t psi_3 = si(m, DRIVE_PARAM_psi_3);
        return mul3(PM_NUM_TWO_PI, pm_num_ratio(3, 2), m->params->psi_3 < 0 ? pm_num_neg(psi_3) : psi_3);
    }
    return mul3(square(PM_NUM_TWO_PI), pm_num_ratio(1, 72), si(m, DRIVE_PARAM_psi_m));
}

static void make_third_harmonic(maker_t *m, third_harmonic_config_t *c)
{
    const drive_params_t *p = m->params;
    if (p->emf_shape == 0 && p->psi_3 == 0) {
        refuse(m, DRIVE_PARAM_psi_3, "the third harmonic is not known, or the machine has none");
    }
    const pm_num_t per_s = pm_num_mul(pm_num(2 * p->timer_counts), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t pi = pm_num_mul(PM_NUM_TWO_PI, pm_num_ratio(1, 2));
    c->pi_rc = fixed(m, mul3(pi, si(m, DRIVE_PARAM_neutral_filter), per_s), 0, DRIVE_PARAM_neutral_filter);
    c->trapezoid = p->emf_shape != 0;
    c->negative = p->psi_3 < 0;
}

#if PM_CARRIES(NEEDS_NEUTRAL)
/* Half of what a sine's third harmonic swings by beside the open terminal in the middle 60 degrees, a third of a trapezoid's. */
static void make_third_missing(maker_t *m, const zero_crossing_config_t *crossing, third_missing_config_t *c)
{
    const pm_num_t terminal = mul3(pm_num(3), swing_of_terminal(m), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t full = pm_num_div(si(m, DRIVE_PARAM_neutral_full_scale), m->base.v);
    c->share = gain(m, pm_num_div(swing_of(m), terminal), Q_BITS, DRIVE_PARAM_psi_3);
    c->least =
        fixed(m, pm_num_mul(pm_num_ratio(STEPS, CONVERTER), full), Q_BITS, DRIVE_PARAM_neutral_full_scale);
    c->rail = crossing->rail;
}
#endif

static uint32_t needs_of(int32_t id)
{
    static const uint16_t of[] = {
#define PM_METHOD(name, help, traits, needs) needs,
#include "bldc/crossings.def"
#undef PM_METHOD
    };
    return of[id];
}

static void make_crossing(maker_t *m, uint32_t turn_base, zero_crossing_config_t *c)
{
    const pm_num_t swing = pm_num_mul(swing_of(m), m->base.omega);
    c->reference = m->params->zero_reference == CROSSINGS_terminal_mean ? ZERO_TERMINALS : ZERO_LINK;
    c->rail = fixed(m, pm_num_div(pm_num_dec(RAIL_mV, -3), m->base.v), Q_BITS, DRIVE_PARAM_v_full_scale);
    c->blank = counts(m, DRIVE_PARAM_t_blank);
    c->swing = gain(m, pm_num_div(swing, m->base.v), Q_BITS, DRIVE_PARAM_psi_m);
    c->curve = m->params->emf_shape == 0 ? ZERO_CURVE_SINE : 0;
    c->t_60 = (turn_base + SECTORS / 2U) / SECTORS;
}

void make_six_step(maker_t *m, six_step_config_t *c)
{
    const drive_params_t *p = m->params;
    const pm_num_t per_s = pm_num_mul(pm_num(2 * p->timer_counts), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t turn = pm_num_div(pm_num_mul(PM_NUM_TWO_PI, per_s), m->base.omega);
    c->commutation.turn_base = (uint32_t)fixed(m, turn, 0, DRIVE_PARAM_speed_trip);
    const pm_num_t advance = pm_num_mul(si(m, DRIVE_PARAM_six_step_advance), pm_num_ratio(1, 60));
    const pm_num_t half = pm_num_sub(pm_num_ratio(1, 2), advance);
    c->commutation.half =
        fixed(m, pm_num_mul(half, pm_num_ratio(1, 6)), FRAC_BITS, DRIVE_PARAM_six_step_advance);
    c->commutation.delay = 0;
    c->commutation.strikes = (uint8_t)p->missed_crossings;
    make_pattern(m, &c->pattern);
    c->crossings = (crossings_id_t)p->zero_reference;
    require(m, needs_of(p->zero_reference), DRIVE_PARAM_zero_reference);
    if (m->result.ok && c->crossings == CROSSINGS_third_harmonic) {
        make_third_harmonic(m, &c->third);
    }
    make_crossing(m, c->commutation.turn_base, &c->crossing);
#if PM_CARRIES(NEEDS_NEUTRAL)
    if (m->result.ok && c->crossings == CROSSINGS_third_harmonic) {
        make_third_missing(m, &c->crossing, &c->missing);
    }
#endif
    const pm_num_t vertical = pm_num_mul(pm_num_ratio(3, 2), si(m, DRIVE_PARAM_learn_vertical));
    c->thresholds.k_V = fixed(m, vertical, FRAC_BITS, DRIVE_PARAM_learn_vertical);
    c->thresholds.k_H =
        fixed(m, si(m, DRIVE_PARAM_learn_horizontal), FRAC_BITS, DRIVE_PARAM_learn_horizontal);
    c->compared =
        c->crossings == CROSSINGS_third_harmonic || c->crossings == CROSSINGS_virtual_third ? 0 : -1;
    const pm_num_t most = pm_num_ratio(1, c->crossings == CROSSINGS_third_harmonic ? 36 : 12);
    c->thresholds.most = fixed(m, pm_num_div(pm_num_mul(most, si(m, DRIVE_PARAM_v_dc_nominal)), m->base.v),
                               Q_BITS, DRIVE_PARAM_v_dc_nominal);
}
