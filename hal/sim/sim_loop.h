/* Port `sim`: the drive closed on the plant, one control period at a time.
 *
 * The only place that knows both. Converter codes go from plant to drive and timer counts back unchanged, so
 * what runs here is what runs on the target. */
#ifndef SIM_LOOP_H
#define SIM_LOOP_H

#include "firmware/drive/drive_state.h"
#include "sim_plant/plant.h"

typedef struct {
    drive_t drive;
    plant_t *plant;
    drive_in_t in;
    drive_out_t out;
    int32_t temperature_dC; /* what the temperature sensor says */
    bool hw_fault;          /* held break input: a scenario injects it */
    double i_break_A;       /* over-current comparator of the board; 0: none */
    uint32_t periods;       /* run so far */
    uint32_t slow_divider;  /* periods per drive_slow() */
} sim_loop_t;

/* The plant stays the caller's. Returns the drive's own verdict on its parameters. */
drive_result_t sim_loop_init(sim_loop_t *loop, plant_t *plant, const drive_params_t *params);
void sim_loop_step(sim_loop_t *loop);

#endif
