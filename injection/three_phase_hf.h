/* Initial position by a voltage that rotates and the amplitudes of the three currents that it makes (METHODS.md 9.7,
 * rows 106 and 107; METHODS-ADDENDUM.md A2 9.7.1). Nothing need be known of the position, and no loop is closed.
 *
 *   v = V_h e^{j phi_k}, phi_k and phi' of sine.h; of each leg x with axis g_x over M whole periods of the carrier
 *   I_x = 2/MN sum i_x e^{-j phi'} = I_p e^{j (rho - g_x)} + I_n e^{-j (rho_n + 2 theta - g_x)}
 *   |I_x|^2 = I_p^2 + I_n^2 + 2 I_p I_n cos(2 theta - rho_e - 2 g_x)
 * The order of the three squares is one of six sectors of 30 degrees, 0 ... 180:
 *   A C B  0,  C A B  1,  C B A  2,  B C A  3,  B A C  4,  A B C  5         largest first
 * once rho_e has been taken off their vector, which interpolates within the sector:
 *   2 theta = arg sum |I_x|^2 e^{j 2 g_x} + rho_e
 *   rho_e   = R / (omega_h L_sa) + (1 - kappa^2) / (1 + kappa^2) (rho - rho_0) / 2
 * The first part is the winding's resistance, 0.9 degrees of theta on IPM-1000 at 500 Hz; the second the inverter,
 * whose dead time acts as a resistance, on the negative sequence with half of what the phase rho of the positive one
 * shows beyond rho_0.
 *
 * Relative gains of the sensors from sum_x I_x, which is zero: two equations for g_A, g_B and -g_A - g_B. 1 % alone
 * errs by up to 7 degrees where the saliency is a twentieth.
 *
 * Polarity by the second harmonic (8.4.2), at twice the carrier, forwards:
 *   z = 1/MN sum i e^{-j 2 phi'} = F^2 / 8 (b + c) e^{j (2 rho - theta)},     polarity.h: margin
 *   margin = (|Re z e^{j (theta - 2 rho)}| - |Im| - I_p / 256) / sigma
 * of as many values of two milliseconds or more as polarity.h wants. No current is controlled meanwhile, so that dead
 * time makes more of it than in secondary_current.h: up to I_p / 350 was seen of linear machines, which is more than IPM-1000
 * shows at 35 V and 500 Hz. One below five sigma is PM_FAILED_POLARITY with an angle, after which the start goes on
 * with the polarity step that is configured.
 *
 * 16 ms rise, 8 ms wait, 64 ms measuring: 90 ms. Peak current: I_p + I_n. The rotor does not move: torque has the
 * frequency of the carrier and twice that. three_phase_hf_step() at most 150 instructions; the rest outside the
 * control interrupt.
 * PM_FAILED_NO_CURRENT: I_p below a quarter of the machine's; PM_FAILED_SALIENCY: I_n below a quarter or five sigma;
 * PM_FAILED_UNEVEN: gains beyond an eighth. State 150 bytes.
 * Tests: tests/unit/injection/three_phase_hf_test.cpp, tests/scenario/position_three_phase.yaml. */
#ifndef INJECTION_THREE_PHASE_HF_H
#define INJECTION_THREE_PHASE_HF_H

#include "injection/polarity.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    sine_config_t sine;
    pm_q_t share;     /* V_h / v_dc */
    pm_q_t rise;      /* of the share, in a period */
    uint16_t settled; /* periods before the first value */
    uint16_t block;   /* periods of a value, a whole number of the carrier's */
    uint16_t wanted;  /* values: a power of two */
    pm_q_t i_least;   /* a quarter of I_p / 2 */
    pm_q_t kappa;     /* I_n / I_p of the machine */
    pm_q_t rho_R;     /* R / (omega_h L_sa), rad */
    pm_q_t rho_0;     /* of the positive sequence, of the resistance alone, rad */
    pm_q_t inverter;  /* (1 - kappa^2) / (1 + kappa^2) / 2 */
    pm_q_t noise;     /* of |I_x| / 2 after all values, and of each part of z */
    bool reversed;    /* polarity.h: L_d_falls */
} three_phase_hf_config_t;

typedef struct {
    carrier_phase_t phase;
    pm_q_t share;
    uint16_t timer, values;                         /* periods, of a block when settled; values so far */
    bool settled, fresh;                            /* fresh: z has been renewed and not yet been read */
    int64_t cosine[PULSES_AXES], sine[PULSES_AXES]; /* Q27 */
    pm_ab_t block;                                  /* of the value that is being measured, z */
    pm_ab_t z;
    polarity_mean_t along, across;
    pulses_found_t found;
    uint16_t sector;
} three_phase_hf_t;

pm_procedure_t three_phase_hf_step(three_phase_hf_t *self, const three_phase_hf_config_t *config, pm_abc_t i,
                                   pulses_out_t *out);
void three_phase_hf_slow(three_phase_hf_t *self); /* each millisecond meanwhile */
/* After PM_DONE, once. PM_FAILED_POLARITY: found.theta is the angle but for its pole. */
pm_procedure_t three_phase_hf_find(three_phase_hf_t *self, const three_phase_hf_config_t *config);

void make_three_phase_hf(maker_t *m, three_phase_hf_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
