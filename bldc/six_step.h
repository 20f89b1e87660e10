/* Block commutation without a sensor: what the legs do in the coming period, from samples of the terminals
 * (METHODS.md 10.2.3), or of the third harmonic at the star point (11.3). Puts zero_crossing.h or third_harmonic.h, thresholds.h,
 * commutation.h and patterns.h together. crossings.def says which.
 *
 * Called at the start t_k of each period. What a call asks for is done in [t_k+1, t_k+2) and delivered with the call at
 * t_k+2, as measure.h has it:
 *   legs, on        from the start of that period on,
 *   commutate_at    until that instant; from there on `then`, so that the carrier does not quantise the commutation
 *   sample_at       where all terminals and the DC link are to be sampled
 * Instants are counts from the start of the period. `now` is the count at t_k; it goes on by 2 N a period and wraps.
 *
 * Where diodes are to carry the off time (pattern_config_t) the other switches do it nevertheless
 *   - until a start has seen its crossings, and while the EMF swings by less than 4 rail in 60 degrees: beside the drop of a
 *     diode it makes no crossings,
 *   - while the on time is too short to be sampled, with a quarter to spare: once the current has ceased in the off time the
 *     terminals float, and a sample in it says nothing,
 *   - with both chopped at once, while the current is smaller than its ripple: it would cease, and half a period would drive
 *     more than a rotor without a load takes.
 *
 * Start: six_step_reset() with the angle and speed of a rotor that turns, from a drive with field orientation, an open
 * loop or a rotor that was caught; 20 degrees and 10 % of the speed may be missing. Or six_step_begin() with a rotor that an
 * align has left at rest, which is turned by its crossings from the first one on. After COMMUTATION_LOST
 * (commutation.h) `lost` is set and all legs are off from the next call on, until the next reset.
 *
 * six_step_step(), instructions on Cortex-M4 with five periods in a sector:
 *   without a crossing             180 on average, at most 258, where it commutates
 *   with one                       351             363
 *   after one, thresholds learnt   238             310
 * Tests: tests/target/bldc, tests/unit/bldc/six_step_test.cpp. */
#ifndef BLDC_SIX_STEP_H
#define BLDC_SIX_STEP_H

#include "bldc/commutation.h"
#include "bldc/patterns.h"
#include "bldc/phase_compensation.h"
#include "bldc/third_harmonic.h"
#include "bldc/third_missing.h"
#include "bldc/thresholds.h"
#include "bldc/virtual_third.h"
#include "bldc/zero_crossing.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
#define PM_METHOD(name, help, traits, needs) CROSSINGS_##name,
#include "bldc/crossings.def"
#undef PM_METHOD
    CROSSINGS_COUNT
} crossings_id_t;

typedef struct {
    pattern_config_t pattern;
    zero_crossing_config_t crossing; /* its swing is that of e_0 with the third harmonic */
    commutation_config_t commutation;
    thresholds_config_t thresholds;
    int32_t compared; /* -1: with what is learnt; 0: it is taken off the instants: phase_compensation.h */
    third_harmonic_config_t third;
#if PM_CARRIES(NEEDS_NEUTRAL)
    third_missing_config_t missing;
#endif
    crossings_id_t crossings;
} six_step_config_t;

typedef struct {
    uint32_t now; /* counts at t_k */
    /* What was asked for two calls ago; NULL where it is not here or not awaited, and with CROSSINGS_third_harmonic. Of
     * CROSSINGS_virtual_third what six_step_from_mean() makes of it. */
    const zero_sample_t *sample;
    pm_q_t u;      /* patterns.h */
    pm_q_t v_zero; /* at t_k, drive/neutral.h; CROSSINGS_third_harmonic only */
} six_step_in_t;

typedef struct {
    pattern_on_t on;       /* pattern_write() of ... */
    uint8_t sector;        /* ... this one */
    uint16_t legs;         /* PM_LEGS_... */
    uint16_t commutate_at; /* 1 ... 2 N - 1; 0: not in this period */
    uint16_t then;         /* PM_LEGS_... */
    uint16_t sample_at;    /* 1 ... 2 N - 1; 0: none */
} six_step_out_t;

