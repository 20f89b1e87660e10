/* The drive as an image has it, compiled for the host: what the image is compared with.
 *
 * The layout of drive_t depends on the methods of an image, so there is one twin for each image of
 * firmware/images, a shared library of its own; its caller sees the image's memory as bytes. twin_of() finds
 * the twin of an image by the name and the sizes that the image carries (app_image). */
#ifndef PMSIM_BOARD_TWIN_H
#define PMSIM_BOARD_TWIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tools/pmsim/rig.h"
#include "tools/pmsim_board/figures.h"

#ifdef __cplusplus
extern "C" {
#endif

/* SI values of the drive's signals, as its configuration has them (rig_sample.h) */
typedef struct {
    double v_V, i_A, omega_mech, psi_Wb, torque_Nm, J_kgm2;
    uint32_t fault_seen;
} twin_scale_t;

#define TWIN_SAME SIZE_MAX

/* `memory`: what app_instance of the image begins with; `before`: the drive, its first drive_bytes, as they
 * were at the entry of the interrupt. */
typedef struct {
    const char *name;
    uint32_t drive_bytes, config_bytes;
    size_t memory_bytes; /* of app_instance that is read */

    bool (*has)(uint32_t id); /* object of the dictionary: index * 256 + sub-index */
    /* NULL: the drive takes the page of parameters; else the reason, and the parameter */
    const char *(*configure)(const uint32_t page[], twin_scale_t *scale, const char **parameter);

    int (*mode)(const void *before); /* FIGURE_... */
    /* The same interrupt on the host, from `before` on: TWIN_SAME, or where the drive begins to differ. */
    size_t (*control)(void *before, const void *memory, bool event[FIGURE_EVENTS]);
    size_t (*slow)(void *before, const void *memory, bool event[FIGURE_EVENTS]);

    uint32_t (*period)(const void *memory);
    uint32_t (*slow_divider)(const void *memory);
    void (*sample)(twin_scale_t *scale, const void *memory, rig_sample_t *sample);
    void (*record)(const void *memory, record_period_t *record); /* legs and temperature */
} twin_t;

/* app_image of an image, NULL: it has none. NULL and a text when there is no twin. */
const twin_t *twin_of(const void *app_image, char *error, size_t error_size);

#ifdef __cplusplus
}
#endif

#endif
