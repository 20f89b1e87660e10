/* Initial position by six voltage pulses in vector form (METHODS.md 9.2, 9.4.1, 9.4.2; rows 98, 100, 101).
 *
 * Pulses A+ A- B+ B- C+ C- of n periods at a duty cycle, each from zero current; between them all switches
 * are off and the diodes drive the current back to zero. With i_k the current vector at the end of the pulse
 * along the direction g_k:
 *   y = sum i_k e^{j g_k} = 6 I_2 e^{j 2 theta}     saliency: the angle, modulo 180 degrees
 *   w = sum i_k           ~ e^{j theta}             first-order saturation: the polarity
 * Both sums cancel offsets and gain errors of the sensors to first order. The torque of a pair of pulses
 * averages to zero.
 * Each component of a sum has 2 i_noise of noise: six currents of 2/3 i_noise^2 each.
 *   margin of saliency = |y| / (2 i_noise)
 *   margin of polarity = |w . e^{j theta}| / (2 i_noise)
 *
 * A one-shot procedure that owns the bridge: call initial_pulses_step() each period until it is not
 * PM_RUNNING. Fails with a reason when the current does not rise or fall in time, or when y or w is too small
 * against noise (y_min, w_min). Duration: about 6 (2 n + 5) periods.
 * Tests: tests/unit/injection/initial_pulses_test.cpp, tests/scenario. */
#ifndef INJECTION_INITIAL_PULSES_H
#define INJECTION_INITIAL_PULSES_H

#include "firmware/math/frames.h"
#include "firmware/math/procedure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint16_t periods; /* length of a pulse */
    uint16_t timeout; /* periods that the decay may take */
    pm_q_t duty;      /* of the driven leg, 0 ... 1 */
    pm_q_t i_zero;    /* currents below count as zero */
    pm_q_t y_min;     /* least lengths that count as a result: of y, and ... */
    pm_q_t w_min;     /* ... of w, 10 i_noise */
} initial_pulses_config_t;

typedef struct {
    pm_ab_t y, w;
    uint16_t pulse; /* 0 ... 5 */
    uint16_t timer;
    uint16_t quiet;
    bool decaying;
    pm_angle_t theta;     /* the result */
    pm_q_t length, along; /* |y|, and w along theta */
} initial_pulses_t;

/* What the legs do in the coming period. */
typedef struct {
    pm_q_t duty[3];
    bool driven;
} initial_pulses_out_t;

void initial_pulses_reset(initial_pulses_t *self);
pm_procedure_t initial_pulses_step(initial_pulses_t *self, const initial_pulses_config_t *config, pm_ab_t i,
                                   initial_pulses_out_t *out);

/* Of a result, the smaller of the two; at most 2560. */
pm_sigma_t initial_pulses_margin(const initial_pulses_t *self, const initial_pulses_config_t *config);

void make_initial_pulses(maker_t *m, initial_pulses_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
