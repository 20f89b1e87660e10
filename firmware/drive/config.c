#include "firmware/drive/config.h"

/* Formats of fixed.h. */
#define Q_BITS     28
#define FRAC_BITS  32
#define GAIN_BITS  26
#define UNIT_BITS  31
#define SMALL_BITS 20

#define SLOW_HZ 1000

#define REFUSE_FORMAT "does not fit the fixed-point format with these bases"

/* What one configuration is made with: formulas below read as they stand in the literature. */
typedef struct {
    const drive_params_t *params;
    drive_base_t base;
    pm_num_t impedance, inductance; /* bases */
    drive_result_t result;
} maker_t;

static void refuse(maker_t *m, drive_param_id_t id, const char *reason)
{
    if (m->result.ok) {
        m->result = (drive_result_t){.ok = false, .param = id, .reason = reason};
    }
}

static pm_num_t si(const maker_t *m, drive_param_id_t id)
{
    return pm_num_dec(drive_param_get(m->params, id), drive_param_table[id].exp10);
}

static int32_t fixed(maker_t *m, pm_num_t x, int bits, drive_param_id_t blame)
{
    int32_t out;
    if (!pm_num_to_fixed(x, bits, &out)) {
        refuse(m, blame, REFUSE_FORMAT);
    }
    return out;
}

static pm_num_t mul3(pm_num_t a, pm_num_t b, pm_num_t c)
{
    return pm_num_mul(pm_num_mul(a, b), c);
}

static pm_num_t square(pm_num_t x)
{
    return pm_num_mul(x, x);
}

static pm_num_t least(pm_num_t a, pm_num_t b)
{
    return pm_num_cmp(a, b) < 0 ? a : b;
}

/* A parameter over its base as a signal. */
static pm_q_t per_unit(maker_t *m, drive_param_id_t id, pm_num_t base)
{
    return fixed(m, pm_num_div(si(m, id), base), Q_BITS, id);
}

static pm_num_t pole_pairs(const maker_t *m)
{
    return pm_num(m->params->pole_pairs);
}

/* Mechanical speed parameter as per-unit electrical speed. */
static pm_q_t speed(maker_t *m, drive_param_id_t id)
{
    return fixed(m, pm_num_div(pm_num_mul(si(m, id), pole_pairs(m)), m->base.omega), Q_BITS, id);
}

static pm_num_t angular(const maker_t *m, drive_param_id_t id)
{
    return pm_num_mul(PM_NUM_TWO_PI, si(m, id));
}

static void make_base(maker_t *m)
{
    drive_base_t *b = &m->base;
    b->v = si(m, DRIVE_PARAM_v_full_scale);
    b->i = si(m, DRIVE_PARAM_i_full_scale);
    b->omega = pm_num_mul(si(m, DRIVE_PARAM_speed_trip), pole_pairs(m));
    b->psi = pm_num_div(b->v, b->omega);
    b->torque = mul3(pm_num_mul(pm_num_ratio(3, 2), pole_pairs(m)), b->psi, b->i);
    b->t_s = pm_num_div(pm_num(1), si(m, DRIVE_PARAM_f_pwm));
    m->impedance = pm_num_div(b->v, b->i);
    m->inductance = pm_num_div(b->psi, b->i);
}

static void make_modulator(maker_t *m, modulator_config_t *c)
{
    const pm_num_t duty = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t zone = pm_num_div(si(m, DRIVE_PARAM_comp_zone), m->base.i);
    c->counts = m->params->timer_counts;
    c->dead_counts = fixed(m, pm_num_mul(duty, pm_num(c->counts)), 0, DRIVE_PARAM_dead_time);
    c->drop = per_unit(m, DRIVE_PARAM_device_drop, m->base.v);
    /* pm_mulh(zone, gain) = 2^15 */
    c->zone_gain = fixed(m, pm_num_div(pm_num(1), zone), 15 + 32 - Q_BITS, DRIVE_PARAM_comp_zone);
    c->compensate = m->params->dead_time_comp != 0;
}

