/* The rig of tools/pmsim with the flashed image on the emulated board instead of the drive on the host.
 *
 * The image is not told that it is watched: parameters are in its flash, commands come as CAN frames,
 * everything else through pins. After each control and each slow interrupt the drive's memory is compared
 * with that of the same function on the host; a bit that differs ends the run. */
#ifndef PMSIM_BOARD_RIG_BOARD_H
#define PMSIM_BOARD_RIG_BOARD_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* For all rigs that are created after it. commands_by_bus: rig_command() says nothing, a master is on the
 * bus. */
void rig_board_image(const char *elf_path, bool commands_by_bus);

/* The same: beside the scenario the bus keeps the image busy (load.h). */
void rig_board_busy(void);

#ifdef __cplusplus
}
#endif

#endif
