/* The pulses of injection/four_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"

PULSES_PROCEDURE(four_pulses, four_pulses_step(self, &config->pulses, drive->i_abc, &pulse),
                 four_pulses_find(self, &config->pulses), self->train.found)
