/* Which switches are chopped in block commutation (METHODS.md 10.3.1; row 109).
 *
 *   pattern         first 60 degrees   last 60 degrees      chopped, of the two legs that conduct
 *   H_PWM_L_PWM     chopped            chopped              both, at once
 *   H_PWM_L_ON      high one chopped, low one on            the high one
 *   H_ON_L_PWM      high one on, low one chopped            the low one
 *   PWM_ON          chopped            on                   the one that has come
 *   ON_PWM          on                 chopped              the one that has been there
 *   H_PWM_L_PWM_ALTERNATING                                 both, the pulses of the low one shifted by half a period
 *                                                           (60 degrees: of the 120 a switch conducts)
 * u is the mean voltage between the two legs over v_dc, 0 ... 1. A switch is on for
 *   D = u                with one of the legs chopped
 *   D = (1 + u) / 2      with both: line voltage v_dc for (2 D - 1) T in two pulses, else 0
 * Between the pulses the line voltage is 0, of H_PWM_L_PWM -v_dc: its low leg is PM_LEG_INVERTED (NEEDS_ONE_SWITCH). Ripple of
 * the current, peak to peak, over v_dc T / (2 L):
 *   H_PWM_L_PWM               2 D (1 - D) = (1 - u^2) / 2
 *   one leg chopped           u (1 - u)
 *   H_PWM_L_PWM_ALTERNATING   u (1 - u) / 2, at twice the carrier's frequency
 * What the ripple costs in H_PWM_L_PWM buys the longest on time, half of a period and more at any u. Alternating has the
 * shortest, half of u.
 * Complementary: the other switch of a chopped leg is closed for the rest, so the current may also flow back
 * (braking, no load). Else its diode carries the current (NEEDS_ONE_SWITCH), which may cease. six_step.h says which and when.
 *
 * Sample instants, counts in a period 0 ... 2 N with the high leg's pulse about N, the low leg's about 0, of
 * H_PWM_L_PWM about N:
 *   late in the on time    the driven legs are apart; `lead` before the switch opens
 *   late in the off time   both are at one rail, where the on time is shorter than `least`
 *
 * Low-side shunts see a leg's current while its lower switch or diode conducts, here at the start of a period, from dead time and
 * settling after the last edge on, b = 2 f_pwm (T_dt + t_settle) of a period about it:
 *   H_PWM_L_PWM               high leg: u <= 1 - 2 b   low leg: never, its lower switch is open there
 *   H_PWM_L_ON                          u <= 1 - b              always
 *   H_PWM_L_PWM_ALTERNATING             u <= 1 - 2 b            always
 *   open leg                  in odd sectors, where its lower diode frees it; in even ones it is the upper one. Of a current that
 *                             brakes the other way round
 * One that is hidden follows from the other two. Where the open leg is, too, what still flows in it is then missing. H_PWM_L_PWM keeps
 * u at 1 - 2 b (line_current.h). The other patterns hold an upper switch closed beside a lower one that at rest conducts for less
 * than b: they show no current at all and are refused.
 *
 * The compare values are those that each leg needs in this sector or, open, in the next: to commutate only states change.
 * pattern_states(), at a commutation: 44 instructions; drawn into the period pattern_on() takes 17, pattern_sample() 21.
 * Tests: tests/unit/bldc/patterns_test.cpp, tests/scenario/six_step_low_side.yaml. */
#ifndef BLDC_PATTERNS_H
#define BLDC_PATTERNS_H

#include "bldc/sectors.h"
#include "bldc/zero_crossing.h"
#include "firmware/math/legs.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    PATTERN_H_PWM_L_PWM,
    PATTERN_H_PWM_L_ON,
    PATTERN_H_ON_L_PWM,
    PATTERN_PWM_ON,
    PATTERN_ON_PWM,
    PATTERN_H_PWM_L_PWM_ALTERNATING,
    PATTERN_COUNT
} pattern_id_t;

typedef struct {
    pattern_id_t id;
    bool complementary;
    uint16_t half_period; /* N, counts */
    uint16_t lead;  /* >= 1: counts from a sample to the edge it is ahead of: converter and its trigger */
    uint16_t least; /* on time, counts, of which samples are taken: dead time, settling, lead; below 2 N */
    bool low_side;  /* shunts below the lower switches */
    pm_q_t
        shown;   /* u above which they hide the current of a leg that conducts, pattern_hidden(); in line 1 */
    pm_q_t most; /* u up to which it follows from the others; 1 but for H_PWM_L_PWM */
} pattern_config_t;

/* Which of the two are chopped in a sector. */
typedef enum {
    PATTERN_AT_ONCE, /* both */
    PATTERN_OF_HIGH,
    PATTERN_OF_LOW,
    PATTERN_IN_TURN, /* both: the first of two pulses from N - D to D */
    PATTERN_KINDS
} pattern_kind_t;

