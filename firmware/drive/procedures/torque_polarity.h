/* Polarity by which way a torque turns the rotor, for a machine whose axis is known and whose saturation does not tell its
 * poles apart: what a start falls back to when its pulses have found no polarity.
 *
 * On top of position control by injection a current along q is given in pulses, each one step larger than the last, until the
 * rotor has turned by 22.5 electrical degrees, then pulses of the opposite sign until it has come back by as much:
 *   d is the north    if it has turned forwards with +i_q and backwards with -i_q,
 *   d is the south    if it has turned backwards with +i_q and forwards with -i_q.
 * One of the two without the other is the load's doing, and decides nothing. A rotor that swings or turns by itself says nothing of
 * the torque: before the first pulse it has to stay within 5.6 degrees for 40 ms. Where it is so fast that the EMF shows the pole
 * (slip.h), that is it. Across the axis a current makes no torque of reluctance; on a vector that stands still (align.h) it does,
 * and with (L_q - L_d) i > psi_m the rotor rests to either side of it. The angle is looked at 8 ms after each pulse, without
 * current: with it, cross-saturation moves the axis that injection sees.
 *
 * A rotor that comes off its friction is turned by one step too much; injection follows it, and it does not go far by itself, while
 *   3/2 p^2 psi_m step / J <= 1/16 rad (2 pi injection_bandwidth)^2
 *   i_max / 25 <= step <= i_max / 8
 *
 * Where a pulse has turned it by less than 5.6 degrees the next follows without a rest. 60 ms for injection, 24 ms a pulse and 16
 * for a rest: 0.2 s at rest without load, 1.5 s and as much again for the heaviest; 0.4 to 0.9 s until a rotor that is held is
 * refused. Movement: 22.5 electrical degrees forth and what it goes on by itself, 105 at most for a free
 * IPM-1000. Peak current: what turns it, i_max at most and no more than injection may have, and the carrier.
 * PM_FAILED_NOT_TURNING: not within eight pulses of that; PM_FAILED_TURNED: by 135 degrees within a pulse, as a load or its own
 * speed does it, or not at rest within a second; PM_FAILED_SALIENCY: the frame turns as fast as half of speed_trip, as one that
 * nothing holds. No division. State 16 bytes.
 * Tests: tests/unit/drive/torque_polarity_test.cpp, tests/scenario/start_fallback.yaml, start_weak_magnets.yaml. */
#ifndef DRIVE_PROCEDURES_TORQUE_POLARITY_H
#define DRIVE_PROCEDURES_TORQUE_POLARITY_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

typedef struct {
    pm_q_t step; /* from one pulse to the next */
} torque_polarity_config_t;

typedef struct {
    pm_angle_t theta; /* from which on it turns */
    pm_q_t i;         /* of this pulse */
    uint16_t ms;
    uint8_t pulses; /* of the largest current, in this direction; before, waits for its rest */
    uint8_t part;
    bool forwards; /* it turned with +i_q */
} torque_polarity_t;

#ifdef __cplusplus
extern "C" {
#endif

void make_torque_polarity(maker_t *m, torque_polarity_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
