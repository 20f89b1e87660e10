#include "injection/injection_stages.h"

#include "firmware/math/image.h"
#include "firmware/math/trig.h"
#include "injection/saliency_config.h"

#if PM_HAS(injection_stages)

#define OMEGA_LEAST pm_num(2)

/* r I_n sin(n theta + phi), n = -6, 6, -12, 12; I_n = 1 / (2 gain) without load */
static void make_several(maker_t *m, injection_stages_config_t *c)
{
    const int32_t n = m->params->saliency_order - 2;
    if (m->params->saliency_order == 0) {
        return;
    }
    if (n != -6 && n != 6 && n != -12 && n != 12) {
        refuse(m, DRIVE_PARAM_saliency_order, "is none of 0, -4, 8, -10, 14");
        return;
    }
    const pm_num_t gain_0 = pm_num_from_fixed(c->saliency.gain_0, SMALL_BITS);
    const pm_num_t size = pm_num_div(si(m, DRIVE_PARAM_saliency_ratio), pm_num_mul(pm_num(2), gain_0));
    const pm_q_t i_k = fixed(m, size, Q_BITS, DRIVE_PARAM_saliency_ratio);
    const pm_q_t rad = fixed(m, si(m, DRIVE_PARAM_saliency_phase), Q_BITS, DRIVE_PARAM_saliency_phase);
    const pm_dir_t phase = pm_dir((pm_angle_t)pm_rad_to_angle(rad));
    c->several = true;
    c->twelfth = n > 6 || n < -6;
    c->a = pm_unit(i_k, phase.sin);
    c->b = n < 0 ? -pm_unit(i_k, phase.cos) : pm_unit(i_k, phase.cos);
}

void make_injection_stages(maker_t *m, injection_stages_config_t *c, bool across, pm_num_t flux)
{
    *c = (injection_stages_config_t){.direct = across && m->params->cross_coupling_comp == 2,
                                     .unlike = m->params->asymmetry_learning != 0};
    if (across) {
        make_saliency_across(m, &c->saliency, flux);
    } else {
        make_saliency_sequence(m, &c->saliency, flux);
    }
    if (!across && c->unlike) {
        refuse(m, DRIVE_PARAM_asymmetry_learning, "needs a carrier along d: injection 0 or 4");
    }
    make_several(m, c);
    c->omega_least = fixed(m, pm_num_div(OMEGA_LEAST, m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
    c->on = c->direct || c->several || c->unlike;
}

#endif