/* What was asked for one period. */
typedef struct {
    uint16_t commutate_at, sample_at;
    uint16_t sector; /* at the start */
    uint16_t legs;   /* zero_legs_t at the sample */
} six_step_plan_t;

typedef struct {
    commutation_t commutation;
    zero_crossing_t crossing;
    thresholds_t thresholds;
    zero_expected_t expected;
    six_step_plan_t plan[2]; /* [1] of the period that begins now, [0] of the one that has ended */
    uint32_t commutated;     /* instant of the last commutation */
    pm_q_t swing;            /* zero_crossing_swing() of the last millisecond */
    uint32_t due;            /* of the next, commutation_due(); not while `moved` */
    uint32_t alike; /* crossings in succession of the kind that thresholds are learnt from, up to SECTORS */
    uint16_t legs;  /* PM_LEGS_... of commutation.sector */
    bool learn;     /* from the last crossing */
    bool moved;     /* a crossing, a wait or a commutation has: `due` is to be made again */
    bool reverse;
    bool lost;
    bool complementary; /* at present: pattern_config_t, or for the reasons above */
    uint8_t kind;       /* pattern_kind_t of commutation.sector */
    third_harmonic_t third;
    phase_compensation_t phase; /* all zero where thresholds are compared */
} six_step_t;

/* theta at `now`; omega: electrical, per-unit, negative for the other direction; six sectors take less than 2^29 counts.
 * Thresholds are kept. */
void six_step_reset(six_step_t *self, const six_step_config_t *config, pm_angle_t theta, pm_q_t omega,
                    uint32_t now);

/* Legs that conduct at the start of the period that begins now, before the call for it. */
static inline sector_t six_step_legs(const six_step_t *self)
{
    return sector_legs(self->plan[1].sector, self->reverse);
}

/* Of these, the current of the one that stays across the last commutation: that of both but for the freewheeling. */
static inline pm_q_t six_step_current(const six_step_t *self, const pm_q_t i[PM_LEGS])
{
    const pm_q_t stays = i[six_step_legs(self).stays];
    return sector_rising(self->plan[1].sector) ? stays : -stays;
}

/* A sample of plan[0] would be looked at: its sector has no crossing yet, or has been left. */
static inline bool six_step_awaits(const six_step_t *self)
{
    const six_step_plan_t *plan = &self->plan[0];
    return !self->crossing.found || plan->sector != self->crossing.sector || plan->commutate_at != 0U;
}

/* The rotor stands at theta, in the middle of a sector, and will turn forwards or back by 30 degrees in t_30 counts
 * (commutation.h): it is in charge of the crossings from the first one on, and has started when commutation.young is
 * 0, START_CROSSINGS in succession where they belong. */
#define START_CROSSINGS 6U
void six_step_begin(six_step_t *self, const six_step_config_t *config, pm_angle_t theta, bool reverse,
                    uint32_t t_30, uint32_t now);

/* Before the call with a sample of CROSSINGS_virtual_third: in place of the terminals what their mean says of the open one. */
static inline void six_step_from_mean(const six_step_t *self, zero_sample_t *sample)
{
    const pm_q_t v = virtual_third_terminal(sample, (zero_legs_t)self->plan[0].legs);
    sample->v[0] = v;
    sample->v[1] = v;
    sample->v[2] = v;
}

void six_step_step(six_step_t *self, const six_step_config_t *config, const six_step_in_t *in,
                   six_step_out_t *out);

/* At 1 kHz: lag of the third harmonic, shifts of its crossings, the mean of thresholds, and what a sector must show of its swing,
 * an eighth, for its crossing to be one. Without the call a rotor that has stopped may pass for one that turns. */
void six_step_slow(six_step_t *self, const six_step_config_t *config);

/* At 1 kHz, with the mean voltage u, and whether the current is larger than half of its ripple: what carries the off time. */
void six_step_freewheel(six_step_t *self, const six_step_config_t *config, pm_q_t u, bool flows);

void make_six_step(maker_t *m, six_step_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
