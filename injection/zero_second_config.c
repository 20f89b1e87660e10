#include "firmware/math/trig.h"
#include "firmware/params/maker.h"
#include "injection/zero_second.h"

#if PM_HAS(secondary_voltage)

static pm_dq_t turned(pm_q_t x, pm_angle_t angle)
{
    const pm_dir_t dir = pm_dir(angle);
    return (pm_dq_t){pm_unit(x, dir.cos), pm_unit(x, dir.sin)};
}

/* dL_0 V_h^2 (b + c) / (8 omega_h), and A is an eighth of the unit. */
void make_zero_second(maker_t *m, zero_second_config_t *c)
{
    const pm_num_t v_h = si(m, DRIVE_PARAM_v_injection);
    const pm_num_t size = pm_num_mul(mul3(si(m, DRIVE_PARAM_dL_0), v_h, v_h), si(m, DRIVE_PARAM_zero_second));
    const pm_num_t per = mul3(pm_num(8), angular(m, DRIVE_PARAM_f_injection), zero_unit(m));
    const pm_q_t z_1 = fixed(m, pm_num_div(size, per), Q_BITS, DRIVE_PARAM_zero_second);
    const pm_q_t z_2 =
        fixed(m, si(m, DRIVE_PARAM_zero_second_even), Q_BITS, DRIVE_PARAM_zero_second_even) / 8;
    const pm_q_t delta =
        fixed(m, si(m, DRIVE_PARAM_zero_second_phase), Q_BITS, DRIVE_PARAM_zero_second_phase);
    const pm_angle_t angle = PM_TURN(0.25) + (pm_angle_t)pm_rad_to_angle(delta);
    c->z_1 = turned(z_1, angle);
    c->z_5 = turned(z_1 / 3, angle);
    c->z_2 = turned(z_2, angle + PM_TURN(0.25));
    if (m->params->zero_second == 0) {
        refuse(m, DRIVE_PARAM_polarity, "4 needs zero_second");
    } else if (z_1 / 3 * 2 <= pm_abs(z_2)) {
        refuse(m, DRIVE_PARAM_v_injection,
               "what shows the pole is smaller than what does not: a carrier too weak");
    } else {
        /* the sign is right at each angle, whatever becomes of the even part */
    }
}

#endif
