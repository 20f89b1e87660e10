#include "observers/model_config.h"

#include "firmware/math/root.h"
#include "firmware/params/maker.h"

static pm_q_t quotient(maker_t *m, pm_q_t x, pm_q_t y, drive_param_id_t blame)
{
    const pm_q_t q = pm_div(x, y);
    if (pm_abs(q) > PM_Q(7.9)) {
        refuse(m, blame, "beyond its format: full scales or speed_trip too far off");
    }
    return q;
}

/* The change of L_q at rated current over the square of that current, lifted until it fits. */
static void make_fall(maker_t *m, observer_model_t *c, pm_q_t i_rated, pm_q_t change)
{
    pm_q_t i = i_rated;
    while (i > 0 && pm_mul(i, i) < pm_abs(change) / 7) {
        i = pm_shl(i, 1);
        c->lift = (uint8_t)(c->lift + 1U);
    }
    c->L_q2 = quotient(m, change, pm_mul(i, i), DRIVE_PARAM_L_q_rated);
}

/* L_q_rated belongs to i_d of maximum torque per ampere, L_qd_weak and _strong to -+ half rated. */
static void make_saturation(maker_t *m, observer_model_t *c)
{
    const pm_q_t i_rated = per_unit(m, DRIVE_PARAM_i_rated, m->base.i);
    const pm_q_t i_squared = pm_mul(i_rated, i_rated);
    const pm_q_t weak = per_unit(m, DRIVE_PARAM_L_qd_weak, m->inductance);
    const pm_q_t strong = per_unit(m, DRIVE_PARAM_L_qd_strong, m->inductance);
    c->L_qd = quotient(m, pm_half(weak) + pm_half(strong), i_rated, DRIVE_PARAM_L_qd_weak);
    c->L_qd2 = quotient(m, pm_sub_sat(strong, weak), i_squared, DRIVE_PARAM_L_qd_strong);
    const pm_q_t rated = per_unit(m, DRIVE_PARAM_L_q_rated, m->inductance);
    const pm_dq_t i = {.d = m->i_d_rated, .q = 0};
    make_fall(m, c, i_rated, pm_sub_sat(rated, observer_L_q(c, i)));
}

void make_model(maker_t *m, observer_model_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    c->R = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    /* observers hold it in Q29 */
    (void)fixed(m, pm_num_div(si(m, DRIVE_PARAM_L_q), m->inductance), Q_BITS + 1, DRIVE_PARAM_L_q);
    c->L_q2 = 0;
    c->lift = 0;
    c->L_qd = 0;
    c->L_qd2 = 0;
    if (m->params->saturation_comp != 0) {
        make_saturation(m, c);
    }
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
    c->t_s = fixed(m, step, FRAC_BITS, DRIVE_PARAM_f_pwm);
}

/* What the format of the gain, Q26, holds: a motor whose rated current is far below the base learns more slowly. */
#define RESISTANCE_K_MOST 31

void make_resistance(maker_t *m, observer_resistance_t *c, pm_num_t k)
{
    c->k = 0;
    if (m->params->resistance_adaptation != 0) {
        c->k = fixed(m, least(k, pm_num(RESISTANCE_K_MOST)), GAIN_BITS, DRIVE_PARAM_i_rated);
    }
    c->omega = speed(m, DRIVE_PARAM_speed_low) / 2;
    c->drop =
        pm_mul(per_unit(m, DRIVE_PARAM_R_s, m->impedance), per_unit(m, DRIVE_PARAM_i_rated, m->base.i)) / 8;
}

void round_only(maker_t *m)
{
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t dL = pm_num_sub(L_q, si(m, DRIVE_PARAM_L_d));
    if (pm_num_cmp(square(dL), square(pm_num_mul(L_q, pm_num_ratio(1, 8)))) > 0) {
        refuse(m, DRIVE_PARAM_observer, "is for machines without saliency");
    }
}
