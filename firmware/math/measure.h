/* What a method needs of the board beside the leg currents and the DC-link voltage.
 *
 * A port declares what it has (hal_channels(), hal/hal.h), a method what it needs: the last word of its row
 * PM_METHOD(name, help, traits, needs). Both are sums of the names in PM_NEED_LIST. Checked twice:
 *   configuration   the parameter that chooses a method is refused with pm_need_text():
 *                   "needs the neutral voltage: not on this board"; or "is not in this image", which does not
 *                   carry the channel, whatever the board has
 *   build           PM_CHANNELS is what the program carries: everything, or in an image what its manifest
 *                   names. A row that needs more fails the build by the method's name (PM_CHECK_NEEDS), a
 *                   board that has less by the channel's name (PM_CHECK_BOARD).
 * What is not in PM_CHANNELS has no field here, no instruction and no byte of memory.
 *
 * Codes are left-aligned in 16 bits. Instants are timer counts from the update event that begins the period,
 * the centre of the all-low zero vector t_k: 1 ... 2 timer_counts - 1. What a step asks for at t_k is done in
 * [t_k+1, t_k+2) and delivered at t_k+2.
 * Tests: tests/unit/math/measure_test.cpp, tests/unit/drive/needs_test.cpp, tests/contract/hal. */
#ifndef PM_MATH_MEASURE_H
#define PM_MATH_MEASURE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/image.h"

/* Measured. */
#define NEEDS_DC_CURRENT    0x0001U /* at t_k; mid-scale = zero, positive from the link into the legs */
#define NEEDS_TERMINALS     0x0002U /* at t_k, against the negative rail; 0 = zero */
#define NEEDS_NEUTRAL       0x0004U /* at t_k, star point minus mean of the terminals; mid-scale = zero */
#define NEEDS_SECOND_SAMPLE 0x0008U /* currents and voltages of these channels, at chosen instants */
#define NEEDS_CAPTURES      0x0010U /* comparator edges of the terminals with their instants */
#define NEEDS_CURRENT_MASK  0x0020U /* a current that cannot be measured in this period is marked */
#define NEEDS_SECOND_SET                                                                                     \
    0x0040U /* leg currents of a second bridge, and its star point where there are star points */
/* Done by the timer. */
#define NEEDS_HALVES     0x0100U /* compare values of their own for the two halves of a period */
#define NEEDS_HELD       0x0200U /* a leg held high or low */
#define NEEDS_ONE_SWITCH 0x0400U /* PWM on one switch of a leg, the other open */
#define NEEDS_COMMUTATE  0x0800U /* the legs change at an instant within the period */
#define NEEDS_BRIDGES    0x1000U /* a second bridge of three legs, on the same link and carrier */

/* Of the board, no need of a method: its upper switches live on capacitors that the lower ones charge. A start charges
 * them before its first pulse (firmware/drive/procedures/charge.h). */
#define PM_BOOTSTRAP 0x8000U

/* X(name, needs, bit, what it is) */
#define PM_NEED_LIST(X, name, needs)                                                                         \
    X(name, needs, NEEDS_DC_CURRENT, "the DC-link current")                                                  \
    X(name, needs, NEEDS_TERMINALS, "the terminal voltages")                                                 \
    X(name, needs, NEEDS_NEUTRAL, "the neutral voltage")                                                     \
    X(name, needs, NEEDS_SECOND_SAMPLE, "a second sample in the period")                                     \
    X(name, needs, NEEDS_CAPTURES, "edges of terminal comparators")                                          \
    X(name, needs, NEEDS_CURRENT_MASK, "the validity of each current")                                       \
    X(name, needs, NEEDS_SECOND_SET, "the currents of a second bridge")                                      \
    X(name, needs, NEEDS_HALVES, "different halves of a period")                                             \
    X(name, needs, NEEDS_HELD, "legs held high or low")                                                      \
    X(name, needs, NEEDS_ONE_SWITCH, "PWM on one switch of a leg")                                           \
    X(name, needs, NEEDS_COMMUTATE, "commutation within the period")                                         \
    X(name, needs, NEEDS_BRIDGES, "a second bridge")

#define PM_MEASURED 0x007FU
#define PM_DONE_AT  (NEEDS_SECOND_SAMPLE | NEEDS_COMMUTATE)
#define PM_ALL      0x1F7FU

#ifndef PM_CHANNELS
#define PM_CHANNELS PM_ALL
#endif
#define PM_CARRIES(need) (((need)&PM_CHANNELS) != 0U)