static pm_pi_config_t make_current_pi(maker_t *m, drive_param_id_t L)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_current_bandwidth);
    const pm_num_t kp = pm_num_div(pm_num_mul(bandwidth, si(m, L)), m->impedance);
    const pm_num_t ki = pm_num_div(mul3(bandwidth, si(m, DRIVE_PARAM_R_s), m->base.t_s), m->impedance);
    return (pm_pi_config_t){
        .kp = fixed(m, kp, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .ki = fixed(m, ki, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_R_s),
    };
}

static void make_current(maker_t *m, current_control_config_t *c)
{
    c->d = make_current_pi(m, DRIVE_PARAM_L_d);
    c->q = make_current_pi(m, DRIVE_PARAM_L_q);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
}

/* kp = w_s J / (1.5 P^2 psi), in base currents per base electrical speed. */
static void make_speed(maker_t *m, speed_control_config_t *c)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_speed_bandwidth);
    const pm_num_t k_t = mul3(pm_num_ratio(3, 2), square(pole_pairs(m)), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t inertia = pm_num_div(si(m, DRIVE_PARAM_J), k_t); /* A per rad/s2 electrical */
    const pm_num_t unit = pm_num_div(m->base.omega, m->base.i);
    const pm_num_t kp = mul3(bandwidth, inertia, unit);
    const pm_num_t t_slow = pm_num_ratio(1, SLOW_HZ);
    const pm_num_t ki = pm_num_mul(mul3(kp, bandwidth, t_slow), pm_num_ratio(1, 4));
    const pm_num_t slope = pm_num_mul(si(m, DRIVE_PARAM_acceleration), pole_pairs(m)); /* rad/s2 electrical */
    c->pi.kp = fixed(m, kp, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.ki = fixed(m, ki, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_speed_bandwidth);
    c->slope =
        fixed(m, pm_num_div(pm_num_mul(slope, t_slow), m->base.omega), Q_BITS, DRIVE_PARAM_acceleration);
    c->i_per_slope =
        fixed(m, pm_num_div(pm_num_mul(slope, inertia), m->base.i), Q_BITS, DRIVE_PARAM_acceleration);
}

static void make_flux_weakening(maker_t *m, field_weakening_config_t *c)
{
    /* loop of 20 Hz where the voltage is omega L_d i_d at base speed */
    const pm_num_t L_d = pm_num_div(si(m, DRIVE_PARAM_L_d), m->inductance);
    const pm_num_t k = pm_num_div(pm_num_mul(PM_NUM_TWO_PI, pm_num_ratio(20, SLOW_HZ)), L_d);
    c->k = fixed(m, least(k, pm_num_ratio(2, 5)), FRAC_BITS, DRIVE_PARAM_L_d);
    c->i_max = per_unit(m, DRIVE_PARAM_i_fw_max, m->base.i);
}

/* h = psi_m / (2 (L_q - L_d)); none when the machine has next to no saliency. */
static void make_mtpa(maker_t *m, mtpa_config_t *c)
{
    const pm_num_t dL = pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    const pm_num_t least = pm_num_mul(si(m, DRIVE_PARAM_L_q), pm_num_ratio(1, 100));
    c->h = 0;
    if (m->params->mtpa != 0 && pm_num_cmp(dL, least) > 0) {
        const pm_num_t h = pm_num_div(si(m, DRIVE_PARAM_psi_m), pm_num_mul(pm_num(2), dL));
        int32_t fits;
        /* a larger h than the format holds means less i_d than it resolves */
        c->h = pm_num_to_fixed(pm_num_div(h, m->base.i), Q_BITS, &fits) ? fits : 0;
    }
}

static pm_pll_config_t make_pll(maker_t *m, drive_param_id_t bandwidth)
{
    const pm_num_t w_n = angular(m, bandwidth);
    const pm_num_t kp = mul3(pm_num_ratio(9, 5), w_n, m->base.t_s); /* zeta = 0.9 */
    const pm_num_t ki = pm_num_div(pm_num_mul(square(w_n), m->base.t_s), m->base.omega);
    const pm_num_t turns = pm_num_div(pm_num_mul(m->base.omega, m->base.t_s), PM_NUM_TWO_PI);
    return (pm_pll_config_t){
        .kp = fixed(m, kp, FRAC_BITS, bandwidth),
        .ki = fixed(m, ki, FRAC_BITS, bandwidth),
        .k_theta = fixed(m, pm_num_mul(turns, pm_num(16)), 30, DRIVE_PARAM_speed_trip),
        .omega_limit = PM_Q(1.25),
    };
}

static void make_flux(maker_t *m, active_flux_config_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t change = pm_num_sub(si(m, DRIVE_PARAM_L_q_rated), si(m, DRIVE_PARAM_L_q));
    c->R = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->L_q2 = 0;
    if (m->params->saturation_comp != 0) {
        c->L_q2 = fixed(m, pm_num_div(pm_num_div(change, m->inductance), square(i_rated)), Q_BITS,
                        DRIVE_PARAM_L_q_rated);
    }
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
    c->t_s = fixed(m, step, FRAC_BITS, DRIVE_PARAM_f_pwm);
    c->g = fixed(m, pm_num_mul(si(m, DRIVE_PARAM_flux_gain), step), FRAC_BITS, DRIVE_PARAM_flux_gain);
    c->k_adapt = PM_FRAC(0.01);
    /* tie of 300 rad/s; R follows in 8 ms at rated current */
    const pm_num_t tie = pm_num(300);
    const pm_num_t follow = pm_num_ratio(1, 8);
    c->k_seed = fixed(m, pm_num_mul(tie, m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
    c->k_R = 0;
    if (m->params->resistance_adaptation != 0) {
        const pm_num_t k_R = pm_num_div(pm_num_mul(follow, tie), pm_num_mul(m->base.omega, square(i_rated)));
        c->k_R = fixed(m, k_R, GAIN_BITS, DRIVE_PARAM_i_rated);
    }
    c->omega_R = speed(m, DRIVE_PARAM_speed_low) / 2;
    c->R_min = c->R / 2;
    c->R_max = c->R < PM_Q(4.0) ? c->R * 2 : PM_Q(7.9);
}

typedef struct {
    pm_num_t L_d, L_q, L_dq;
} inductances_t;

/* The loop gain follows the saturating saliency, but not further than this: beyond, it would amplify noise.
 */
#define GAIN_RISE pm_num_ratio(5, 2)

/* d eps-free signal / d angle: V_h T_s [(L_q - L_d) + 2 L_dq^2 / L_q] / D, a current per radian. */
static pm_num_t carrier_slope(const maker_t *m, inductances_t L)
{
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t cross = pm_num_mul(pm_num(2), pm_num_div(square(L.L_dq), L.L_q));
    const pm_num_t D = pm_num_sub(pm_num_mul(L.L_d, L.L_q), square(L.L_dq));
    return pm_num_div(pm_num_mul(flux, pm_num_add(pm_num_sub(L.L_q, L.L_d), cross)), D);
}

static void make_square(maker_t *m, pulsating_square_config_t *c)
{
    const inductances_t zero = {si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_L_q), pm_num(0)};
    const inductances_t rated = {si(m, DRIVE_PARAM_L_dh_rated), si(m, DRIVE_PARAM_L_qh_rated),
                                 si(m, DRIVE_PARAM_L_dqh_rated)};
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t gain_0 = pm_num_div(m->base.i, carrier_slope(m, zero));
    const pm_num_t gain_r =
        least(pm_num_div(m->base.i, carrier_slope(m, rated)), pm_num_mul(GAIN_RISE, gain_0));
    const pm_num_t full = pm_num_div(rated.L_dq, rated.L_q);
    const pm_num_t half = si(m, DRIVE_PARAM_cross_half);

    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->gain_0 = fixed(m, gain_0, SMALL_BITS, DRIVE_PARAM_v_injection);
    c->gain_2 = fixed(m, pm_num_div(pm_num_sub(gain_r, gain_0), square(i_rated)), SMALL_BITS,
                      DRIVE_PARAM_v_injection);
    c->lambda_1 = 0;
    c->lambda_2 = 0;
    if (m->params->cross_coupling_comp != 0) {
        /* parabola through lambda = 0, half, full at i_q = 0, i_rated/2, i_rated */
        const pm_num_t a = pm_num_sub(pm_num_mul(pm_num(4), half), full);
        const pm_num_t b = pm_num_mul(pm_num(2), pm_num_sub(full, pm_num_mul(pm_num(2), half)));
        c->lambda_1 = fixed(m, pm_num_div(a, i_rated), Q_BITS, DRIVE_PARAM_L_dqh_rated);
        c->lambda_2 = fixed(m, pm_num_div(b, square(i_rated)), Q_BITS, DRIVE_PARAM_L_dqh_rated);
    }
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t h_d = pm_num_div(pm_num_div(flux, zero.L_d), m->base.i);
    c->h_d = fixed(m, h_d, Q_BITS, DRIVE_PARAM_v_injection);
    c->half_step = fixed(m, pm_num_mul(pm_num_mul(m->base.t_s, m->base.omega), pm_num_ratio(1, 2)), FRAC_BITS,
                         DRIVE_PARAM_f_pwm);
    c->h_d_inverse = fixed(m, pm_num_div(pm_num(1), h_d), SMALL_BITS, DRIVE_PARAM_v_injection);
}

/* The carrier must be seen: eight times the noise of a sample at 45 degrees of error, and 5 % of saliency. */
static bool salient(const maker_t *m)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t dL = pm_num_sub(L_q, L_d);
    const pm_num_t signal = pm_num_div(pm_num_mul(flux, dL), pm_num_mul(pm_num(2), pm_num_mul(L_d, L_q)));
    const pm_num_t noise = pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_i_noise));
    return pm_num_cmp(signal, noise) > 0 && pm_num_cmp(dL, pm_num_mul(L_q, pm_num_ratio(1, 20))) > 0;
}

