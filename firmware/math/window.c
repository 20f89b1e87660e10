#include "firmware/math/window.h"

void window_reset(window_t *self, uint16_t n, pm_dq_t x)
{
    const pm_dq_t first = {.d = x.d >> 4, .q = x.q >> 4};
    *self = (window_t){.sum = {.d = first.d * (int32_t)n, .q = first.q * (int32_t)n}};
    for (uint16_t k = 0; k < n; k++) {
        self->x[k] = first;
    }
}
