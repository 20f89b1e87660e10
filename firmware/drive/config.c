#include "firmware/drive/config.h"

#include "firmware/drive/procedures/procedure.h"
#include "firmware/params/maker.h"

/* Full scale of the converters is the base, so that a code is its signal but for a shift. A winding of many turns, a
 * gimbal's, has a resistance and reactances far above the ratio of both: then the base of the voltages is a multiple of
 * full scale, as far as v_dc_min is a sixteenth of it. */
#define X_MOST 4 /* observers hold L_q in Q29 */
#define R_MOST 8

static bool fits(const maker_t *m, pm_num_t impedance, int32_t times)
{
    return pm_num_cmp(impedance, pm_num_mul(pm_num(times), pm_num_div(m->base.v, m->base.i))) < 0;
}

static void choose_voltage(maker_t *m, drive_config_t *config)
{
    static const char reason[] = "too large for this board: raise v_dc_min, or lower speed_trip";
    const pm_num_t R = si(m, DRIVE_PARAM_R_s);
    const pm_num_t X = pm_num_mul(si(m, DRIVE_PARAM_L_q), m->base.omega);
    int32_t shift = 0;
    while (!(fits(m, R, R_MOST / 2) && fits(m, X, X_MOST)) &&
           m->params->v_dc_min / 2 >= pm_shl(m->params->v_full_scale / 16, (uint32_t)shift)) {
        shift++;
        m->base.v = pm_num_mul(m->base.v, pm_num(2));
    }
    config->protection.v_bits = PM_Q_BITS - 16 - shift;
    if (!fits(m, R, R_MOST)) {
        refuse(m, DRIVE_PARAM_R_s, reason);
    } else if (!fits(m, X, X_MOST)) {
        refuse(m, DRIVE_PARAM_L_q, reason);
    } else {
        /* both fit */
    }
}

static void make_base(maker_t *m, drive_config_t *config)
{
    drive_base_t *b = &m->base;
    b->v = si(m, DRIVE_PARAM_v_full_scale);
    b->i = si(m, DRIVE_PARAM_i_full_scale);
    b->omega = pm_num_mul(si(m, DRIVE_PARAM_speed_trip), pole_pairs(m));
    choose_voltage(m, config);
    b->psi = pm_num_div(b->v, b->omega);
    b->torque = mul3(pm_num_mul(torque_share(m->params), pole_pairs(m)), b->psi, b->i);
    b->t_s = pm_num_div(pm_num(1), si(m, DRIVE_PARAM_f_pwm));
    if (pm_num_cmp(pm_num_mul(b->t_s, b->omega), pm_num_ratio(1, 2)) >= 0) {
        refuse(m, DRIVE_PARAM_speed_trip, "above an electrical frequency of f_pwm / 12.6: raise f_pwm");
    }
    m->slow_divider = ((uint32_t)m->params->f_pwm + 500U) / 1000U; /* f_pwm >= 4000 */
    m->t_slow = pm_num_mul(pm_num((int32_t)m->slow_divider), b->t_s);
    m->impedance = pm_num_div(b->v, b->i);
    m->inductance = pm_num_div(b->psi, b->i);
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

/* Injection and pulses need L_q above L_d; with L_q below L_d the rest takes i_d = 0 for most torque per ampere
 * (mtpa.h). The incremental inductances must be those of a passive machine. */
static void check_machine(maker_t *m)
{
    const drive_params_t *p = m->params;
    const int64_t D = (int64_t)p->L_dh_rated * p->L_qh_rated - (int64_t)p->L_dqh_rated * p->L_dqh_rated;
    if (D <= 0) {
        refuse(m, DRIVE_PARAM_L_dqh_rated, "larger than the incremental inductances allow");
    } else if (p->start_method % 2 == 1 && p->L_q <= p->L_d) {
        refuse(m, DRIVE_PARAM_start_method, "injection needs L_q above L_d: take 0 or 2");
    }
}

static void check_board(maker_t *m)
{
    static const char reason[] = "beyond what the board bears: schematic";
    const drive_params_t *p = m->params;
    if (p->v_dc_max > p->v_limit) {
        refuse(m, DRIVE_PARAM_v_dc_max, reason);
    } else if (p->i_max > p->i_limit) {
        refuse(m, DRIVE_PARAM_i_max, reason);
    } else if (p->dead_time < p->dead_time_least) {
        refuse(m, DRIVE_PARAM_dead_time, reason);
    } else if (p->f_pwm < p->f_pwm_least || p->f_pwm > p->f_pwm_most) {
        refuse(m, DRIVE_PARAM_f_pwm, reason);
    } else {
        /* it bears all */
    }
}

static void make_limits(maker_t *m, drive_config_t *config)
{
    config->k_theta = config->position.pll_low.k_theta;
    config->i_d_light = per_unit(m, DRIVE_PARAM_i_d_light, m->base.i);
    config->omega_max = speed(m, DRIVE_PARAM_speed_max);
    config->v_share = fixed(m, pm_num_mul(si(m, DRIVE_PARAM_voltage_limit), pm_num_sqrt(pm_num_ratio(1, 3))),
                            UNIT_BITS, DRIVE_PARAM_voltage_limit);
    config->v_share = pm_min(config->v_share, modulator_reach(m, &config->modulator));
#if PM_CARRIES(NEEDS_BRIDGES)
    limit_windings(m, config);
#endif
    config->machine.R_s = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    config->machine.L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    config->machine.L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    config->machine.psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
}

static void make_units(const maker_t *m, drive_config_t *config)
{
    const pm_num_t mechanical = pm_num_div(m->base.omega, config->pole_pairs);
    config->per_mrad_s = pm_num_div(pm_num_dec(1, -3), mechanical);
    config->per_uNm = pm_num_div(pm_num_dec(1, -6), m->base.torque);
    config->per_mA = pm_num_div(pm_num_dec(1, -3), m->base.i);
}

/* What is beyond the range is refused by those who use it. */
static pm_q_t i_d_rated(const maker_t *m, const mtpa_config_t *mtpa)
{
    int32_t i_rated;
    (void)pm_num_to_fixed(pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i), Q_BITS, &i_rated);
    return mtpa_i_d(mtpa, i_rated);
}

