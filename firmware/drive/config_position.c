/* Configuration of the position sources. */
#include "firmware/control/regulator.h"
#include "firmware/drive/position.h"
#include "firmware/params/maker.h"

/* Current control is slowed while a low-speed source asks for it; a position loop that is too fast for the
 * source is refused. */
static void limit_bandwidths(maker_t *m, position_config_t *c)
{
    const injection_limits_t limits = injection_limits(m);
    const pm_num_t pll = si(m, DRIVE_PARAM_injection_bandwidth);
    const pm_num_t current = regulator_bandwidth(m);
    if (limits.pll_max.m != 0 && pm_num_cmp(pll, limits.pll_max) > 0) {
        refuse(m, DRIVE_PARAM_injection_bandwidth,
               "too fast for the window of the carrier: raise f_injection");
    }
    if (limits.current_max.m != 0 && pm_num_cmp(current, limits.current_max) > 0) {
        c->current_low =
            fixed(m, pm_num_div(limits.current_max, current), UNIT_BITS, DRIVE_PARAM_f_injection);
    }
}

static int32_t per_span(maker_t *m)
{
    const pm_num_t span = pm_num_sub(si(m, DRIVE_PARAM_speed_high), si(m, DRIVE_PARAM_speed_low));
    return fixed(m, pm_num_div(m->base.omega, pm_num_mul(span, pole_pairs(m))), SMALL_BITS,
                 DRIVE_PARAM_speed_high);
}

/* While tied, an observer whose voltage is off by U disagrees by U / (k_q psi_m) at standstill. Half of what dead time and
 * devices take may not be compensated where a leg's current is near zero: that may count 0.15, half of what means lost. */
static pm_unit_t tied_share(maker_t *m)
{
    const pm_num_t lost = pm_num_add(dead_voltage(m), si(m, DRIVE_PARAM_device_drop));
    const pm_num_t sure =
        mul3(pm_num_ratio(3, 10), angular(m, DRIVE_PARAM_flux_bandwidth), si(m, DRIVE_PARAM_psi_m));
    return pm_num_cmp(lost, sure) > 0
               ? fixed(m, pm_num_div(sure, lost), UNIT_BITS, DRIVE_PARAM_flux_bandwidth)
               : PM_UNIT_MAX;
}

/* An open-loop start ends where the observer takes over; block commutation may begin right after the align. */
static bool hands_over(const drive_params_t *p, bool injection)
{
    const bool crossings = PM_HAS(six_step) && p->commutation != 0 && p->six_step_start != 0;
    return !injection && !crossings;
}

/* Sources and observers that do not go together. */
static void check_pair(maker_t *m, const position_config_t *c)
{
#if PM_HAS(zero_vector) && PM_HAS(pwm_excitation)
    if (c->observer.id == OBSERVER_zero_vector && m->params->injection == (int32_t)INJECTION_pwm_excitation) {
        refuse(m, DRIVE_PARAM_injection, "wants the sample of the observer that is chosen");
    }
#endif
#if PM_HAS(random_square) && PM_HAS(mras_current)
    const bool reference = c->observer.id == OBSERVER_mras_current ||
                           c->observer.id == OBSERVER_mras_voltage || c->observer.id == OBSERVER_mras_simple;
    if (reference && m->params->injection == (int32_t)INJECTION_random_square) {
        refuse(m, DRIVE_PARAM_injection,
               "has the spectrum of an error to a model reference: another carrier");
    }
#endif
    (void)m;
    (void)c;
}

void make_position(maker_t *m, position_config_t *c, bool injection)
{
    make_observer(m, &c->observer);
    if (injection) {
        check_pair(m, c);
    }
#if PM_CARRIES(NEEDS_NEUTRAL)
    c->traits_high = (uint8_t)observer_traits(c->observer.id);
#endif
    c->injects = injection;
    c->current_low = PM_UNIT_MAX;
    c->tied_share = tied_share(m);
    c->omega_low = speed(m, DRIVE_PARAM_speed_low);
    c->omega_high = speed(m, DRIVE_PARAM_speed_high);
    make_loop(m, &c->loop, &c->pll_low, &c->pll_high);
    make_second_harmonic(m, &c->second_harmonic);
    make_mismatch(m, &c->mismatch);
    make_speed(m, &c->speed);
    c->speed.k_theta = c->pll_low.k_theta;
    c->corrects = c->second_harmonic.id != SECOND_HARMONIC_STAYS || c->mismatch.id != MISMATCH_OFF ||
                  c->loop.id != LOOP_PLL || c->speed.id != SPEED_LOOP;
    if (m->params->speed_high <= m->params->speed_low) {
        refuse(m, DRIVE_PARAM_speed_high, "must be above speed_low");
        return;
    }
    if (m->params->speed_high > m->params->speed_max && hands_over(m->params, injection)) {
        refuse(m, DRIVE_PARAM_speed_high, "must not be above speed_max without injection");
    }
    c->per_span = per_span(m);
    if (injection) {
        make_injection(m, &c->injection);
        limit_bandwidths(m, c);
        c->traits = (uint8_t)injection_traits(c->injection.id);
    }
}
