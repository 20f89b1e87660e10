/* What the application's memory begins with, the same on processor and host (firmware/app/app.h). Included where the host
 * has the image's own header: layout and channels are those of the image. */
#ifndef PMSIM_BOARD_IMAGE_MEMORY_H
#define PMSIM_BOARD_IMAGE_MEMORY_H

#include "firmware/drive/drive_state.h"
#include "hal/hal.h"

typedef struct {
    drive_t drive;
    drive_in_t in;
    drive_out_t out;
    hal_slow_t slow;
} image_memory_t;

#endif
