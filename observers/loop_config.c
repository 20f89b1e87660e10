#include "observers/loop.h"

#include "firmware/params/maker.h"

static pm_pll_config_t make_gains(maker_t *m, pm_num_t kp, pm_num_t ki, drive_param_id_t bandwidth)
{
    const pm_num_t turns = pm_num_div(pm_num_mul(m->base.omega, m->base.t_s), PM_NUM_TWO_PI);
    return (pm_pll_config_t){
        .kp_turn = gain(m, pm_num_div(pm_num_mul(pm_num(4), kp), PM_NUM_TWO_PI), FRAC_BITS, bandwidth),
        .ki = gain(m, ki, FRAC_BITS, bandwidth),
        .k_theta = fixed(m, pm_num_mul(turns, pm_num(16)), 30, DRIVE_PARAM_speed_trip),
    };
}

static pm_pll_config_t make_pll(maker_t *m, drive_param_id_t bandwidth)
{
    const pm_num_t w_n = angular(m, bandwidth);
    const pm_num_t kp = mul3(pm_num_ratio(9, 5), w_n, m->base.t_s); /* zeta = 0.9 */
    const pm_num_t ki = pm_num_div(pm_num_mul(square(w_n), m->base.t_s), m->base.omega);
    return make_gains(m, kp, ki, bandwidth);
}

/* The simplified EKF with the noise of the PLL, r = 0.7067 w_n: 2 r T, 2 r^2 T, r^3 T^2. */
static pm_pll_config_t make_ekf(maker_t *m, int32_t *k_acceleration)
{
    const pm_num_t r = pm_num_mul(LOOP_EKF_SHARE, angular(m, DRIVE_PARAM_flux_bandwidth));
    const pm_num_t step = pm_num_mul(r, m->base.t_s);
    const pm_num_t jerk = pm_num_div(pm_num_mul(square(step), r), m->base.omega);
    *k_acceleration = gain(m, jerk, 36, DRIVE_PARAM_flux_bandwidth);
    const pm_num_t kp = pm_num_mul(pm_num(2), step);
    return make_gains(m, kp, pm_num_div(pm_num_mul(kp, r), m->base.omega), DRIVE_PARAM_flux_bandwidth);
}

void make_loop(maker_t *m, loop_config_t *c, pm_pll_config_t *low, pm_pll_config_t *high)
{
    *low = make_pll(m, DRIVE_PARAM_injection_bandwidth);
    *high = make_pll(m, DRIVE_PARAM_flux_bandwidth);
    *c = (loop_config_t){.id = (loop_id_t)m->params->position_observer};
    if (c->id == LOOP_SIMPLIFIED_EKF) {
        *high = make_ekf(m, &c->k_acceleration);
    }
}
