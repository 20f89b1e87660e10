/* The pulses of injection/boundary_detection.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"
#include "firmware/math/image.h"

#if PM_HAS(boundary_detection) /* has its configuration */

PULSES_PROCEDURE(boundary_detection, boundary_detection_step(self, &config->pulses, drive->i_abc, &pulse),
                 boundary_detection_find(self, &config->pulses, &config->boundary_detection),
                 self->pulses.train.found)

#endif
