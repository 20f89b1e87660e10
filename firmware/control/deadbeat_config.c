#include "firmware/control/deadbeat.h"

#include "firmware/params/maker.h"

#define K_BITS 25

static void make_axis(maker_t *m, drive_param_id_t L, int32_t *k, pm_q_t *per_L)
{
    const pm_num_t per_period = pm_num_div(pm_num_div(si(m, L), m->base.t_s), m->impedance);
    if (pm_num_cmp(per_period, pm_num(60)) > 0) { /* 8 times it, the largest error, must fit */
        refuse(m, L, "over a PWM period is beyond 60 times v_full_scale / i_full_scale");
        return;
    }
    *k = gain(m, per_period, K_BITS, L);
    *per_L = fixed(m, pm_num_div(pm_num(1), per_period), Q_BITS, L);
}

void make_deadbeat(maker_t *m, deadbeat_config_t *c)
{
    make_axis(m, DRIVE_PARAM_L_d, &c->k_d, &c->model.per_L_d);
    make_axis(m, DRIVE_PARAM_L_q, &c->k_q, &c->model.per_L_q);
    c->model.R = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    c->model.L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->model.L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->model.psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
}

/* That of a first-order response with a time constant of one period. */
pm_num_t deadbeat_bandwidth(const maker_t *m)
{
    const pm_num_t two_pi = {PM_NUM_TWO_PI_M, PM_NUM_TWO_PI_E};
    return pm_num_div(si(m, DRIVE_PARAM_f_pwm), two_pi);
}
