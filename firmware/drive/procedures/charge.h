/* The capacitors that supply the upper switches' gate drivers are charged: all legs low for 2 ms, before the first
 * pulse of every start, because they have discharged while the bridge was off. Only on boards that declare
 * PM_BOOTSTRAP (firmware/math/measure.h).
 *
 *   periods = 2 ms f_pwm,   16 time constants of 1 uF at the 125 ohm of a driver such as L6387E
 * Nothing is measured, so it cannot fail. The machine is shorted meanwhile: a rotor that still turns is braked, and
 * its current is watched as that of any pulse. At a rail without a pause a capacitor lasts as long as its charge;
 * nothing limits the duty for it.
 * Tests: tests/unit/drive/charge_test.cpp, tests/contract/procedure_contract_test.cpp,
 * tests/target/board_faults/start_test.cpp. */
#ifndef DRIVE_PROCEDURES_CHARGE_H
#define DRIVE_PROCEDURES_CHARGE_H

#include <stdint.h>

#define CHARGE_MS 2

typedef struct {
    uint16_t count; /* periods so far */
} charge_t;

#endif
