/* Optional stages about a low-speed source, before its loop: what else moves the position that a saliency shows.
 * Each is off by default; a source without any costs what it does without this file.
 *
 *   virtual frame (METHODS.md 5.2.2.1, row 50): direct compensation of cross-coupling. A carrier along d locks where
 *     sin(2 (theta - theta_v) + theta_m) = 0, so it is injected and read in the frame theta_v = theta^ + theta_m / 2
 *     (k_r i_q = -theta_m / 2), and its current turned back. theta_m by saliency.h for the i_q of the last millisecond. The
 *     sources that read sequences turn them by theta_m, which is the same, and so need no such frame.
 *   several saliencies (5.4, row 54): beside I_n e^{j 2 theta} the machine has I_k e^{j (k theta + phi)}. Its error
 *     signal goes by what is in the table, I_k = r I_n without load:
 *     eps -= gain(i_q) I_k sin((k - 2) theta^ + phi),  k = -4, 8 (sixth harmonic of the angle), -10, 14 (twelfth)
 *   unlike phases (5.5, rows 55 and 56): a vector that stands, I_as e^{j phi}, moves the position by I_as / (2 I_n)
 *     sin(2 theta - phi). The loop follows it at low speed, so that the error signal does not show it; along the carrier
 *     it shows in first order, whatever the loop does:
 *     h_d = I_p + I_n + a cos 2 theta^ + b sin 2 theta^,  a + j b = I_as e^{j phi}
 *     c, a, b by least mean squares at 1 kHz with 0.4 s, while the rotor turns faster than 2 rad/s electrical; kept below that:
 *     eps -= gain (b cos 2 theta^ - a sin 2 theta^)
 *     Of a carrier along d alone; those of the stator are refused.
 *
 * The low-pass behind them (`injection_filter`) is that of all sources: injection.h.
 *
 * injection_stages_before(), _after(): each period 70 instructions with all; _slow(): 1 kHz. Not in a period: what was
 * learnt outlasts a reset of the source, not that of the position. Tests: tests/unit/injection/injection_stages_test.cpp,
 * tests/scenario/cross_coupling_direct.yaml, saliencies.yaml, inductance_asymmetry.yaml. */
#ifndef INJECTION_INJECTION_STAGES_H
#define INJECTION_INJECTION_STAGES_H

#include "injection/saliency.h"
#include "injection/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    bool on;      /* one of them is */
    bool direct;  /* virtual frame */
    bool several; /* saliencies */
    bool twelfth; /* their error is of that order, else of the sixth */
    bool unlike;  /* phases */
    pm_q_t a, b;  /* I_k of several saliencies: a cos + b sin */
    pm_q_t omega_least;
    saliency_config_t saliency;
} injection_stages_config_t;

typedef struct {
    pm_dir_t frame; /* theta_v - theta^ */
    int32_t gain;   /* rad per unit of current, Q20 */
    pm_q_t c;       /* of h_d: mean; 0: not known yet */
    pm_q_t as_a, as_b;
} injection_stages_t;

void injection_stages_reset(injection_stages_t *self, const injection_stages_config_t *config);

/* Makes of `in` what the source takes. */
void injection_stages_before(const injection_stages_t *self, const injection_stages_config_t *config,
                             const injection_in_t *in, injection_in_t *to_source);

/* And of its output what the drive takes. */
void injection_stages_after(injection_stages_t *self, const injection_stages_config_t *config,
                            const injection_in_t *in, injection_out_t *out);

/* h_d: along the carrier, of the last step. */
void injection_stages_slow(injection_stages_t *self, const injection_stages_config_t *config,
                           const obs_in_t *in, pm_q_t h_d);

/* `across`: the source reads along and across its carrier; flux: of that. */
void make_injection_stages(maker_t *m, injection_stages_config_t *c, bool across, pm_num_t flux);

#ifdef __cplusplus
}
#endif

#endif
