#include "observers/mismatch.h"

#include "firmware/math/image.h"
#include "firmware/params/maker.h"
#include "observers/model_config.h"

#if !PM_HAS(mismatch)

void make_mismatch(maker_t *m, mismatch_config_t *c)
{
    *c = (mismatch_config_t){.id = (uint8_t)MISMATCH_OFF};
    if (m->params->mismatch_correction != 0) {
        refuse(m, DRIVE_PARAM_mismatch_correction, "is not in this image");
    }
}

#else

#if PM_HAS(two_sets)
/* L_q is that of both sets, with M_q in it. */
static void make_alike(maker_t *m, mismatch_config_t *c)
{
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t apart = pm_num_sub(L_q, pm_num_mul(pm_num(2), si(m, DRIVE_PARAM_M_q)));
    if (m->params->winding != 2) {
        refuse(m, DRIVE_PARAM_mismatch_correction, "between two sets of windings: winding 2");
    } else {
        c->alike = fixed(m, pm_num_div(L_q, apart), Q_BITS, DRIVE_PARAM_M_q);
    }
}
#endif

/* Whole steps make a period of the injection. */
void make_mismatch(maker_t *m, mismatch_config_t *c)
{
    const drive_param_id_t frequency = DRIVE_PARAM_mismatch_frequency;
    const pm_num_t steps = pm_num_div(pm_num(1), pm_num_mul(si(m, frequency), m->t_slow));
    const int32_t samples = fixed(m, steps, 0, frequency);
    const pm_num_t w = pm_num_div(PM_NUM_TWO_PI, pm_num_mul(pm_num(samples), m->t_slow));
    const pm_num_t acceleration = pm_num_div(pm_num_mul(m->base.torque, pole_pairs(m)), si(m, DRIVE_PARAM_J));
    c->id = (uint8_t)m->params->mismatch_correction;
    c->periods = (uint8_t)m->slow_divider;
    c->samples = (uint16_t)samples;
    c->i = per_unit(m, DRIVE_PARAM_mismatch_current, m->base.i);
    make_model(m, &c->model);
#if PM_HAS(two_sets)
    c->alike = PM_ONE;
    if (c->id == (uint8_t)MISMATCH_APART) {
        make_alike(m, c);
    }
#else
    if (c->id == (uint8_t)MISMATCH_APART) {
        refuse(m, DRIVE_PARAM_mismatch_correction, "is not in this image");
    }
#endif
    c->swing = 0;
    if (c->id != (uint8_t)MISMATCH_OFF) {
        c->swing = fixed(m, pm_num_div(acceleration, square(w)), SMALL_BITS, frequency);
    }
}

#endif
