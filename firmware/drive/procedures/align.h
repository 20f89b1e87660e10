/* The rotor turns onto a current vector: the vector rises to i_open_loop and sweeps a quarter turn into its
 * place in the first half of t_align, because a rotor that stands opposite to it would feel no torque.
 *
 *   theta = 270 degrees + 90 degrees min(1, 2 t / t_align)
 * The vector yields to a swinging rotor (open_loop.c). Nothing is measured, so it cannot fail; who doubts the
 * result watches what follows. Tests: tests/unit/drive/open_loop_test.cpp, tests/scenario/spm_start.yaml. */
#ifndef DRIVE_PROCEDURES_ALIGN_H
#define DRIVE_PROCEDURES_ALIGN_H

#include <stdint.h>

typedef struct {
    uint16_t ms;
} align_t;

#endif
