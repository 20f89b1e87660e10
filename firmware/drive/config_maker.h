/* Makers of what is the drive's own; not for users of config.h. */
#ifndef DRIVE_CONFIG_MAKER_H
#define DRIVE_CONFIG_MAKER_H

#include "firmware/drive/config.h"
#include "firmware/params/maker.h"

#ifdef __cplusplus
extern "C" {
#endif

/* config_position.c */
void make_position(maker_t *m, position_config_t *c, bool injection);
void make_pulses(maker_t *m, initial_pulses_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
