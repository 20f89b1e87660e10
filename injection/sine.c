#include "injection/sine.h"

#include "firmware/math/root.h"

/* A transient of the current must not turn the phase further than the inverter could: rad. */
#define DELTA_MOST PM_Q(0.7)

pm_dir_t sine_phase(pm_q_t cosine, pm_q_t sine)
{
    const pm_q_t delta = pm_angle_to_rad((int32_t)pm_atan2(sine, cosine));
    return pm_dir((pm_angle_t)pm_rad_to_angle(pm_clamp(delta, -DELTA_MOST, DELTA_MOST)));
}
