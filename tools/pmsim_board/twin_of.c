#include <stdio.h>
#include <string.h>

#include "firmware/app/app.h"
#include "tools/pmsim_board/twin.h"

#define PM_IMAGE(name) extern const twin_t twin_##name;
#include "firmware/images/images.def"
#undef PM_IMAGE

static const twin_t *const twins[] = {
#define PM_IMAGE(name) &twin_##name,
#include "firmware/images/images.def"
#undef PM_IMAGE
};

const twin_t *twin_of(const void *image, char *error, size_t error_size)
{
    const app_image_t *carried = image;
    if (carried == NULL) {
        (void)snprintf(error, error_size,
                       "has no variable app_image: not an image of pmdrive, or an older one");
        return NULL;
    }
    for (size_t n = 0; n < sizeof twins / sizeof twins[0]; n++) {
        if (strncmp(carried->name, twins[n]->name, sizeof carried->name) != 0) {
            continue;
        }
        if (carried->drive_bytes == twins[n]->drive_bytes &&
            carried->config_bytes == twins[n]->config_bytes) {
            return twins[n];
        }
        (void)snprintf(
            error, error_size,
            "image `%s` is of another build: its drive has %u bytes, here it has %u; build both anew",
            twins[n]->name, carried->drive_bytes, twins[n]->drive_bytes);
        return NULL;
    }
    (void)snprintf(error, error_size,
                   "image `%.*s` is of another build: firmware/images has none of that name here",
                   (int)sizeof carried->name, carried->name);
    return NULL;
}
