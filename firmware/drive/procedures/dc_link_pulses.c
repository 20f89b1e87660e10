/* The pulses of injection/dc_link_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"
#include "firmware/math/image.h"

#if PM_HAS(dc_link_pulses) /* has its configuration */

PULSES_PROCEDURE(dc_link_pulses,
                 dc_link_pulses_step(self, &config->dc_link_pulses, drive->status.v_dc, &pulse),
                 dc_link_pulses_find(self, &config->dc_link_pulses), self->found)

#endif