/* The currents of a further sample, in programs that have a method which looks at them. */
#define PM_SAMPLES_CURRENTS                                                                                  \
    (PM_CARRIES(NEEDS_SECOND_SAMPLE) && (PM_HAS(zero_vector) || PM_HAS(pwm_excitation)))

/* The code in programs that carry any of PM_MEASURED, else nothing. */
#if PM_CARRIES(PM_MEASURED)
#define PM_IF_MEASURED(...) __VA_ARGS__
#else
#define PM_IF_MEASURED(...)
#endif

/* Of a row of a list, in the file that has its dispatch. */
#define PM_CHECK_NEEDS(name, needs) PM_NEED_LIST(PM_CHECK_NEED, name, needs)
#define PM_CHECK_NEED(name, needs, bit, what)                                                                \
    _Static_assert(!PM_HAS(name) || ((needs) & (bit) & ~PM_CHANNELS) == 0U,                                  \
                   #name " needs " what ", which this image does not carry");

/* Of a port, in a file that only its images contain. */
#define PM_CHECK_BOARD(channels) PM_NEED_LIST(PM_CHECK_CHANNEL, , channels)
#define PM_CHECK_CHANNEL(name, channels, bit, what)                                                          \
    _Static_assert((PM_CHANNELS & (bit) & ~(channels)) == 0U,                                                \
                   "the image carries " what ": not on this board");

#ifdef __cplusplus
extern "C" {
#endif

/* Why a method is refused, by the first channel that is missing of those that are carried; "" for none. Static text. */
const char *pm_need_text(uint32_t missing);

#ifdef __cplusplus
}
#endif

#define PM_LEGS 3
/* Further samples in a period; with halves one in each. */
#define PM_SAMPLES  (PM_CARRIES(NEEDS_HALVES) ? 2 : 1)
#define PM_CAPTURES 8 /* edges: a floating terminal rings across its threshold more than once */

/* An edge of a terminal's comparator in the period that ended at t_k. */
typedef struct {
    uint16_t at; /* instant */
    uint8_t leg;
    bool rising; /* the terminal has become higher than the reference */
} pm_capture_t;

#if PM_CARRIES(PM_MEASURED)
/* Measured, beside what drive_in_t begins with. Members of 16 bits: no padding. */
typedef struct {
#if PM_CARRIES(NEEDS_CURRENT_MASK)
    uint16_t missing; /* bit k: the current of leg k is not valid */
#endif
#if PM_CARRIES(NEEDS_DC_CURRENT)
    uint16_t i_dc;
#endif
#if PM_CARRIES(NEEDS_TERMINALS)
    uint16_t v_terminal[PM_LEGS];
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    uint16_t v_neutral;
#endif
#if PM_CARRIES(NEEDS_SECOND_SET)
    uint16_t i_second[PM_LEGS];
#if PM_CARRIES(NEEDS_NEUTRAL)
    uint16_t v_neutral_second; /* as v_neutral, of the second star */
#endif
#endif
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    uint16_t sampled;                       /* bit n: sample n was asked for and is here */
    uint16_t i_sample[PM_SAMPLES][PM_LEGS]; /* as the currents at t_k; PM_SAMPLES_CURRENTS */
#if PM_CARRIES(NEEDS_TERMINALS)
    uint16_t v_sample[PM_SAMPLES][PM_LEGS]; /* as v_terminal */
    uint16_t v_dc_sample[PM_SAMPLES];       /* as the DC link at t_k */
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    uint16_t v_neutral_sample[PM_SAMPLES]; /* as v_neutral */
#endif
#endif
#if PM_CARRIES(NEEDS_CAPTURES)
    uint16_t captures; /* how many: the first of the period */
    pm_capture_t capture[PM_CAPTURES];
#endif
} pm_measure_t;

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
/* Sample n was asked for and is here. */
static inline bool pm_sampled(const pm_measure_t *m, uint32_t n)
{
    return ((uint32_t)m->sampled >> n & 1U) != 0U;
}
#endif
#endif

#if PM_CARRIES(PM_DONE_AT)
/* When what is done in the coming period; all zero: nothing. */
typedef struct {
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    uint16_t sample_at[PM_SAMPLES]; /* instants, rising; 0: none */
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    uint16_t commutate_at; /* instant from which `then` holds; 0: none */
    uint16_t then;         /* PM_LEGS_... of legs.h */
#endif
} pm_instants_t;
#endif

#endif
