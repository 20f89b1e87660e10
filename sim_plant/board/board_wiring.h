/* What lies between plant and chip: time of the plant, shunts, amplifiers, dividers, and the faults of the
 * board itself.
 *
 * The plant is moved on only where something happens in it: at sample instants, changes of legs, ends of
 * periods. Its period starts at the timer's update event, the centre of the all-low vector, at cycle `start`.
 */
#ifndef BOARD_WIRING_H
#define BOARD_WIRING_H

#include "sim_plant/board/cpu.h"
#include "sim_plant/plant.h"

typedef struct board_chip board_chip_t;

/* Gain from shunt to amplifier output 64/7, of which the bias network in front of the pins takes 4/7; a
 * shunt's full scale is the swing of 1.65 V at the output. */
#define BOARD_SUPPLY_V    3.3
#define BOARD_REFERENCE_V 1.212 /* inside the processor: DS12589 table 16 */
#define BOARD_INNER_GAIN  16.0
#define BOARD_LEGS        3

typedef struct {
    uint64_t start; /* cycle of the plant's period */
    bool in_step;   /* with TIM1: its update events are the plant's period ends */
    bool button, break_held, converter_stuck, oscillator_stopped, pll_fails;
    bool parity; /* option byte SRAM_PE: the memory's parity is checked */
    double temperature_degC, dial;
    double supply_V;         /* of the processor */
    bool driven[PLANT_LEGS]; /* what the plant was told last */
    plant_leg_state_t state[PLANT_LEGS];
} board_wiring_t;

/* Seconds since the start of the plant's period, at that cycle. */
double board_within_s(const board_chip_t *chip, uint64_t cycle);

/* The plant at that cycle of the present period, samples due before included. */
void board_catch_up(board_chip_t *chip, uint64_t cycle);

/* TIM1's outputs have changed: which legs the plant drives, and how, follows at this cycle. */
void board_drive(board_chip_t *chip, const bool driven[BOARD_LEGS],
                 const plant_leg_state_t state[BOARD_LEGS]);

/* Pins have new modes, functions or levels: outputs and inputs of the timer may have changed. */
void board_pins_changed(board_chip_t *chip);

/* Takes note of a break that comparators have made in the plant. */
void board_told(board_chip_t *chip);

/* Comparators of the legs as COMP and DAC have them set; anew after any change of these. */
void board_set_comparators(board_chip_t *chip);

#endif
