/* Initial position by six voltage pulses and the signs of three numbers: boundary detection strategy (METHODS.md 9.4.1,
 * 9.4.3; METHODS-ADDENDUM.md A2; row 102). Additions and comparisons find the sector; no angle is computed.
 *
 * Pulses A+ A- B+ B- C+ C- (injection/pulses.h, which removes the difference of the sensors' gains). e_xk: current of leg
 * k, that of pulse x+ minus that of x-.
 *   X_A = (e_AB - e_AC) - (e_BB - e_CC) = X sin 2 theta
 *   X_B = (e_BC - e_BA) - (e_CC - e_AA) = X sin(2 theta + 120 degrees)
 *   X_C = (e_CA - e_CB) - (e_AA - e_BB) = X sin(2 theta - 120 degrees)
 * Signs of (X_A, X_B, X_C):
 *   ++-  0 ... 30    +-- 30 ... 60    +-+  60 ... 90    --+ 90 ... 120    -++ 120 ... 150    -+- 150 ... 180
 * +++ and --- are of no machine: PM_FAILED_UNEVEN. Which half of the turn: injection/primary.h.
 * Within a sector a is the one of them that vanishes at its beginning, b that at its end, both positive:
 *   a < I_th: the sign of a cannot be trusted, theta is the boundary before; b < I_th: the one behind
 *   else the centre of the sector; I_th = boundary_threshold X, sin 15 degrees: the error is 7.5 degrees at most
 *   or, with boundary_threshold 0, anywhere: 30 degrees (sector + a / (a + b)), whose own error is 0.55 degrees
 *   margin of saliency = X / (3.5 i_noise)
 *   margin of polarity: injection/primary.h
 * Without the threshold the error is 15 degrees, and from noise at a boundary the sector jumps.
 *
 * Use as initial_pulses.h; the same reasons. Duration: about 6 (2 n + 5) periods and 5 ms. Movement and peak of the
 * current are those of initial_pulses.h.
 * Tests: tests/unit/injection/boundary_detection_test.cpp, tests/scenario/boundary_detection.yaml and its twin. */
#ifndef INJECTION_BOUNDARY_DETECTION_H
#define INJECTION_BOUNDARY_DETECTION_H

#include "injection/basic_pulses.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t threshold; /* I_th / X */
    bool interpolated;
} boundary_detection_config_t;

typedef struct {
    basic_pulses_t pulses;
} boundary_detection_t;

void boundary_detection_reset(boundary_detection_t *self);
pm_procedure_t boundary_detection_step(boundary_detection_t *self, const pulses_config_t *config, pm_abc_t i,
                                       pulses_out_t *out);
pm_procedure_t boundary_detection_find(boundary_detection_t *self, const pulses_config_t *config,
                                       const boundary_detection_config_t *own);

void make_boundary_detection(maker_t *m, boundary_detection_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