static void make_position(maker_t *m, drive_config_t *config)
{
    position_config_t *c = &config->position;
    make_flux(m, &c->flux);
    c->injection = config->injection;
    c->omega_low = speed(m, DRIVE_PARAM_speed_low);
    c->omega_high = speed(m, DRIVE_PARAM_speed_high);
    c->pll_low = make_pll(m, DRIVE_PARAM_injection_bandwidth);
    c->pll_high = make_pll(m, DRIVE_PARAM_flux_bandwidth);
    if (m->params->speed_high <= m->params->speed_low) {
        refuse(m, DRIVE_PARAM_speed_high, "must be above speed_low");
        return;
    }
    const pm_num_t span = pm_num_sub(si(m, DRIVE_PARAM_speed_high), si(m, DRIVE_PARAM_speed_low));
    c->per_span = fixed(m, pm_num_div(m->base.omega, pm_num_mul(span, pole_pairs(m))), SMALL_BITS,
                        DRIVE_PARAM_speed_high);
    if (config->injection) {
        make_square(m, &c->square);
    }
}

/* Flux that gives i_pulse along the d-axis, by whole periods at a duty <= 1. */
static void make_pulses(maker_t *m, initial_pulses_config_t *c)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_i_pulse), L_d);
    const pm_num_t per_period = mul3(pm_num_ratio(2, 3), si(m, DRIVE_PARAM_v_dc_nominal), m->base.t_s);
    const pm_num_t exact = pm_num_div(flux, per_period);
    int32_t whole;
    if (!pm_num_to_fixed(pm_num_add(exact, pm_num_ratio(1, 2)), 0, &whole) || whole > 10000) {
        refuse(m, DRIVE_PARAM_i_pulse, "pulse longer than 10000 periods");
        return;
    }
    whole = whole < 1 ? 1 : whole;
    c->periods = (uint16_t)whole;
    c->timeout = (uint16_t)(8 * whole + 50);
    const pm_num_t duty = pm_num_div(exact, pm_num(whole));
    c->duty = fixed(m, least(duty, pm_num(1)), Q_BITS, DRIVE_PARAM_i_pulse);
    const pm_num_t noise = pm_num_div(si(m, DRIVE_PARAM_i_noise), m->base.i);
    c->i_zero = fixed(m, pm_num_mul(pm_num(5), noise), Q_BITS, DRIVE_PARAM_i_noise);
    /* y of the unsaturated machine is 3 i_pulse (L_q - L_d) / L_q */
    const pm_num_t share = pm_num_div(pm_num_sub(L_q, L_d), L_q);
    const pm_num_t i_pulse = pm_num_div(si(m, DRIVE_PARAM_i_pulse), m->base.i);
    c->y_min = fixed(m, mul3(share, i_pulse, pm_num_ratio(3, 4)), Q_BITS, DRIVE_PARAM_i_pulse);
    c->w_min = fixed(m, pm_num_mul(pm_num(10), noise), Q_BITS, DRIVE_PARAM_i_noise);
}

