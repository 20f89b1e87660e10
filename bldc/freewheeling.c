#include "bldc/freewheeling.h"

#include "firmware/math/root.h"

/* Of an EMF that is E at the commutation, 2 E per rad. */
#define FALLS PM_Q(1.8)

/* x / 2 */
static pm_q_t half_volts(const freewheeling_config_t *config, const freewheeling_in_t *in)
{
    pm_q_t share = PM_ONE; /* of v_dc */
    if (!pattern_chops_both(in->pattern)) {
        share = pattern_chops_incoming(in->pattern, in->sector) ? in->u : 2 * PM_ONE - in->u;
    }
    return pm_mean(pm_mul_sat(share, in->v_dc), pm_mul_sat(in->omega, config->emf));
}

pm_q_t freewheeling_angle(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t i)
{
    const pm_q_t i_3 = pm_mul_sat(3 * PM_ONE, i);
    const pm_q_t drop = pm_mul_sat(config->R, i_3) / 4;
    const pm_q_t most = pm_add_sat(half_volts(config, in), drop); /* (2 x + 3 R i) / 4 */
    const pm_q_t w = pm_div(drop, most), w_2 = pm_mul_sat(w, w);
    pm_q_t series = PM_Q(1.0 / 5) + pm_mul_sat(w_2, PM_Q(1.0 / 7));
    series = PM_Q(1.0 / 3) + pm_mul_sat(w_2, series);
    series = PM_ONE + pm_mul_sat(w_2, series);
    const pm_q_t rise = pm_mul_sat(pm_mul_sat(in->omega, config->L), i_3) / 4;
    return pm_mul_sat(pm_div(rise, most), 2 * series);
}

pm_q_t freewheeling_current(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t angle)
{
    const pm_q_t turned = pm_div(angle, pm_mul_sat(in->omega, config->L)); /* theta / (omega L) */
    const pm_q_t e = pm_min(pm_mul_sat(config->R, turned), PM_ONE);
    pm_q_t series = PM_Q(1.0 / 6) + pm_mul(e, PM_Q(1.0 / 24));
    series = PM_Q(1.0 / 2) + pm_mul(e, series);
    series = PM_ONE + pm_mul(e, series);
    const pm_q_t i = pm_mul_sat(pm_mul_sat(half_volts(config, in), turned), series);
    return pm_mul_sat(i, PM_Q(2.0 / 3));
}

pm_q_t freewheeling_braking(const freewheeling_config_t *config, const freewheeling_in_t *in, pm_q_t angle)
{
    const pm_q_t emf = pm_mul_sat(in->omega, config->emf);
    const pm_q_t left = pm_max(in->v_dc - emf, 0);
    pm_q_t v = pattern_chops_both(in->pattern) ? left : 0;
    v = pattern_chops_incoming(in->pattern, in->sector) && v == 0 ? 2 * left : v;
    v += pm_mul(pm_mul_sat(emf, angle), FALLS / 2);
    return pm_div(pm_mul_sat(v, angle), pm_mul_sat(3 * PM_ONE, pm_mul_sat(in->omega, config->L)));
}