/* Of even and odd sectors: the low leg has just come in even ones, the high leg in odd ones. */
static inline pattern_kind_t pattern_kind(pattern_id_t id, uint32_t sector)
{
    static const uint8_t of[PATTERN_COUNT][2] = {
        {PATTERN_AT_ONCE, PATTERN_AT_ONCE}, {PATTERN_OF_HIGH, PATTERN_OF_HIGH},
        {PATTERN_OF_LOW, PATTERN_OF_LOW},   {PATTERN_OF_LOW, PATTERN_OF_HIGH},
        {PATTERN_OF_HIGH, PATTERN_OF_LOW},  {PATTERN_IN_TURN, PATTERN_IN_TURN},
    };
    return (pattern_kind_t)of[id][sector & 1U];
}

/* PM_LEGS_... of a sector. */
uint16_t pattern_states(pattern_id_t id, bool complementary, uint32_t sector, bool reverse);

static inline bool pattern_chops_both(pattern_id_t id)
{
    return id == PATTERN_H_PWM_L_PWM || id == PATTERN_H_PWM_L_PWM_ALTERNATING;
}

/* In some sector the upper switch of the high leg is closed throughout. */
static inline bool pattern_holds_high(pattern_id_t id)
{
    return !pattern_chops_both(id) && id != PATTERN_H_PWM_L_ON;
}

/* The leg that has come with this sector is chopped. */
bool pattern_chops_incoming(pattern_id_t id, uint32_t sector);

/* What a mean voltage is in counts: */
typedef struct {
    int32_t high, low; /* compare values of the two legs, 0 ... N */
    int32_t line;      /* in which u is between them, 0 ... 2 N */
} pattern_on_t;

static inline pattern_on_t pattern_on(const pattern_config_t *config, pm_q_t u)
{
    const pm_q_t D = pattern_chops_both(config->id) ? pm_mean(PM_ONE, u) : u;
    const pm_frac_t N = pm_shl(config->half_period, 32 - PM_Q_BITS);
    pattern_on_t on;
    on.high = pm_frac(D, N);
    on.low = config->id == PATTERN_H_PWM_L_PWM ? on.high : pm_frac(PM_ONE - D, N);
    on.line = pm_frac(u, 2 * N);
    return on;
}

/* Compare values of a sector's legs, in both halves of the carrier alike. */
static inline void pattern_write(const pattern_on_t *on, uint32_t sector, bool reverse,
                                 uint16_t compare[PM_LEGS][2])
{
    const sector_t legs = sector_legs(sector, reverse);
    const int32_t high = on->high, low = on->low;
    pm_write_leg(compare[legs.high], high);
    pm_write_leg(compare[legs.low], low);
    pm_write_leg(compare[legs.open], sector_rising(sector) ? high : low);
}

typedef struct {
    int32_t at; /* counts from the start of the period, 1 ... 2 N - 1 */
    zero_legs_t legs;
} pattern_sample_t;

static inline pattern_sample_t pattern_sample(const pattern_config_t *config, pattern_kind_t kind,
                                              const pattern_on_t *on)
{
    typedef struct {
        int8_t halves, high; /* at = halves N + high on->high - lead */
        uint8_t legs;
        uint8_t fills; /* four bytes */
    } edge_t;
    static const edge_t of[PATTERN_KINDS][2] = {
        /* too short for a sample, and not */
        {{1, 1, ZERO_LEGS_APART, 0}, {1, 1, ZERO_LEGS_APART, 0}},
        {{1, -1, ZERO_LEGS_LOW, 0}, {1, 1, ZERO_LEGS_APART, 0}},
        {{2, -1, ZERO_LEGS_HIGH, 0}, {0, 1, ZERO_LEGS_APART, 0}},
        {{1, -1, ZERO_LEGS_LOW, 0}, {0, 1, ZERO_LEGS_APART, 0}},
    };
    const int32_t N = config->half_period, shortest = config->least, lead = config->lead;
    const int32_t pulse = kind == PATTERN_IN_TURN ? pm_half(on->line) : on->line;
    const edge_t *edge = &of[kind][pulse >= shortest ? 1 : 0];
    const int32_t at = edge->halves * N + edge->high * on->high - lead;
    pattern_sample_t sample;
    sample.at = pm_max(at, 1);
    sample.legs = (zero_legs_t)edge->legs;
    return sample;
}

/* Samples are those of the on time, with a quarter to spare. */
bool pattern_shows(const pattern_config_t *config, pm_q_t u);

/* The leg whose current low-side shunts do not show at the end of a period that ends in `sector`, of u above `shown`: a bit. */
uint32_t pattern_hidden(const pattern_config_t *config, uint32_t sector, bool reverse);

/* They do not show what flows in the open leg: the sum of the three says nothing. */
static inline bool pattern_hides_open(const pattern_config_t *config, uint32_t sector, bool brakes)
{
    return config->low_side && sector_rising(sector) != brakes;
}

#ifdef __cplusplus
}
#endif

#endif
