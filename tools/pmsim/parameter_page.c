#include "tools/pmsim/parameter_page.h"

#include <stddef.h>

#include "firmware/app/app.h"

uint32_t parameter_page(const drive_params_t *params, uint32_t words[STORE_WORDS], const char **refused,
                        const char **reason)
{
    drive_config_t config;
    const drive_result_t result = drive_configure(&config, params, PM_CHANNELS);
    *refused = result.ok ? NULL : drive_param_table[result.param].name;
    *reason = result.ok ? NULL : result.reason;
    return result.ok ? app_page(params, 1, words) : 0;
}
