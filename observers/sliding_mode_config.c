#include "observers/sliding_mode.h"

#include "observers/model_config.h"

void make_sliding_mode(maker_t *m, sliding_mode_config_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t omega_c = pm_num_mul(angular(m, DRIVE_PARAM_sliding_bandwidth), m->base.t_s);
    const pm_num_t K = pm_num_mul(si(m, DRIVE_PARAM_sliding_gain), si(m, DRIVE_PARAM_v_dc_nominal));
    make_model(m, &c->model);
    c->function = (sliding_mode_function_t)m->params->sliding_function;
    c->k_base = fixed(m, pm_num_div(K, m->base.v), Q_BITS, DRIVE_PARAM_sliding_gain);
    c->k_speed = fixed(m, si(m, DRIVE_PARAM_sliding_gain_speed), Q_BITS, DRIVE_PARAM_sliding_gain_speed);
    c->omega_tie = pm_max(speed(m, DRIVE_PARAM_speed_low), PM_Q(0.004));
    c->omega_min = c->omega_tie / 4;
    c->k_lp = gain(m, pm_num_div(omega_c, pm_num_add(pm_num(1), omega_c)), FRAC_BITS,
                   DRIVE_PARAM_sliding_bandwidth);
    c->slope = fixed(m, pm_num_div(pm_num_ratio(1, 2), step), SMALL_BITS, DRIVE_PARAM_f_pwm);
}
