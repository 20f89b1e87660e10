#include "firmware/math/root.h"
#include "firmware/params/maker.h"
#include "injection/zero_second.h"

#if PM_HAS(secondary_voltage)

static pm_dq_t constant(maker_t *m, pm_num_t unit, drive_param_id_t re, drive_param_id_t im)
{
    return (pm_dq_t){fixed(m, pm_num_div(si(m, re), unit), Q_BITS, re),
                     fixed(m, pm_num_div(si(m, im), unit), Q_BITS, im)};
}

void make_zero_second(maker_t *m, zero_second_config_t *c)
{
    const drive_params_t *p = m->params;
    const pm_num_t unit = zero_unit(m);
    c->z_1 = constant(m, unit, DRIVE_PARAM_zero_second_1_re, DRIVE_PARAM_zero_second_1_im);
    c->z_5 = constant(m, unit, DRIVE_PARAM_zero_second_5_re, DRIVE_PARAM_zero_second_5_im);
    c->z_2 = constant(m, unit, DRIVE_PARAM_zero_second_2_re, DRIVE_PARAM_zero_second_2_im);
    c->z_4 = constant(m, unit, DRIVE_PARAM_zero_second_4_re, DRIVE_PARAM_zero_second_4_im);
    const pm_q_t odd = pm_hypot(c->z_1.d, c->z_1.q) - pm_hypot(c->z_5.d, c->z_5.q); /* at least */
    const pm_q_t even = pm_hypot(c->z_2.d, c->z_2.q) + pm_hypot(c->z_4.d, c->z_4.q);
    if (p->zero_second_v != p->v_injection || p->zero_second_f != p->f_injection) {
        refuse(m, DRIVE_PARAM_polarity,
               "4 knows the answer to zero_second_v and zero_second_f, not to this carrier");
    } else if (odd <= even) {
        refuse(m, DRIVE_PARAM_v_injection,
               "what shows the pole is smaller than what does not: a carrier too weak");
    } else {
        /* the sign is right at each angle, whatever becomes of the even part */
    }
}

#endif
