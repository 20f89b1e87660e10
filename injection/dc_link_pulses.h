/* Initial position by six voltage pulses and the DC-link voltage: no current is measured (METHODS.md 9.5;
 * METHODS-ADDENDUM.md A2, B(b); row 103). For boards with one voltage sensor, and where currents of a pulse are not to
 * be seen.
 *
 * During a pulse the link feeds the current of the pulse's own leg, and its capacitor C drops behind the supply's resistance R:
 *   C pV = (V_s - V) / R - i_dc,  i_dc = duty i_x
 *   v_x = V before - V at the end = k P_x,  k = duty R (1 - (1 - e^{-u}) / u),  u = n T_s / (R C)
 * with P_x the current at the pulse's end: the formulas of the currents hold for v_x (injection/primary.h). V before is the
 * mean of four samples; a bridge's part is that of the currents times k.
 * k is worth having where R C >= pulse / 3 only; a stiff supply drops too little: refused when the parameters say so,
 * else PM_FAILED_POLARITY or PM_FAILED_SALIENCY by the margin.
 * Pulses are repeated `dc_link_repeats` times and added, because a drop is a few tens of steps of the converter and the
 * polarity a few of them: i_pulse of 1.5 times rated current wants four repeats, rated current more than eight.
 *
 * Between pulses all legs are off for dc_link_config_t.wait periods: the current's decay by the diodes, as long as the
 * pulse and half of it again, then 5 R C for the link.
 * Call dc_link_pulses_step() each period until it is not PM_RUNNING; after PM_DONE dc_link_pulses_find() once, outside
 * the control interrupt. PM_FAILED_OPEN: the voltage did not fall, nothing is connected.
 * Duration: 6 repeats (2.5 n + 5 R C / T_s + 7) periods and 1 ms: 120 ms for IPM-1000 with 1 ohm, 470 uF and four
 * repeats. Movement: 1 degree at most (IPM-1000, J of its load machine). Peak of the current: i_pulse and what saturation adds.
 * Tests: tests/unit/injection/dc_link_pulses_test.cpp, tests/scenario/dc_link_pulses.yaml and its twin. */
#ifndef INJECTION_DC_LINK_PULSES_H
#define INJECTION_DC_LINK_PULSES_H

#include "injection/primary.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint16_t periods; /* length of a pulse */
    uint16_t wait;    /* periods from the end of one to the next */
    uint16_t pulses;  /* all of them: six times the repeats */
    pm_q_t duty;
    primary_config_t limits; /* of the sums of all repeats */
} dc_link_pulses_config_t;

typedef struct {
    primary_t response;
    pm_q_t before; /* sum of four samples */
    uint16_t timer, pulse;
    pulses_found_t found;
} dc_link_pulses_t;

void dc_link_pulses_reset(dc_link_pulses_t *self);
pm_procedure_t dc_link_pulses_step(dc_link_pulses_t *self, const dc_link_pulses_config_t *config, pm_q_t v_dc,
                                   pulses_out_t *out);
pm_procedure_t dc_link_pulses_find(dc_link_pulses_t *self, const dc_link_pulses_config_t *config);

/* From the pulses of the currents, which it takes length and duty from. */
void make_dc_link_pulses(maker_t *m, const pulses_config_t *pulses, dc_link_pulses_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
