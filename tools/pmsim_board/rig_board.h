/* The rig of tools/pmsim with the flashed image on the emulated board instead of the drive on the host.
 *
 * The image is not told that it is watched: parameters are in its flash, commands come as CAN frames,
 * everything else through pins. After each control and each slow interrupt the drive's memory is compared
 * with that of the same function on the host; a bit that differs ends the run. */
#ifndef PMSIM_BOARD_RIG_BOARD_H
#define PMSIM_BOARD_RIG_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "tools/pmsim_board/bus_noise.h"

#ifdef __cplusplus
extern "C" {
#endif

/* For all rigs that are created after it. commands_by_bus: rig_command() says nothing, a master is on the
 * bus. */
void rig_board_image(const char *elf_path, bool commands_by_bus);

/* Each of them waits for gdb on that port before its first instruction; 0: on a free one. */
void rig_board_gdb(uint16_t port);

/* Others keep the bus busy, at 1 Mbit/s (bus_noise.h). */
void rig_board_bus_load(bus_noise_kind_t kind);

/* Beside the scenario, requests to the image keep it busy (load.h). */
void rig_board_busy(void);

/* Machines are wound for the board, with their presets: tools/pmsim/similarity.h. */
void rig_board_similar(void);

#ifdef __cplusplus
}
#endif

#endif
