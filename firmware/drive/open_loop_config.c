#include "firmware/drive/config.h"
#include "firmware/params/maker.h"

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

void make_open_loop(maker_t *m, open_loop_config_t *c)
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

void limit_imposed(drive_config_t *config)
{
    open_loop_config_t *c = &config->open_loop;
    const pm_machine_t *machine = &config->machine;
    c->i_most = pm_min(config->i_max, pm_div(machine->psi_m / 9 * 4, machine->L_q - machine->L_d));
    c->i = pm_min(c->i, c->i_most);
}
