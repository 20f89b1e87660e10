/* Whether a rotor follows an imposed current vector, and with what share of its torque: by the EMF that answers it. The
 * vector i lies on the d-axis of the imposed frame, which turns at omega. A rotor that follows delta behind shows, in steady
 * state (METHODS.md 1.3.1.3, 5.9),
 *   along  = v_d - R i                     = omega sin(delta) (psi_m - (L_q - L_d) i cos(delta)) = omega torque / i
 *   across = v_q - omega (L_d + L_q) / 2 i = omega (psi_m cos(delta) - (L_q - L_d) / 2 i cos(2 delta))
 * and one that stands shows neither, but for what saliency makes of a vector that passes it, omega (L_q - L_d) / 2 i, which
 * changes its sign with each quarter turn and so does not last. The rotor follows where `across` in the direction of rotation, or
 * `along` either way, is more than half of what one without a load shows,
 *   e = omega (psi_m - (L_q - L_d) i / 2)
 * which counts as omega psi_m / 2 at least.
 *
 * R is what v_d / i was while rotor and vector were at rest at the end of the align: in it are the temperature and what dead
 * time and drops lose along the vector, which is the same when it turns, within R_s / 2 and v_dc / 64. Nothing is said where
 * e is below 2 (R i / 32 + v_dc / 512), R / 4 where there was no rest.
 *
 * The load is too high for the current where |along| > 0.65 e, 40 degrees of a round rotor; below 0.4 there is more
 * current than it needs.
 *
 * follow_slow() at 1 kHz while a vector is imposed. Filters of 20 ms; one division, at the end of a rest. State 36 bytes.
 * Tests: tests/unit/drive/follow_test.cpp, tests/scenario/fault_stall_open.yaml, open_loop_load.yaml,
 * open_loop_salient.yaml. */
#ifndef DRIVE_FOLLOW_H
#define DRIVE_FOLLOW_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/slip.h"

#ifdef __cplusplus
extern "C" {
#endif

/* For how long it must stand, twice what spoke for a rotor that follows taken off, and how far the vector must turn meanwhile:
 * friction F holds a rotor for 2 asin(F / i), and one that did not move in the align until the vector comes round. */
#define FOLLOW_STANDS_MS 60
#define FOLLOW_TURN      65536
#define FOLLOW_STANDS    (FOLLOW_TURN / 3)

#define FOLLOW_FOLLOWS_MS 30
#define FOLLOW_REST_MS    100U /* rest from which on R is taken from it */

typedef struct {
    pm_q_t omega; /* of the vector, electrical */
    pm_dq_t v;    /* in its frame, Q28 */
    pm_q_t i;     /* > 0 */
    pm_q_t v_dc;
    int32_t turn; /* of the vector in this ms, of FOLLOW_TURN, >= 0 */
} follow_in_t;

typedef struct {
    pm_q_t R, R_doubt;
    pm_q_t along, across; /* filtered; at rest: v_d */
    pm_q_t emf;           /* |e| where it says something, else 0 */
    pm_angle_t lag;       /* delta of a rotor that follows, from the first ms on */
    int32_t turned;       /* by the vector since the rotor was seen to follow, ... */
    int32_t least;        /* ... and what it must, of FOLLOW_TURN */
    uint16_t ms;          /* that it stands, or has rested */
    uint8_t follows_ms;
    bool follows; /* has been seen to since the vector stood */
} follow_t;

void follow_reset(follow_t *self, const pm_machine_t *machine);

/* The vector begins anew: from standstill with a rotor that may be anywhere, or from the angle of one that turns. R stays. */
void follow_again(follow_t *self, int32_t least);
void follow_resume(follow_t *self);

/* A millisecond with vector and rotor at rest, and the end of the rest. */
void follow_rest(follow_t *self, pm_q_t v_d);
void follow_rested(follow_t *self, const pm_machine_t *machine, pm_q_t i, pm_q_t v_dc);

/* True: the rotor does not follow. */
bool follow_slow(follow_t *self, const pm_machine_t *machine, const follow_in_t *in);

/* 1: the load asks for more current; -1: for less; 0 neither, or not known. */
int32_t follow_load(const follow_t *self);

#ifdef __cplusplus
}
#endif

#endif
