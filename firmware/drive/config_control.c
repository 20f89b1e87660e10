/* Configuration of modulator and controllers. */
#include "firmware/drive/config_maker.h"

void make_modulator(maker_t *m, modulator_config_t *c)
{
    const pm_num_t duty = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t zone = pm_num_div(si(m, DRIVE_PARAM_comp_zone), m->base.i);
    c->counts = m->params->timer_counts;
    c->dead = fixed(m, duty, PM_SHARE_BITS, DRIVE_PARAM_dead_time);
    c->drop = per_unit(m, DRIVE_PARAM_device_drop, m->base.v);
    const pm_num_t per_zone = pm_num_div(pm_num(1), zone);
    const int bits = PM_ZONE_BITS + 32 - (Q_BITS - 2);
    c->zone_alpha = fixed(m, per_zone, bits, DRIVE_PARAM_comp_zone);
    c->zone_beta =
        fixed(m, pm_num_mul(per_zone, pm_num_sqrt(pm_num_ratio(3, 4))), bits, DRIVE_PARAM_comp_zone);
    c->compensate = m->params->dead_time_comp != 0;
}

static pm_pi_config_t make_current_pi(maker_t *m, drive_param_id_t L)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_current_bandwidth);
    const pm_num_t kp = pm_num_div(pm_num_mul(bandwidth, si(m, L)), m->impedance);
    const pm_num_t ki = pm_num_div(mul3(bandwidth, si(m, DRIVE_PARAM_R_s), m->base.t_s), m->impedance);
    return (pm_pi_config_t){
        .kp = gain(m, kp, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .ki = gain(m, ki, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_R_s),
    };
}

void make_current(maker_t *m, current_control_config_t *c)
{
    c->d = make_current_pi(m, DRIVE_PARAM_L_d);
    c->q = make_current_pi(m, DRIVE_PARAM_L_q);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
}

/* kp = w_s J / (1.5 P^2 psi), in base currents per base electrical speed. */
void make_speed(maker_t *m, speed_control_config_t *c)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_speed_bandwidth);
    const pm_num_t k_t = mul3(pm_num_ratio(3, 2), square(pole_pairs(m)), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t inertia = pm_num_div(si(m, DRIVE_PARAM_J), k_t); /* A per rad/s2 electrical */
    const pm_num_t unit = pm_num_div(m->base.omega, m->base.i);
    const pm_num_t kp = mul3(bandwidth, inertia, unit);
    const pm_num_t ki = pm_num_mul(mul3(kp, bandwidth, m->t_slow), pm_num_ratio(1, 4));
    const pm_num_t slope = pm_num_mul(si(m, DRIVE_PARAM_acceleration), pole_pairs(m)); /* rad/s2 electrical */
    c->pi.kp = gain(m, kp, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.ki = gain(m, ki, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_speed_bandwidth);
    c->slope =
        fixed(m, pm_num_div(pm_num_mul(slope, m->t_slow), m->base.omega), Q_BITS, DRIVE_PARAM_acceleration);
    c->i_per_slope =
        fixed(m, pm_num_div(pm_num_mul(slope, inertia), m->base.i), Q_BITS, DRIVE_PARAM_acceleration);
}

void make_flux_weakening(maker_t *m, field_weakening_config_t *c)
{
    /* loop of 20 Hz where the voltage is omega L_d i_d at base speed */
    const pm_num_t L_d = pm_num_div(si(m, DRIVE_PARAM_L_d), m->inductance);
    const pm_num_t k = pm_num_div(mul3(PM_NUM_TWO_PI, pm_num(20), m->t_slow), L_d);
    c->k = fixed(m, least(k, pm_num_ratio(2, 5)), FRAC_BITS, DRIVE_PARAM_L_d);
    c->i_max = per_unit(m, DRIVE_PARAM_i_fw_max, m->base.i);
}

/* h = psi_m / (2 (L_q - L_d)); 0 when the saliency is negligible. */
void make_mtpa(maker_t *m, mtpa_config_t *c)
{
    const pm_num_t dL = pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    const pm_num_t trifle = pm_num_mul(si(m, DRIVE_PARAM_L_q), pm_num_ratio(1, 100));
    c->h = 0;
    if (m->params->mtpa != 0 && pm_num_cmp(dL, trifle) > 0) {
        const pm_num_t h = pm_num_div(si(m, DRIVE_PARAM_psi_m), pm_num_mul(pm_num(2), dL));
        int32_t x;
        /* beyond, i_d is less than a fourteenth of i_q, and hypot(h, i_q) might not fit */
        if (pm_num_to_fixed(pm_num_div(h, m->base.i), Q_BITS, &x) && x < PM_Q(7.0)) {
            c->h = x;
        }
    }
}
