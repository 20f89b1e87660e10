/* Amplifiers, comparators and their reference: OPAMP1 to 3, COMP1, 2 and 4, DAC3. RM0440 22, 24, 25.
 *
 * An amplifier passes its leg's current on when it is on, its input pin is the shunt's, and it amplifies
 * sixteenfold with the board's bias network at VINM0. A comparator sees the pin in front of the amplifier; a
 * current out of the motor's terminal into the shunt raises it. Its hysteresis is left out.
 * Tests: analog_test.cpp. */
#ifndef BOARD_ANALOG_H
#define BOARD_ANALOG_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_chip_t *chip;
    board_registers_t opamp, comp, dac;
    double dac_ready_s[2];
} analog_t;

void analog_init(analog_t *analog, board_chip_t *chip);
void analog_reset(analog_t *analog);
cpu_device_t analog_opamp_device(analog_t *analog);
cpu_device_t analog_comp_device(analog_t *analog);
cpu_device_t analog_dac_device(analog_t *analog);

/* NULL: the amplifier of that leg passes its current on; else why not. */
const char *analog_fault(const analog_t *analog, int leg);

/* Level of the leg's comparator as a current below zero, as a share of full scale; false: it is off. */
bool analog_level(const analog_t *analog, int leg, double *share);

#endif
