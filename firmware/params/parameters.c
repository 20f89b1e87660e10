#include "firmware/params/parameters.h"

#include <string.h>

const drive_param_info_t drive_param_table[DRIVE_PARAM_COUNT] = {
#define PM_PARAM(name, unit, exp10, min, def, max, help) {#name, min, def, max},
#include "firmware/params/parameters.def"
#undef PM_PARAM
};

const int8_t drive_param_exp10[DRIVE_PARAM_COUNT + 1] = {
#define PM_PARAM(name, unit, exp10, min, def, max, help) exp10,
#include "firmware/params/parameters.def"
#undef PM_PARAM
};

const drive_param_text_t drive_param_text[DRIVE_PARAM_COUNT] = {
#define PM_PARAM(name, unit, exp10, min, def, max, help) {unit, help},
#include "firmware/params/parameters.def"
#undef PM_PARAM
};

void drive_params_default(drive_params_t *params)
{
    for (int32_t id = 0; id < (int32_t)DRIVE_PARAM_COUNT; id++) {
        drive_param_set(params, (drive_param_id_t)id, drive_param_table[id].def);
    }
    params->absent = 0;
}

/* Every member is an int32_t, so the struct has the layout of an array of them; those that are absent share one. */
_Static_assert(sizeof(drive_params_t) == (DRIVE_PARAM_COUNT + 1) * sizeof(int32_t),
               "a parameter is not 32 bits");

int32_t drive_param_get(const drive_params_t *params, drive_param_id_t id)
{
    int32_t value;
    memcpy(&value, (const uint8_t *)params + (uint32_t)id * sizeof value, sizeof value);
    return value;
}

void drive_param_set(drive_params_t *params, drive_param_id_t id, int32_t value)
{
    memcpy((uint8_t *)params + (uint32_t)id * sizeof value, &value, sizeof value);
}
