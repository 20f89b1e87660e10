/* Magnetic polarity by dual voltage pulses along d (METHODS.md 8.2, row 93).
 *
 * The angle is known but for half a turn. A pulse of +V along d for n periods, of -V for 2 n, of +V for n: the flux
 * goes to +F, -F and back to zero, with the current, and after a pause the same with opposite signs. All legs switch
 * about half duty, so that each pulse and its opposite are mirror images, with the edges, drops and resistances of
 * the bridge.
 *   V n T_s = i_pulse L_d,     duty of a leg = 1/2 + v_x / v_dc
 *   D = i_d at the four peaks, summed, - 2 d i_0 of each order = 2 (|I_+| - |I_-|)
 * i_0 is the current before an order, which resistance leaves of the one before; of it is left at the peaks
 *   d = (e^{-x} + e^{-3x}) / 2,  x = n T_s R / L_d
 * Whatever is odd in the voltage drops out of D: resistance, dead time, drops, gains of the sensors. What remains is
 * the core: D > 0 where d is the magnet's north.
 *   margin = (|D| - allowance) / (2 i_noise)
 *   allowance = 2 v_dc root(C_leg / L_d) + 4 I / 256:  what still rings when the pulses begin, converter's curve
 *
 * Before, the bridge is off until three periods are without current. 8 n + 60 periods: 17 ms on IPM-1000 with 4 A.
 * Peak current i_pulse and what the core adds. Torque only by error of the angle, both ways alike: the rotor stays.
 * dual_pulses_step() at most 90 instructions; dual_pulses_find() once, outside the control interrupt.
 * PM_FAILED_POLARITY: below five sigma, as with a linear machine; PM_FAILED_NO_CURRENT: peaks below a quarter of
 * i_pulse; PM_FAILED_TIMEOUT: the current before does not end.
 * Tests: tests/unit/injection/dual_pulses_test.cpp, tests/scenario/polarity_pulses.yaml. */
#ifndef INJECTION_DUAL_PULSES_H
#define INJECTION_DUAL_PULSES_H

#include "injection/polarity.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint16_t periods; /* n */
    uint16_t timeout; /* periods that a current from before may take to end */
    pm_q_t amplitude; /* V / v_dc */
    pm_q_t i_zero;    /* currents below count as zero */
    pm_q_t i_least;   /* mean of the peaks: below, nothing is connected */
    pm_q_t noise;     /* of D */
    pm_unit_t decay;  /* d */
    pm_q_t ringing;   /* part of the allowance */
    bool reversed;    /* polarity.h: L_d_falls */
} dual_pulses_config_t;

typedef struct {
    pm_q_t before;  /* mean of four samples before its first pulse */
    pm_q_t peak[2]; /* of the first and the second */
} dual_pulses_order_t;

typedef struct {
    dual_pulses_order_t order[2];
    uint16_t timer, quiet;
    bool driven;
    pm_sigma_t margin;
    bool north; /* d is the magnet's north */
} dual_pulses_t;

/* One period: d is the direction of the axis that is looked at. */
pm_procedure_t dual_pulses_step(dual_pulses_t *self, const dual_pulses_config_t *config, pm_ab_t i,
                                pm_dir_t d, pulses_out_t *out);
pm_procedure_t dual_pulses_find(dual_pulses_t *self, const dual_pulses_config_t *config);

void make_dual_pulses(maker_t *m, dual_pulses_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
