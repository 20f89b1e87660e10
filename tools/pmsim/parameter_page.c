#include "tools/pmsim/parameter_page.h"

#include <stddef.h>

#include "firmware/app/app_parts.h"
#include "hal/sim/port.h"

/* hal/stm32g431/board.c, under another name: the port of the host has one of its own */
const hal_board_t *stm32g431_board(const hal_t *hal);

static bool takes(const drive_params_t *params, const char **refused, const char **reason)
{
    drive_config_t config;
    const drive_result_t result = drive_configure(&config, params, PM_CHANNELS);
    *refused = result.ok ? NULL : drive_param_table[result.param].name;
    *reason = result.ok ? NULL : result.reason;
    return result.ok;
}

uint32_t parameter_page(const drive_params_t *params, uint32_t words[STORE_WORDS], const char **refused,
                        const char **reason)
{
    return takes(params, refused, reason) ? app_page(params, 1, words) : 0;
}

bool parameter_page_suits_board(const drive_params_t *params, const char **refused, const char **reason)
{
    static hal_t hal;
    hal.board = *stm32g431_board(NULL);
    drive_params_t there = *params;
    app_take_board(&hal, &there);
    return takes(&there, refused, reason);
}
