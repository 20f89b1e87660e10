/* The pulses of injection/basic_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"

PULSES_PROCEDURE(basic_pulses, basic_pulses_step(self, &config->pulses, drive->i_abc, &pulse),
                 basic_pulses_find(self, &config->pulses), self->train.found)
