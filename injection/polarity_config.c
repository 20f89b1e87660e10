#include "firmware/params/maker.h"
#include "injection/polarity.h"

#define TIME_MS 64U /* of all values */

/* A window gives 2/N of N samples with the cosine, and root(2/3) of the noise along an axis. */
polarity_carrier_t polarity_by_current(maker_t *m, uint32_t n, pm_q_t h_d)
{
    const pm_num_t share = n == 1U ? pm_num(1) : pm_num_sqrt(pm_num_ratio(4, 3 * (int32_t)n));
    const pm_num_t noise = pm_num_div(pm_num_mul(si(m, DRIVE_PARAM_i_noise), share), m->base.i);
    return (polarity_carrier_t){.periods = n,
                                .noise = fixed(m, noise, Q_BITS, DRIVE_PARAM_i_noise),
                                .h_d = h_d,
                                .reversed = m->params->L_d_falls != 0};
}

/* A rotor whose magnet points against the current leaves it as e^{w t}; the frame follows while
 *   w^2 = 3/2 p^2 psi_m i / J < (2 pi injection_bandwidth)^2 */
PM_APART static bool falls_off(const maker_t *m)
{
    const pm_num_t torque = mul3(pm_num_mul(torque_share(m->params), square(pole_pairs(m))),
                                 si(m, DRIVE_PARAM_psi_m), si(m, DRIVE_PARAM_i_polarity));
    const pm_num_t follows = square(angular(m, DRIVE_PARAM_injection_bandwidth));
    return pm_num_cmp(torque, pm_num_mul(follows, si(m, DRIVE_PARAM_J))) > 0;
}

void make_polarity(maker_t *m, const polarity_carrier_t *carrier, polarity_config_t *c)
{
    c->h_d = carrier->h_d;
    c->noise = pm_max(carrier->noise, 1);
    c->i_d = per_unit(m, DRIVE_PARAM_i_polarity, m->base.i);
    c->reversed = carrier->reversed;
    c->block_ms = (uint16_t)((carrier->periods + m->slow_divider - 1U) / m->slow_divider);
    c->values = 16;
    while (c->values < 64U && 2UL * c->values * c->block_ms <= TIME_MS) {
        c->values = (uint16_t)(2U * c->values);
    }
    if (m->params->i_polarity > m->params->i_max) {
        refuse(m, DRIVE_PARAM_i_polarity, "above i_max");
    } else if (m->params->polarity == 2 && falls_off(m)) {
        refuse(m, DRIVE_PARAM_i_polarity,
               "turns so light a rotor off its axis before injection_bandwidth sees it");
    } else {
        /* the frame follows the rotor */
    }
}