static void make_open_loop(maker_t *m, open_loop_config_t *c)
{
    const pm_num_t t_slow = pm_num_ratio(1, SLOW_HZ);
    const pm_num_t slope = pm_num_mul(si(m, DRIVE_PARAM_open_loop_acceleration), pole_pairs(m));
    c->i = per_unit(m, DRIVE_PARAM_i_open_loop, m->base.i);
    c->i_slope = c->i / 50 + 1;
    c->slope = fixed(m, pm_num_div(pm_num_mul(slope, t_slow), m->base.omega), Q_BITS,
                     DRIVE_PARAM_open_loop_acceleration);
    c->align_ms = (uint16_t)m->params->t_align;
    c->sweep = PM_TURN(0.5) / (uint32_t)m->params->t_align;
}

static void make_protection(maker_t *m, protection_config_t *c)
{
    const drive_params_t *p = m->params;
    c->i_trip = per_unit(m, DRIVE_PARAM_i_trip, m->base.i);
    c->v_dc_max = per_unit(m, DRIVE_PARAM_v_dc_max, m->base.v);
    c->v_dc_min = per_unit(m, DRIVE_PARAM_v_dc_min, m->base.v);
    c->v_dc_derate = per_unit(m, DRIVE_PARAM_v_dc_derate, m->base.v);
    c->i_sum = PM_Q(0.1);
    c->offset_max =
        fixed(m, pm_num_div(si(m, DRIVE_PARAM_offset_max), m->base.i), 15, DRIVE_PARAM_offset_max);
    c->temp_derate_dC = p->temp_derate;
    c->temp_trip_dC = p->temp_trip;
    c->omega_stall = speed(m, DRIVE_PARAM_speed_max) / 50;
    c->stall_ms = (uint16_t)p->t_stall;
    c->lost_ms = (uint16_t)p->t_lost;
    if (p->i_trip > p->i_full_scale) {
        refuse(m, DRIVE_PARAM_i_trip, "above the full scale of the current channels");
    } else if (p->i_trip <= p->i_max) {
        refuse(m, DRIVE_PARAM_i_trip, "not above i_max");
    } else if (p->v_dc_max > p->v_full_scale) {
        refuse(m, DRIVE_PARAM_v_dc_max, "above the full scale of the voltage channel");
    } else if (p->v_dc_min >= p->v_dc_derate || p->v_dc_derate >= p->v_dc_max) {
        refuse(m, DRIVE_PARAM_v_dc_derate, "must lie between v_dc_min and v_dc_max");
    } else if (p->v_dc_nominal <= p->v_dc_min || p->v_dc_nominal >= p->v_dc_derate) {
        refuse(m, DRIVE_PARAM_v_dc_nominal, "must lie between v_dc_min and v_dc_derate");
    } else if (p->v_dc_min < p->v_full_scale / 16) {
        refuse(m, DRIVE_PARAM_v_dc_min, "below a sixteenth of the full scale");
    } else if (p->temp_derate >= p->temp_trip) {
        refuse(m, DRIVE_PARAM_temp_derate, "must be below temp_trip");
    } else if (p->speed_trip <= p->speed_max) {
        refuse(m, DRIVE_PARAM_speed_trip, "not above speed_max");
    } else if (p->i_open_loop > p->i_max || p->i_pulse > p->i_trip) {
        refuse(m, p->i_pulse > p->i_trip ? DRIVE_PARAM_i_pulse : DRIVE_PARAM_i_open_loop,
               "above the current limit");
    }
}

