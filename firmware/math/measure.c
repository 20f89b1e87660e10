#include "firmware/math/measure.h"

#include <stddef.h>

const char *pm_need_text(uint32_t missing)
{
    static const struct {
        uint32_t bit;
        const char *text;
    } table[] = {
#define PM_NEED_ROW(name, needs, bit, what) {bit, "needs " what ": not on this board"},
        PM_NEED_LIST(PM_NEED_ROW, , )
#undef PM_NEED_ROW
    };
    for (uint32_t n = 0; n < sizeof table / sizeof table[0]; n++) {
        if ((missing & table[n].bit) != 0U) {
            return table[n].text;
        }
    }
    return "";
}
