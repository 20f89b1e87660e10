#include "hal/sim/port.h"

#include <string.h>

#define TIMER_HZ 170000000U

void sim_hal_init(hal_t *hal, plant_t *plant)
{
    memset(hal, 0, sizeof *hal);
    hal->plant = plant;
    if (plant != NULL) { /* for the store alone there is none */
        const plant_sensor_t *sensor = plant_sensor(plant);
        hal->board.i_full_scale_mA = (int32_t)(sensor->i_full_scale_A * 1e3 + 0.5);
        hal->board.v_full_scale_mV = (int32_t)(sensor->v_full_scale_V * 1e3 + 0.5);
    }
    hal->timer_Hz = TIMER_HZ;
    hal->temperature_dC = 250;
    hal->store_bytes_left = UINT32_MAX;
    memset(hal->store, 0xFF, sizeof hal->store);
}

hal_status_t hal_init(hal_t *hal, const hal_config_t *config)
{
    hal->armed = false;
    hal->configured = config->timer_counts > 0U;
    hal->timer_counts = config->timer_counts;
    return hal->configured ? HAL_OK : HAL_TIMER_COUNTS;
}

void hal_start(hal_t *hal, app_t *app)
{
    hal->app = app;
}

const char *hal_board_name(const hal_t *hal)
{
    (void)hal;
    return "simulated board";
}

/* Without limits of its own: those of the machine count. */
const hal_board_t *hal_board(const hal_t *hal)
{
    return &hal->board;
}

uint32_t hal_timer_Hz(const hal_t *hal)
{
    return hal->timer_Hz;
}

void hal_unique_id(const hal_t *hal, uint32_t id[3])
{
    (void)hal;
    id[0] = 0;
    id[1] = 0;
    id[2] = 0;
}

hal_reset_t hal_reset_cause(const hal_t *hal)
{
    (void)hal;
    return HAL_RESET_POWER;
}

bool hal_take_last_words(hal_t *hal, hal_last_words_t *words)
{
    (void)hal;
    (void)words;
    return false;
}

uint32_t hal_time_us(const hal_t *hal)
{
    return hal->time_us;
}

void hal_pend_slow(hal_t *hal)
{
    hal->slow_pending = true;
}

void hal_lock(hal_t *hal)
{
    (void)hal; /* one thing at a time */
}

void hal_unlock(hal_t *hal)
{
    (void)hal;
}

void hal_idle(hal_t *hal)
{
    (void)hal;
}

void hal_watchdog(hal_t *hal)
{
    hal->watchdog_fed++;
}

void hal_reset(hal_t *hal)
{
    hal_bridge_off(hal);
    hal->reset = true;
}