static void check_ranges(maker_t *m)
{
    for (int32_t id = 0; id < (int32_t)DRIVE_PARAM_COUNT; id++) {
        const int32_t value = drive_param_get(m->params, (drive_param_id_t)id);
        if (value < drive_param_table[id].min || value > drive_param_table[id].max) {
            refuse(m, (drive_param_id_t)id, "out of range");
        }
    }
}

/* dL >= 0 is assumed by MTPA, injection and pulses; the incremental inductances must be those of a passive
 * machine. */
static void check_machine(maker_t *m)
{
    const drive_params_t *p = m->params;
    const int64_t D = (int64_t)p->L_dh_rated * p->L_qh_rated - (int64_t)p->L_dqh_rated * p->L_dqh_rated;
    if (p->L_q < p->L_d) {
        refuse(m, DRIVE_PARAM_L_q, "below L_d: inverse saliency is not supported");
    } else if (D <= 0) {
        refuse(m, DRIVE_PARAM_L_dqh_rated, "larger than the incremental inductances allow");
    } else if (p->start_method % 2 == 1 && p->L_q == p->L_d) {
        refuse(m, DRIVE_PARAM_start_method, "injection needs L_q above L_d");
    }
}

drive_result_t drive_configure(drive_config_t *config, const drive_params_t *params)
{
    maker_t m = {.params = params, .result = {.ok = true, .param = DRIVE_PARAM_COUNT, .reason = "ok"}};
    check_ranges(&m);
    check_machine(&m);
    if (!m.result.ok) {
        return m.result;
    }
    make_base(&m);
    config->base = m.base;
    config->pole_pairs = pole_pairs(&m);
    config->injection = params->start_method % 2 == 1 || (params->start_method == 0 && salient(&m));
    config->align_first = !config->injection || params->start_method == 3;
    make_modulator(&m, &config->modulator);
    make_current(&m, &config->current);
    make_speed(&m, &config->speed);
    make_mtpa(&m, &config->mtpa);
    make_flux_weakening(&m, &config->field_weakening);
    make_position(&m, config);
    if (!config->align_first) {
        make_pulses(&m, &config->pulses);
    }
    make_open_loop(&m, &config->open_loop);
    make_protection(&m, &config->protection);
    config->k_theta = config->position.pll_low.k_theta;
    config->i_max = per_unit(&m, DRIVE_PARAM_i_max, m.base.i);
    config->i_d_light = per_unit(&m, DRIVE_PARAM_i_d_light, m.base.i);
    config->omega_max = speed(&m, DRIVE_PARAM_speed_max);
    config->v_linear = fixed(&m, pm_num_mul(pm_num_ratio(98, 100), pm_num_sqrt(pm_num_ratio(1, 3))),
                             UNIT_BITS, DRIVE_PARAM_v_full_scale);
    config->psi_m = config->current.psi_m;
    config->dL = config->current.L_d - config->current.L_q;
    return m.result;
}
