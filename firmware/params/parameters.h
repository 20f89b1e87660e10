/* Parameters of the drive in SI decimals: one table, from which the per-unit configuration is made
 * (drive/config.h).
 *
 * drive_params_t holds one int32 per parameter; drive_param_table describes them in the same order. A value
 * outside its range, or a combination that cannot be, is refused by drive_configure(), which names it.
 * A parameter of methods that an image does not have is not in its table and has no id; it reads as 0 there, so
 * that code that nobody calls compiles. Tests: tests/unit/drive/parameters_test.cpp. */
#ifndef PARAMS_PARAMETERS_H
#define PARAMS_PARAMETERS_H

#include "firmware/math/image.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

struct drive_params {
#define PM_PARAM(name, unit, exp10, min, def, max, help) int32_t name;
#include "firmware/params/parameters.def"
#undef PM_PARAM
    union { /* what the image does not have: 0 */
        int32_t absent;
#define PM_PARAM(name, unit, exp10, min, def, max, help)
#define PM_NO_PARAM(name) int32_t name;
#include "firmware/params/parameters.def"
#undef PM_PARAM
    };
};

enum {
#define PM_PARAM(name, unit, exp10, min, def, max, help) DRIVE_PARAM_##name,
#include "firmware/params/parameters.def"
#undef PM_PARAM
    DRIVE_PARAM_COUNT,
#define PM_PARAM(name, unit, exp10, min, def, max, help)
#define PM_NO_PARAM(name) DRIVE_PARAM_##name = DRIVE_PARAM_COUNT,
#include "firmware/params/parameters.def"
#undef PM_PARAM
};

typedef struct {
    const char *name;
    int32_t min, def, max;
} drive_param_info_t;

extern const drive_param_info_t drive_param_table[DRIVE_PARAM_COUNT];
/* A value is its integer times 10^exp10; the last is for those that are absent. */
extern const int8_t drive_param_exp10[DRIVE_PARAM_COUNT + 1];

/* What people read; the firmware does without it. */
typedef struct {
    const char *unit;
    const char *help;
} drive_param_text_t;

extern const drive_param_text_t drive_param_text[DRIVE_PARAM_COUNT];

void drive_params_default(drive_params_t *params);
int32_t drive_param_get(const drive_params_t *params, drive_param_id_t id);
void drive_param_set(drive_params_t *params, drive_param_id_t id, int32_t value); /* range is checked later */

#ifdef __cplusplus
}
#endif

#endif
