/* Application and plant as one loop, one control period at a time: the interrupts of a processor in order. */
#ifndef HAL_SIM_SIM_LOOP_H
#define HAL_SIM_SIM_LOOP_H

#include "firmware/app/app.h"
#include "hal/sim/port.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    app_t app;
    hal_t hal;
    double period_us, time_us;
} sim_loop_t;

/* The plant stays the caller's; the timer's clock is what the parameters want. Returns the drive's own
 * verdict on its parameters. */
drive_result_t sim_loop_init(sim_loop_t *loop, plant_t *plant, const drive_params_t *params);

/* The same from the store, as after power-on; loop->hal is set up by sim_hal_init() before. */
void sim_loop_boot(sim_loop_t *loop);

void sim_loop_step(sim_loop_t *loop);

#ifdef __cplusplus
}
#endif

#endif
