/* Entry of an image; a host program has its own. */
#include "firmware/app/app.h"

app_t app_instance;

#ifndef PM_IMAGE_NAME
#define PM_IMAGE_NAME "no manifest"
#endif

const app_image_t app_image = {
    .name = PM_IMAGE_NAME,
    .drive_bytes = sizeof(drive_t),
    .config_bytes = sizeof(drive_config_t),
};

/* Under its own name in the image, for debuggers. */
int __attribute__((noipa)) main(void)
{
    hal_t *hal = hal_instance();
    app_boot(&app_instance, hal);
    for (;;) {
        app_turn(&app_instance);
        hal_idle(hal);
    }
}
