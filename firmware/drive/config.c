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

/* open_loop_config_t::k_yield, with the current of i_max or, where that is less, i_most. */
static uint16_t yield(maker_t *m, pm_num_t per_swing)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t difference = pm_num_cmp(L_q, L_d) < 0 ? pm_num_sub(L_d, L_q) : pm_num_sub(L_q, L_d);
    const pm_num_t flux = least(pm_num_mul(difference, si(m, DRIVE_PARAM_i_max)),
                                pm_num_mul(pm_num_ratio(4, 9), si(m, DRIVE_PARAM_psi_m)));
    const pm_num_t g = pm_num_div(mul3(per_swing, pm_num_ratio(3, 4), flux), m->base.psi);
    const pm_num_t k = pm_num_div(pm_num_ratio(3, 2), pm_num_add(pm_num(1), g));
    return (uint16_t)fixed(m, least(k, pm_num(1)), 15, DRIVE_PARAM_L_q);
}

/* A rotor swings about the current vector like a pendulum:
 *   w^2 = 3/2 p^2 psi i / J
 * The vector yields by k times the difference of the rotor's speed from its low-pass. The corner is 3 w, so
 * that J need not be known well, or as fast as steps of 1 kHz allow. Damping ratio: k w / (2 corner). */
static void make_damping(maker_t *m, open_loop_config_t *c)
{
    const pm_num_t psi = si(m, DRIVE_PARAM_psi_m);
    const pm_num_t stiffness =
        mul3(pm_num_mul(torque_share(m->params), square(pole_pairs(m))), psi, si(m, DRIVE_PARAM_i_open_loop));
    const pm_num_t turn = pm_num_mul(pm_num_sqrt(pm_num_div(stiffness, si(m, DRIVE_PARAM_J))), m->t_slow);
    const pm_num_t corners = least(pm_num_mul(pm_num(6), turn), pm_num_ratio(4, 5)); /* twice it */
    const pm_num_t emf = pm_num_mul(turn, psi);                                      /* in a step */
    const pm_num_t k = mul3(si(m, DRIVE_PARAM_open_loop_damping), corners, m->base.psi);
    c->k_swing = fixed(m, corners, FRAC_BITS - 1, DRIVE_PARAM_J);
    c->v_swing =
        fixed(m, least(pm_num_div(emf, pm_num_mul(m->t_slow, m->base.v)), pm_num(1)), Q_BITS, DRIVE_PARAM_J);
    const pm_num_t per_swing = pm_num_div(k, emf);
    c->per_swing = fixed(m, per_swing, SMALL_BITS, DRIVE_PARAM_psi_m);
    c->k_yield = yield(m, per_swing);
}

static void make_open_loop(maker_t *m, open_loop_config_t *c)
{
    const pm_num_t slope = pm_num_mul(si(m, DRIVE_PARAM_open_loop_acceleration), pole_pairs(m));
    c->i = per_unit(m, DRIVE_PARAM_i_open_loop, m->base.i);
    c->i_slope = c->i / 50 + 1;
    c->slope = fixed(m, pm_num_div(pm_num_mul(slope, m->t_slow), m->base.omega), Q_BITS,
                     DRIVE_PARAM_open_loop_acceleration);
    make_damping(m, c);
    c->align_ms = (uint16_t)m->params->t_align;
    c->sweep = PM_TURN(0.5) / (uint32_t)m->params->t_align;
}

/* i_most, and i_open_loop no larger: config.h */
static void limit_imposed(drive_config_t *config)
{
    open_loop_config_t *c = &config->open_loop;
    const pm_machine_t *machine = &config->machine;
    c->i_most = pm_min(config->i_max, pm_div(machine->psi_m / 9 * 4, machine->L_q - machine->L_d));
    c->i = pm_min(c->i, c->i_most);
}

static pm_q_t at_most_twice(maker_t *m, pm_num_t i_A, drive_param_id_t id)
{
    return fixed(m, least(pm_num_div(i_A, m->base.i), pm_num(2)), Q_BITS, id);
}

/* Square of a current that is borne for good, with a margin of 5 %. */
static pm_q_t borne(pm_q_t i)
{
    const pm_q_t more = i + i / 20;
    return pm_max(pm_mul(more, more), 1);
}

/* Where a carrier turns the currents' signs, what dead time takes of the voltage comes and goes faster than the integral of current
 * control follows, and pushes the current by half of this. */
static pm_q_t pushed(maker_t *m, pm_unit_t share)
{
    const pm_num_t k_p = mul3(angular(m, DRIVE_PARAM_current_bandwidth), si(m, DRIVE_PARAM_L_d),
                              pm_num_ratio(share, PM_UNIT_MAX));
    return at_most_twice(m, pm_num_div(dead_voltage(m), k_p), DRIVE_PARAM_dead_time);
}

static void make_protection(maker_t *m, protection_config_t *c, pm_unit_t share, pm_q_t most)
{
    const drive_params_t *p = m->params;
    const pm_q_t i_trip = per_unit(m, DRIVE_PARAM_i_trip, m->base.i);
    const pm_q_t i_rated = per_unit(m, DRIVE_PARAM_i_rated, m->base.i);
    c->v_dc_max = per_unit(m, DRIVE_PARAM_v_dc_max, m->base.v);
    c->v_dc_min = per_unit(m, DRIVE_PARAM_v_dc_min, m->base.v);
    c->i_trip_squared = pm_mulh(i_trip, i_trip);
    c->v_dc_span = c->v_dc_max - c->v_dc_min;
    c->v_dc_derate = per_unit(m, DRIVE_PARAM_v_dc_derate, m->base.v);
    c->i_sum = PM_Q(0.1);
    c->offset_max = fixed(m, pm_num_div(si(m, DRIVE_PARAM_offset_max), si(m, DRIVE_PARAM_i_full_scale)), 15,
                          DRIVE_PARAM_offset_max);
    c->heat_max = borne(pm_min(i_rated, 2 * PM_ONE));
    c->k_heat =
        fixed(m, pm_num_div(m->t_slow, si(m, DRIVE_PARAM_t_winding)), FRAC_BITS, DRIVE_PARAM_t_winding);
    /* where the bridge bears more than i_trip, it is not asked for as much */
    c->bridge_heat_max = borne(at_most_twice(m, si(m, DRIVE_PARAM_i_bridge), DRIVE_PARAM_i_bridge));
    c->k_bridge_heat =
        fixed(m, pm_num_div(m->t_slow, si(m, DRIVE_PARAM_t_bridge)), FRAC_BITS, DRIVE_PARAM_t_bridge);
    /* a current that dead time holds at zero is not one that does not conduct */
    const pm_q_t zone = at_most_twice(m, m->comp_zone, DRIVE_PARAM_comp_zone);
    const pm_q_t noise = per_unit(m, DRIVE_PARAM_i_noise, m->base.i);
    const pm_q_t hidden = pm_max(2 * zone, 8 * pm_min(noise, PM_Q_MAX / 8));
    const pm_q_t judged = pm_max(hidden, i_rated / 64);
    c->judged = pm_mul(judged, judged);
    const pm_q_t with_carrier = pm_max(judged, pushed(m, share));
    c->judged_carrier = pm_mul(with_carrier, with_carrier);
    c->temp_derate_dC = (int16_t)p->temp_derate;
    c->temp_trip_dC = (int16_t)p->temp_trip;
    c->omega_stall = speed(m, DRIVE_PARAM_speed_max) / 50;
    c->stall_ms = (uint16_t)p->t_stall;
    c->i_stall = pm_min(i_rated / 4 * 3, most / 16 * 15);
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
