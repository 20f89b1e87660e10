/* The pulses of injection/initial_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"

PULSES_PROCEDURE(initial_pulses, initial_pulses_step(self, &config->pulses, drive->i_abc, &pulse),
                 initial_pulses_find(self, &config->pulses), self->train.found)
