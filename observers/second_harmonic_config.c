#include "observers/second_harmonic.h"

#include "firmware/math/image.h"
#include "firmware/params/maker.h"
#include "observers/loop.h"

#if !PM_HAS(second_harmonic)

void make_second_harmonic(maker_t *m, second_harmonic_config_t *c)
{
    *c = (second_harmonic_config_t){.id = SECOND_HARMONIC_STAYS};
    if (m->params->second_harmonic != 0) {
        refuse(m, DRIVE_PARAM_second_harmonic, "is not in this image");
    }
}

#else

/* Learns within 2 T / mu = 50 ms; the loop's gains as they act while the observer leads. */
void make_second_harmonic(maker_t *m, second_harmonic_config_t *c)
{
    const bool ekf = m->params->position_observer == (int32_t)LOOP_SIMPLIFIED_EKF;
    const bool stays =
        m->params->second_harmonic == (int32_t)SECOND_HARMONIC_STAYS; /* then gains may be beyond */
    const pm_num_t loop = pm_num_div(angular(m, DRIVE_PARAM_flux_bandwidth), m->base.omega);
    const pm_num_t w_n = stays ? pm_num(0) : loop;
    const pm_num_t r = pm_num_mul(LOOP_EKF_SHARE, w_n);
    const pm_num_t two = pm_num(2);
    const pm_num_t k_p = ekf ? pm_num_mul(two, r) : pm_num_mul(pm_num_ratio(9, 5), w_n);
    const pm_num_t k_i = ekf ? mul3(two, r, r) : square(w_n);
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    *c = (second_harmonic_config_t){
        .id = (second_harmonic_id_t)m->params->second_harmonic,
        .mu = fixed(m, pm_num_mul(pm_num(40), m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm),
        .k_p = fixed(m, k_p, Q_BITS, DRIVE_PARAM_flux_bandwidth),
        .k_i = fixed(m, k_i, Q_BITS, DRIVE_PARAM_flux_bandwidth),
        .k_1 = ekf ? fixed(m, mul3(r, r, r), Q_BITS, DRIVE_PARAM_flux_bandwidth) : 0,
        .omega_least = fixed(m, w_n, Q_BITS, DRIVE_PARAM_flux_bandwidth) / 6,
        .t_s = fixed(m, step, FRAC_BITS, DRIVE_PARAM_f_pwm),
    };
    if (c->id != SECOND_HARMONIC_STAYS && m->params->position_observer == (int32_t)LOOP_ARCTANGENT) {
        refuse(m, DRIVE_PARAM_second_harmonic, "learns nothing behind the arctangent");
    }
}

#endif
