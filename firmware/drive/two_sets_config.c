#include "firmware/drive/two_sets.h"

#include "firmware/math/compiler.h"
#include "firmware/params/maker.h"
#include "injection/injection.h"
#include "observers/observer.h"

#if PM_HAS(two_sets)

static bool is_third(int32_t observer)
{
    return observer == (int32_t)OBSERVER_third_integration || observer == (int32_t)OBSERVER_third_sogi ||
           observer == (int32_t)OBSERVER_third_crossings || observer == (int32_t)OBSERVER_third_pair ||
           observer == (int32_t)OBSERVER_third_pair_flux;
}

static void check(maker_t *m)
{
    const drive_params_t *p = m->params;
    if (2 * (int64_t)p->M_d >= p->L_d) {
        refuse(m, DRIVE_PARAM_M_d, "half of L_d or more: L_d is that of both sets, with M_d in it");
    } else if (2 * (int64_t)p->M_q >= p->L_q) {
        refuse(m, DRIVE_PARAM_M_q, "half of L_q or more: L_q is that of both sets, with M_q in it");
    } else if (p->neutral_channel == 1 && is_third(p->observer)) {
        refuse(m, DRIVE_PARAM_observer, "needs each star point: neutral_channel 0");
    } else {
        check_one_bridge(m);
    }
}

PM_APART void make_two_sets(maker_t *m, two_sets_config_t *c)
{
    require(m, NEEDS_BRIDGES | NEEDS_SECOND_SET, DRIVE_PARAM_winding);
    check(m);
    if (!m->result.ok) {
        return;
    }
    c->between = m->params->neutral_channel == 1;
    /* The same control for a machine of the difference: L - M, and no magnet. */
    drive_params_t difference = *m->params;
    difference.L_d -= 2 * difference.M_d;
    difference.L_q -= 2 * difference.M_q;
    difference.psi_m = 0;
    maker_t of_z = *m;
    of_z.params = &difference;
    make_synchronous_pi(&of_z, &c->regulator);
    c->slowed = c->regulator;
    synchronous_pi_slow_down(&c->slowed, PM_UNIT_MAX / 8);
    m->result = of_z.result;
    c->R = fixed(m, pm_num_div(si(m, DRIVE_PARAM_R_s), m->impedance), Q_BITS - 1, DRIVE_PARAM_R_s);
    c->L = fixed(m, pm_num_div(si(&of_z, DRIVE_PARAM_L_q), pm_num_mul(m->impedance, m->base.t_s)),
                 BRIDGES_L_BITS, DRIVE_PARAM_L_q);
}

#endif
