#include "observers/speed.h"

#include "firmware/params/maker.h"

/* Difference over 6 ms, EMF ratio through 3 ms, their mean difference through 5 Hz. */
void make_speed(maker_t *m, speed_config_t *c)
{
    const uint8_t window = 6;
    const pm_num_t L_q = pm_num_div(si(m, DRIVE_PARAM_L_q), m->inductance);
    const pm_num_t span = mul3(pm_num(window), m->t_slow, m->base.omega);
    const pm_num_t rise = pm_num_div(L_q, pm_num_mul(m->t_slow, m->base.omega));
    const bool by_emf =
        m->params->speed_estimator >= (int32_t)SPEED_EMF_RATIO; /* of others it may be beyond */
    const pm_num_t corner = pm_num_mul(PM_NUM_TWO_PI, pm_num(5));
    *c = (speed_config_t){
        .id = (uint8_t)m->params->speed_estimator,
        .window = window,
        .turn_step = (uint16_t)m->slow_divider,
        .R = per_unit(m, DRIVE_PARAM_R_s, m->impedance),
        .L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance),
        .psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi),
        .per_step = fixed(m, pm_num_ratio(16, (int32_t)m->slow_divider), GAIN_BITS, DRIVE_PARAM_f_pwm),
        .rise = fixed(m, by_emf ? rise : pm_num(0), GAIN_BITS, DRIVE_PARAM_L_q),
        .per_turn = fixed(m, pm_num_div(PM_NUM_TWO_PI, span), GAIN_BITS, DRIVE_PARAM_speed_trip),
        .k_ratio = PM_FRAC(0.28),
        .k_mean = fixed(m, pm_num_mul(corner, m->t_slow), FRAC_BITS, DRIVE_PARAM_f_pwm),
    };
}
