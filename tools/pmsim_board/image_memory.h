/* What the application's memory begins with, the same on processor and host (firmware/app/app.h).
 *
 * The image carries no channels beside the common ones (PM_CHANNELS 0), the host all of them: what the image
 * passes to and from a step is the beginning of what the host passes. */
#ifndef PMSIM_BOARD_IMAGE_MEMORY_H
#define PMSIM_BOARD_IMAGE_MEMORY_H

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "firmware/drive/drive_state.h"
#include "hal/hal.h"

typedef struct {
    uint16_t i_leg[DRIVE_LEGS], v_dc;
    bool hw_fault;
} image_in_t;

typedef struct {
    uint16_t compare[DRIVE_LEGS][2];
    uint16_t legs, trip;
} image_out_t;

typedef struct {
    drive_t drive;
    image_in_t in;
    image_out_t out;
    hal_slow_t slow;
} image_memory_t;

static_assert(sizeof(image_in_t) == DRIVE_IN_COMMON, "what every image passes to a step");
static_assert(sizeof(image_out_t) == DRIVE_OUT_COMMON, "what every image passes from a step");

/* As the host's step takes them: nothing more was measured, nothing more is wanted. */
static inline drive_in_t image_in(const image_memory_t *image)
{
    drive_in_t in;
    memset(&in, 0, sizeof in);
    memcpy(&in, &image->in, sizeof image->in);
    return in;
}

static inline drive_out_t image_out(const image_memory_t *image)
{
    drive_out_t out;
    memset(&out, 0, sizeof out);
    memcpy(&out, &image->out, sizeof image->out);
    return out;
}

#endif
