#include "observers/third.h"

#include "firmware/math/image.h"
#include "firmware/params/maker.h"

#define STEPS     4    /* of the converter, of the least amplitude */
#define CONVERTER 2048 /* steps of half its range */
#define N_MOST    8000 /* below 2^31 in Q18 */

pm_num_t third_filter(const maker_t *m)
{
#if PM_HAS(open_winding)
    if (m->params->winding == 1) {
        return pm_num_mul(pm_num_ratio(1, 2), m->base.t_s);
    }
#endif
    return si(m, DRIVE_PARAM_neutral_filter);
}

/* Four steps of the channel. Of an open winding, a quarter of what a step of the currents asks of the voltage, as they dither. */
static pm_num_t least_voltage(const maker_t *m)
{
#if PM_HAS(open_winding)
    if (m->params->winding == 1) {
        return mul3(pm_num_ratio(1, 4 * CONVERTER), si(m, DRIVE_PARAM_i_full_scale),
                    pm_num_div(si(m, DRIVE_PARAM_L_0), m->base.t_s));
    }
#endif
    return pm_num_mul(pm_num_ratio(STEPS, CONVERTER), si(m, DRIVE_PARAM_neutral_full_scale));
}

/* The least speed: that voltage, or what N holds, of 3 omega psi_3. */
static void make_least(maker_t *m, third_config_t *c)
{
    const pm_num_t psi = pm_num_sqrt(square(pm_num_div(si(m, DRIVE_PARAM_psi_3), m->base.psi)));
    const pm_num_t steps = pm_num_div(least_voltage(m), m->base.v);
    const pm_num_t format = pm_num_ratio(1, N_MOST);
    const pm_num_t least_v = pm_num_cmp(steps, format) > 0 ? steps : format;
    const pm_num_t omega = pm_num_div(least_v, pm_num_mul(pm_num(3), psi));
    c->omega_min = PM_ONE;
    if (pm_num_cmp(omega, pm_num(1)) < 0) {
        c->omega_min = fixed(m, omega, Q_BITS, DRIVE_PARAM_psi_3);
    }
    if (c->omega_min >= speed(m, DRIVE_PARAM_speed_high)) {
        refuse(m, DRIVE_PARAM_speed_high,
               "below four steps of the third harmonic, neutral_full_scale / (1536 psi_3 pole_pairs)");
    }
}

void make_third(maker_t *m, third_config_t *c)
{
    const pm_num_t psi = si(m, DRIVE_PARAM_psi_3);
    if (m->params->psi_3 == 0) {
        refuse(m, DRIVE_PARAM_psi_3, "the third harmonic is not known, or the machine has none");
        return;
    }
    c->psi_3 = per_unit(m, DRIVE_PARAM_psi_3, m->base.psi);
    const pm_num_t shift = pm_num_mul(si(m, DRIVE_PARAM_dL_0), m->base.i);
    c->relative = fixed(m, pm_num_div(shift, pm_num_mul(pm_num(2), psi)), Q_BITS, DRIVE_PARAM_dL_0);
    c->t_s = fixed(m, pm_num_mul(m->base.t_s, m->base.omega), FRAC_BITS, DRIVE_PARAM_f_pwm);
    c->rc = fixed(m, mul3(pm_num(3), third_filter(m), m->base.omega), Q_BITS, DRIVE_PARAM_neutral_filter);
    c->notch = fixed(m, si(m, DRIVE_PARAM_third_notch), Q_BITS, DRIVE_PARAM_third_notch);
    make_least(m, c);
}
