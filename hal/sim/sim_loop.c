#include "hal/sim/sim_loop.h"

#include <math.h>

static void set_period(sim_loop_t *loop)
{
    loop->period_us =
        1e6 * ldexp((double)loop->app.drive.config.base.t_s.m, loop->app.drive.config.base.t_s.e);
    loop->time_us = 0.0;
}

drive_result_t sim_loop_init(sim_loop_t *loop, plant_t *plant, const drive_params_t *params)
{
    sim_hal_init(&loop->hal, plant);
    loop->hal.timer_Hz = 2U * (uint32_t)params->timer_counts * (uint32_t)params->f_pwm;
    const drive_result_t result = app_configure(&loop->app, &loop->hal, params, true);
    set_period(loop);
    return result;
}

void sim_loop_boot(sim_loop_t *loop)
{
    app_boot(&loop->app, &loop->hal);
    set_period(loop);
}

void sim_loop_step(sim_loop_t *loop)
{
    plant_sample(loop->hal.plant, &loop->hal.adc);
    app_control(&loop->app);
    if (loop->hal.slow_pending) {
        loop->hal.slow_pending = false;
        app_slow(&loop->app);
        app_monitor(&loop->app);
        app_turn(&loop->app);
    }
    sim_run_period(&loop->hal);
    loop->time_us += loop->period_us;
    loop->hal.time_us = (uint32_t)loop->time_us;
}
