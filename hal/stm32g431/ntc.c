#include "hal/stm32g431/ntc.h"

enum { FIRST_dC = -400, STEP_dC = 100, HIGHEST_dC = 1500, OPEN_CODE = 40, SHORT_CODE = 4000 };

/* Codes times 16 at -40, -30 ... degC */
static const uint16_t POINT[] = {1281,  2288,  3864,  6177,  9356,  13432, 18298, 23704, 29308, 34765,
                                 39800, 44248, 48046, 51213, 53809, 55915, 57615, 58984, 60088, 60979};
enum { POINTS = sizeof POINT / sizeof POINT[0] };

bool ntc_temperature(uint32_t code, int32_t *temperature_dC)
{
    *temperature_dC = HIGHEST_dC;
    if (code < OPEN_CODE || code > SHORT_CODE) {
        return false;
    }
    const int32_t x = (int32_t)code * 16;
    int32_t n = 1;
    while (n < POINTS - 1 && x > POINT[n]) {
        ++n;
    }
    const int32_t low = POINT[n - 1];
    *temperature_dC = FIRST_dC + (n - 1) * STEP_dC + (x - low) * STEP_dC / (POINT[n] - low);
    return true;
}
