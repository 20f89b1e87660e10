#include "firmware/drive/config.h"
#include "firmware/params/maker.h"

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

void make_protection(maker_t *m, protection_config_t *c, pm_unit_t share, pm_q_t most)
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
    const pm_num_t offset = pm_num_div(si(m, DRIVE_PARAM_offset_max), si(m, DRIVE_PARAM_i_full_scale));
    c->offset_max = (uint16_t)fixed(m, least(offset, pm_num(1)), 15, DRIVE_PARAM_offset_max);
    const pm_q_t noise = per_unit(m, DRIVE_PARAM_i_noise, m->base.i);
    c->rest = (uint16_t)(pm_max(12 * pm_min(noise, PM_ONE / 16), PM_ONE / 64) / (PM_ONE / 32768));
    c->heat_max = borne(pm_min(i_rated, 2 * PM_ONE));
    c->k_heat =
        fixed(m, pm_num_div(m->t_slow, si(m, DRIVE_PARAM_t_winding)), FRAC_BITS, DRIVE_PARAM_t_winding);
    /* where the bridge bears more than i_trip, it is not asked for as much */
    c->bridge_heat_max = borne(at_most_twice(m, si(m, DRIVE_PARAM_i_bridge), DRIVE_PARAM_i_bridge));
    c->k_bridge_heat =
        fixed(m, pm_num_div(m->t_slow, si(m, DRIVE_PARAM_t_bridge)), FRAC_BITS, DRIVE_PARAM_t_bridge);
    /* a current that dead time holds at zero is not one that does not conduct */
    const pm_q_t zone = at_most_twice(m, m->comp_zone, DRIVE_PARAM_comp_zone);
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
