/* Entry of an image; a host program has its own. */
#include "firmware/app/app.h"

int main(void)
{
    static app_t app;
    hal_t *hal = hal_instance();
    app_boot(&app, hal);
    for (;;) {
        app_turn(&app);
        hal_idle(hal);
    }
}
