#include "bldc/line_current.h"

#include "firmware/params/maker.h"

void make_line_current(maker_t *m, line_current_config_t *c)
{
    const pm_num_t twice = pm_num_mul(pm_num(2), angular(m, DRIVE_PARAM_current_bandwidth));
    const pm_num_t kp = pm_num_div(pm_num_mul(twice, si(m, DRIVE_PARAM_L_q)), m->impedance);
    const pm_num_t ki = pm_num_div(mul3(twice, si(m, DRIVE_PARAM_R_s), m->base.t_s), m->impedance);
    c->pi.kp = gain(m, kp, GAIN_BITS, DRIVE_PARAM_current_bandwidth);
    c->pi.ki = gain(m, ki, GAIN_BITS, DRIVE_PARAM_current_bandwidth);
    c->pi.kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_R_s);
    c->R_2 = fixed(m, pm_num_div(pm_num_mul(pm_num(2), si(m, DRIVE_PARAM_R_s)), m->impedance), Q_BITS,
                   DRIVE_PARAM_R_s);
}
