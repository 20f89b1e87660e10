#include "firmware/math/measure.h"

/* One by one, not from a table: an image has the words of the channels that it carries. */
#define PM_NAME_IF_MISSING(name, needs, bit, what)                                                           \
    if (PM_CARRIES(bit) && (missing & (bit)) != 0U) {                                                        \
        return "needs " what ": not on this board";                                                          \
    }

const char *pm_need_text(uint32_t missing)
{
    PM_NEED_LIST(PM_NAME_IF_MISSING, , )
    return (missing & PM_ALL) != 0U ? "is not in this image" : "";
}
