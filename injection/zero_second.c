#include "injection/zero_second.h"

#include "firmware/math/image.h"
#include "firmware/math/trig.h"

#if PM_HAS(secondary_voltage)

pm_ab_t zero_second_of_pole(const zero_second_config_t *config, pm_angle_t theta)
{
    const pm_ab_t x = pm_park_inverse(config->z_1, pm_dir(theta));
    const pm_ab_t y = pm_park_inverse(config->z_5, pm_dir(0U - 5U * theta));
    return (pm_ab_t){x.alpha + y.alpha, x.beta + y.beta};
}

pm_ab_t zero_second_of_either(const zero_second_config_t *config, pm_angle_t theta)
{
    return pm_park_inverse(config->z_2, pm_dir(0U - 2U * theta));
}

#endif
