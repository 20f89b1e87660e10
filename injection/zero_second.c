#include "injection/zero_second.h"

#include "firmware/math/image.h"
#include "firmware/math/trig.h"

#if PM_HAS(secondary_voltage)

static pm_ab_t sum_of(pm_dq_t a, pm_angle_t turn_a, pm_dq_t b, pm_angle_t turn_b)
{
    const pm_ab_t x = pm_park_inverse(a, pm_dir(turn_a));
    const pm_ab_t y = pm_park_inverse(b, pm_dir(turn_b));
    return (pm_ab_t){x.alpha + y.alpha, x.beta + y.beta};
}

pm_ab_t zero_second_odd(const zero_second_config_t *config, pm_angle_t theta)
{
    return sum_of(config->z_1, theta, config->z_5, 0U - 5U * theta);
}

pm_ab_t zero_second_even(const zero_second_config_t *config, pm_angle_t theta)
{
    return sum_of(config->z_2, 0U - 2U * theta, config->z_4, 4U * theta);
}

#endif