/* A carrier must come through the regulator. */
static void check_injected(maker_t *m, const drive_config_t *config)
{
    const uint32_t traits = regulator_traits(config->regulator.id);
#if PM_HAS(current_sine)
    const uint32_t source = injection_traits((injection_id_t)m->params->injection);
    if ((source & (uint32_t)SOURCE_IN_REFERENCE) != 0U) {
        if ((traits & REGULATOR_FOLLOWS) == 0U) {
            refuse(m, DRIVE_PARAM_regulator, "does not follow a carrier in its reference: 1, 2 or 3");
        }
        return;
    }
#endif
    if ((traits & REGULATOR_SWITCHES) != 0U) {
        refuse(m, DRIVE_PARAM_regulator,
               PM_HAS(current_sine) ? "cannot add an injected voltage: injection 11, or start_method 2"
                                    : "cannot add an injected voltage: start_method 2");
    }
}

drive_result_t drive_configure(drive_config_t *config, const drive_params_t *params, uint32_t channels)
{
    maker_t m = {.params = params,
                 .channels = channels & PM_CHANNELS,
                 .result = {.ok = true, .param = DRIVE_PARAM_COUNT, .reason = "ok"}};
    check_ranges(&m);
    check_board(&m);
    check_machine(&m);
    if (!m.result.ok) {
        return m.result;
    }
    make_base(&m, config);
    config->base = m.base;
    config->pole_pairs = pole_pairs(&m);
    config->slow_divider = (uint16_t)m.slow_divider;
    config->i_max = per_unit(&m, DRIVE_PARAM_i_max, m.base.i);
    config->i_injection = config->i_max;
    config->injection =
        params->start_method % 2 == 1 || (params->start_method == 0 && injection_sees_saliency(&m));
#if PM_CARRIES(NEEDS_NEUTRAL)
    make_neutral(&m, &config->neutral);
#endif
#if PM_CARRIES(NEEDS_BRIDGES)
    make_windings(&m, config);
#endif
    choose_start(&m, config, channels);
    if (config->injection) {
        const injection_limits_t limits = injection_limits(&m);
        m.comp_zone = limits.comp_zone;
        m.swing = limits.swing;
        config->i_injection = pm_min(config->i_max, injection_current(&m));
    }
    make_modulator(&m, &config->modulator);
    make_regulator(&m, &config->regulator);
    if (config->injection) {
        check_injected(&m, config);
    }
    if (params->t_settle != 0 && (regulator_traits(config->regulator.id) & REGULATOR_SWITCHES) != 0U) {
        refuse(&m, DRIVE_PARAM_regulator, "hides currents from low-side shunts");
    }
    make_speed_control(&m, &config->speed);
    make_mtpa(&m, &config->mtpa);
    m.i_d_rated = i_d_rated(&m, &config->mtpa);
    make_field_weakening(&m, &config->field_weakening);
    make_position(&m, &config->position, config->injection);
    PM_IN_IMAGE(carrier_rest, make_rest(&m, &config->rest);)
    if (config->start != (uint8_t)SEQUENCE_align) {
        make_start(&m, config);
    }
    make_open_loop(&m, &config->open_loop);
    PM_IN_IMAGE(torque_polarity, make_torque_polarity(&m, &config->torque_polarity);)
    make_protection(&m, &config->protection, config->position.current_low, config->i_injection);
    make_fault_short(&m, &config->fault_short);
    PM_IN_IMAGE(six_step, make_block(&m, &config->block);)
    make_limits(&m, config);
    limit_imposed(config);
    make_units(&m, config);
    return m.result;
}
