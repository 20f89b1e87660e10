#include "firmware/drive/block.h"

#include "firmware/drive/drive.h"
#include "firmware/params/maker.h"

/* A sector takes less than 2^27 counts, also four times as slow as expected. */
#define COUNTS_MOST 16777216

static uint32_t needs(void)
{
    static const uint16_t of[] = {
#define PM_METHOD(name, help, traits, needs) needs,
#include "firmware/drive/commutations.def"
#undef PM_METHOD
    };
    return of[1];
}

static void make_from_rest(maker_t *m, block_config_t *c)
{
    const pm_num_t torque = mul3(pm_num_mul(pm_num_ratio(3, 2), square(pole_pairs(m))),
                                 si(m, DRIVE_PARAM_psi_m), si(m, DRIVE_PARAM_i_open_loop));
    const pm_num_t sixth = pm_num_mul(PM_NUM_TWO_PI, pm_num_ratio(1, 6)); /* twice 30 degrees */
    const pm_num_t t_30 = pm_num_sqrt(pm_num_div(pm_num_mul(sixth, si(m, DRIVE_PARAM_J)), torque));
    const pm_num_t per_s = pm_num_mul(pm_num(2 * m->params->timer_counts), si(m, DRIVE_PARAM_f_pwm));
    const int32_t counts = fixed(m, pm_num_mul(t_30, per_s), 0, DRIVE_PARAM_J);
    if (c->from_rest && counts > COUNTS_MOST) {
        refuse(m, DRIVE_PARAM_i_open_loop, "turns this inertia too slowly for block commutation");
    }
    c->t_30 = (uint32_t)counts;
    c->i_start = per_unit(m, DRIVE_PARAM_i_open_loop, m->base.i);
}

void make_block(maker_t *m, block_config_t *c)
{
    const drive_params_t *p = m->params;
    c->on = p->commutation != 0;
    if (!c->on) {
        return;
    }
    require(m, needs(), DRIVE_PARAM_commutation);
    c->tries = (uint8_t)p->resync_tries;
    c->limit = p->freewheeling_limit != 0;
    c->from_rest = p->six_step_start != 0;
    make_from_rest(m, c);
    c->omega_on = speed(m, DRIVE_PARAM_six_step_speed);
    c->omega_off = c->omega_on / 4 * 3;
    /* a quarter in pi / 3 */
    c->duty_turn =
        fixed(m, mul3(m->base.omega, m->t_slow, pm_num_ratio(239, 1000)), Q_BITS, DRIVE_PARAM_f_pwm);
    c->duty_step = fixed(m, pm_num_div(m->t_slow, si(m, DRIVE_PARAM_t_duty)), Q_BITS, DRIVE_PARAM_t_duty);
    c->per_code = per_unit(m, DRIVE_PARAM_v_terminal_full_scale, m->base.v);
    const pm_num_t blind = pm_num_add(si(m, DRIVE_PARAM_t_blank), m->base.t_s);
    c->blind = fixed(m, pm_num_mul(blind, m->base.omega), Q_BITS, DRIVE_PARAM_t_blank);
    make_six_step(m, &c->six_step);
    const int32_t legs = pattern_chops_both(c->six_step.pattern.id) ? 2 : 1;
    const pm_num_t dead = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    c->lost = fixed(m, pm_num_mul(pm_num(legs), dead), Q_BITS, DRIVE_PARAM_dead_time);
    const pm_num_t L = pm_num_mul(pm_num(16 / legs), si(m, DRIVE_PARAM_L_d));
    const pm_num_t ripple = pm_num_div(pm_num_mul(m->base.t_s, m->impedance), L);
    c->ripple = fixed(m, least(ripple, pm_num(4)), Q_BITS, DRIVE_PARAM_L_d);
    make_line_current(m, &c->current);
    c->current.most = c->six_step.pattern.most;
    make_freewheeling(m, &c->freewheeling);
    if (!c->from_rest && p->six_step_speed < p->speed_high) {
        refuse(m, DRIVE_PARAM_six_step_speed, "below speed_high, where the flux observer is not alone yet");
    }
}
