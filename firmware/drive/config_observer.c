/* Configuration of the fundamental-model observers: machine model, flux, EMF and sliding mode. */
#include "firmware/drive/config_maker.h"
#include "firmware/math/root.h"

static pm_q_t quotient(maker_t *m, pm_q_t x, pm_q_t y, drive_param_id_t blame)
{
    const pm_q_t q = pm_div(x, y);
    if (pm_abs(q) > PM_Q(7.9)) {
        refuse(m, blame, "beyond the fixed-point range with these bases");
    }
    return q;
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
    const pm_dq_t i = {.d = mtpa_i_d(&m->mtpa, i_rated), .q = 0};
    c->L_q2 = quotient(m, pm_sub_sat(rated, observer_L_q(c, i)), i_squared, DRIVE_PARAM_L_q_rated);
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
    c->L_qd = 0;
    c->L_qd2 = 0;
    if (m->params->saturation_comp != 0) {
        make_saturation(m, c);
    }
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
    c->t_s = fixed(m, step, FRAC_BITS, DRIVE_PARAM_f_pwm);
}

/* Rate at which the state is tied to the position while injection leads, rad/s. */
#define TIE pm_num(300)

/* R follows in 8 ms at rated current. */
#define FOLLOW pm_num_ratio(1, 8)
/* The EMF contains the loop's speed, whose ripple R must not follow: 64 ms. */
#define FOLLOW_EMF pm_num_ratio(1, 64)

static void make_resistance(maker_t *m, observer_resistance_t *c, pm_num_t k)
{
    c->k = 0;
    if (m->params->resistance_adaptation != 0) {
        c->k = fixed(m, k, GAIN_BITS, DRIVE_PARAM_i_rated);
    }
    c->omega = speed(m, DRIVE_PARAM_speed_low) / 2;
}

void make_active_flux(maker_t *m, active_flux_config_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    make_model(m, &c->model);
    make_resistance(m, &c->resistance,
                    pm_num_div(pm_num_mul(FOLLOW, TIE), pm_num_mul(m->base.omega, square(i_rated))));
    c->g = fixed(m, pm_num_mul(si(m, DRIVE_PARAM_flux_gain), step), FRAC_BITS, DRIVE_PARAM_flux_gain);
    c->k_seed = fixed(m, pm_num_mul(TIE, m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
}

/* lag: (2 - k) / k, k = w T / (1 + w T). */
static void make_emf_filter(maker_t *m, emf_config_t *c)
{
    const pm_num_t w = pm_num_mul(angular(m, DRIVE_PARAM_emf_bandwidth), m->base.t_s);
    const pm_num_t k = pm_num_div(w, pm_num_add(pm_num(1), w));
    c->k_filter = gain(m, k, FRAC_BITS, DRIVE_PARAM_emf_bandwidth);
    c->lag = fixed(m, pm_num_div(pm_num_sub(pm_num(2), k), k), GAIN_BITS, DRIVE_PARAM_emf_bandwidth);
}

/* Of a period, of a slow step, of the loop: 2 zeta / w_n. */
static void make_emf_rates(maker_t *m, emf_config_t *c)
{
    const pm_num_t period = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t slow = pm_num_mul(m->t_slow, m->base.omega);
    const pm_num_t loop = pm_num_mul(angular(m, DRIVE_PARAM_injection_bandwidth), m->t_slow);
    c->rate = fixed(m, pm_num_div(pm_num(1), period), SMALL_BITS, DRIVE_PARAM_f_pwm);
    c->slow_rate = fixed(m, least(pm_num_div(pm_num(1), slow), pm_num(31)), GAIN_BITS, DRIVE_PARAM_f_pwm);
    c->slow_step = fixed(m, slow, Q_BITS, DRIVE_PARAM_speed_trip);
    c->speed_lag = fixed(m, least(pm_num_div(pm_num_ratio(9, 5), loop), pm_num(31)), GAIN_BITS,
                         DRIVE_PARAM_injection_bandwidth);
}

static void make_emf(maker_t *m, emf_config_t *c)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    make_model(m, &c->model);
    make_resistance(m, &c->resistance, pm_num_div(FOLLOW_EMF, square(i_rated)));
    make_emf_filter(m, c);
    make_emf_rates(m, c);
    c->omega_min = speed(m, DRIVE_PARAM_speed_low) / 2;
    c->omega_tied =
        fixed(m, least(pm_num_div(TIE, m->base.omega), pm_num(1)), Q_BITS, DRIVE_PARAM_speed_trip);
}

static void round_only(maker_t *m)
{
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t dL = pm_num_sub(L_q, si(m, DRIVE_PARAM_L_d));
    if (pm_num_cmp(dL, pm_num_mul(L_q, pm_num_ratio(1, 8))) > 0) {
        refuse(m, DRIVE_PARAM_observer, "is for machines without saliency");
    }
}

void make_flux_linkage(maker_t *m, flux_linkage_config_t *c)
{
    round_only(m);
    make_active_flux(m, &c->flux);
    c->g = fixed(m, si(m, DRIVE_PARAM_flux_gain), Q_BITS, DRIVE_PARAM_flux_gain);
}

void make_back_emf(maker_t *m, back_emf_config_t *c)
{
    round_only(m);
    make_emf(m, c);
}

void make_extended_emf(maker_t *m, extended_emf_config_t *c)
{
    make_emf(m, c);
}

void make_extended_emf_ab(maker_t *m, extended_emf_ab_config_t *c)
{
    make_emf(m, c);
}

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
