/* When the legs change: from the instants of the zero crossings (METHODS.md 10.2.3; row 151).
 *
 * t_60 is the mean of the last six intervals, which asymmetries of a turn leave alone. The commutation out of the sector in
 * which the last crossing was, or of the n-th one after that, is due at
 *   t_c = t_z + (n + 1/2 - advance) t_60 - delay
 * advance: timing advance as a share of 60 degrees; delay: what comparators, filters of the terminals and the bridge take.
 * A crossing that is known in time counts at once; one that is known too late, as with two periods in a sector, with the next
 * commutation. While samples still show a terminal ahead of its crossing, at t, that is later than t:
 *   t_c >= t + (1/2 - advance) t_60 - delay
 * for up to one t_60, which is how a rotor is followed that a load step slows down.
 *
 * A rotor that speeds up from rest with constant torque takes t_30 for the first 30 degrees and passes 60 n degrees at
 * t_30 root(2 n). commutation_start() is for one that stands in the middle of a sector, where it would cross:
 *   first commutation  t_30                  crossing before it as if at  0.586 t_30
 *   first crossing     1.414 t_30            t_60                         0.828 t_30
 * Until `young` crossings in succession have been where they belong, t_60 is the last interval alone, which is a quarter too
 * long, and a rotor that is slower than expected is waited for for up to four of them.
 *
 * A crossing is expected t_60 behind the last one. One that is off by more than t_60 / 2 is taken as that far off: a false one
 * does not move the commutation further, and a step of the speed is followed within a few sectors. Synchronism is
 * lost after `strikes` of these or of sectors without a crossing in succession (COMMUTATION_LOST): the caller opens the
 * bridge.
 *
 * Speed: omega = turn_base / (sum of six intervals), per-unit, mean over the last turn: under a ramp it is that of
 * half a turn ago. Instants and times in counts as in zero_crossing.h; a sector takes less than 2^27 counts.
 *
 * commutation_crossed(): 50 instructions; commutation_due(): 25; commutation_speed(): 40.
 * Tests: tests/unit/bldc/commutation_test.cpp, six_step_test.cpp. */
#ifndef BLDC_COMMUTATION_H
#define BLDC_COMMUTATION_H

#include "bldc/sectors.h"
#include "firmware/math/fixed.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_frac_t half;     /* (1/2 - advance) / 6, of the sum; advance below 1/2 */
    uint32_t delay;     /* counts */
    uint32_t turn_base; /* counts of an electrical turn at base speed */
    uint8_t strikes;    /* 2 ... 255 */
} commutation_config_t;

typedef enum { COMMUTATION_LOCKED, COMMUTATION_LOST } commutation_state_t;

typedef struct {
    uint32_t interval[SECTORS]; /* counts; [s] ends with the crossing in sector s */
    uint32_t sum;               /* of these */
    uint32_t crossing;          /* instant of the last one */
    uint32_t ahead;             /* from here on the next one is still possible */
    uint8_t crossed;            /* its sector, or one that ended without */
    uint8_t sector;             /* commanded last */
    uint8_t strikes;
    uint8_t whole; /* crossings in succession that were taken as they were, up to SECTORS */
    uint8_t young; /* those that a start still has to see */
} commutation_t;

/* As if there had been a crossing in `sector`, at `at`, and t_60 between all before. */
void commutation_reset(commutation_t *self, uint32_t sector, uint32_t at, uint32_t t_60);

/* The rotor stands in the middle of `sector` at `now`. */
void commutation_start(commutation_t *self, uint32_t sector, uint32_t now, uint32_t t_30, uint8_t crossings);

/* The crossing in the sector behind the last one. */
void commutation_crossed(commutation_t *self, uint32_t at);

/* That sector ended without one. */
void commutation_missed(commutation_t *self);

/* In that sector a sample at `at` was still ahead of it. */
static inline void commutation_ahead(commutation_t *self, uint32_t at)
{
    self->ahead = at;
}

/* Instant of the next commutation, out of self->sector. */
uint32_t commutation_due(const commutation_t *self, const commutation_config_t *config);

static inline commutation_state_t commutation_state(const commutation_t *self,
                                                    const commutation_config_t *config)
{
    return self->strikes >= config->strikes ? COMMUTATION_LOST : COMMUTATION_LOCKED;
}

static inline uint32_t commutation_t_60(const commutation_t *self)
{
    return (uint32_t)pm_frac((int32_t)self->sum, PM_FRAC(1.0 / 6));
}

/* Electrical, of the direction that is turned in: > 0. */
pm_q_t commutation_speed(const commutation_t *self, const commutation_config_t *config);

#ifdef __cplusplus
}
#endif

#endif
