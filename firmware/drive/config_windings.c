/* Configuration of two bridges: open_winding.h, two_sets.h. */
#include "firmware/control/regulator.h"
#include "firmware/drive/config.h"
#include "firmware/params/maker.h"

#if PM_CARRIES(NEEDS_BRIDGES)

#define SHARE_MOST 200 /* over 201: below one */

/* Sources that read one star point: an open winding has none, and with two sets they err by 8 degrees while both have a
 * carrier, at M = 0.3 L. */
static bool is_of_one_star(int32_t injection)
{
    return injection == (int32_t)INJECTION_zero_anti_rotating ||
           injection == (int32_t)INJECTION_zero_rotating || injection == (int32_t)INJECTION_zero_pulsating;
}

void check_one_bridge(maker_t *m)
{
    static const char reason[] = "knows one bridge: winding 0";
    const drive_params_t *p = m->params;
    if (p->start_method == 1) {
        refuse(m, DRIVE_PARAM_start_method, "pulses know one bridge: take 0, 2 or 3");
    } else if (p->start_method != 2 && is_of_one_star(p->injection)) {
        refuse(m, DRIVE_PARAM_injection, "reads one star: with two sets injection 12 or 13");
    } else if (p->flying_start != 0) {
        refuse(m, DRIVE_PARAM_flying_start, reason);
    } else if (p->commutation != 0) {
        refuse(m, DRIVE_PARAM_commutation, reason);
    } else if ((regulator_traits((regulator_id_t)p->regulator) & REGULATOR_SWITCHES) != 0U) {
        refuse(m, DRIVE_PARAM_regulator, reason);
    } else if (p->t_settle != 0) {
        refuse(m, DRIVE_PARAM_t_settle, "two bridges need shunts in the lines");
    } else {
        /* they can be run */
    }
}

void make_windings(maker_t *m, drive_config_t *config)
{
    config->winding = (uint8_t)m->params->winding;
    PM_IN_IMAGE(
        open_winding,
        if (config->winding == (uint8_t)WINDING_OPEN) { make_open_winding(m, &config->open_winding); })
    PM_IN_IMAGE(
        two_sets, if (config->winding == (uint8_t)WINDING_TWO_SETS) { make_two_sets(m, &config->two_sets); })
}

/* Length of the vector over v_dc. */
static pm_num_t reach(const maker_t *m)
{
    if (m->params->winding == (int32_t)WINDING_OPEN) {
        return pm_num(1);
    }
    return m->params->neutral_channel == 1 ? pm_num_ratio(1, 2) : pm_num_sqrt(pm_num_ratio(1, 3));
}

void limit_windings(maker_t *m, drive_config_t *config)
{
    if (config->winding == (uint8_t)WINDING_STAR) {
        return;
    }
    config->modulator.ripple = 0; /* that of two bridges is another */
    const pm_num_t share = pm_num_mul(si(m, DRIVE_PARAM_voltage_limit), reach(m));
    config->v_share = fixed(m, least(share, pm_num_ratio(SHARE_MOST, SHARE_MOST + 1)), UNIT_BITS,
                            DRIVE_PARAM_voltage_limit);
    if (config->winding == (uint8_t)WINDING_OPEN) { /* three currents that flow alike, half of i_max each */
        const pm_q_t most = pm_min(config->i_max, PM_Q_MAX / 2); /* a larger one is refused */
        config->protection.i_sum = most / 2 * 3;
    }
}

#endif
