/* The position of the rotor: injection at low speed, an observer above, one loop (METHODS.md 4.5.1, 4.5.3 and
 * 5.9, rows 44, 46 and 69; the loop: observers/loop.h).
 *
 *   eps = eps_injection + weight (eps_observer - eps_injection)
 * weight rises from 0 at omega_low to 1 at omega_high; the carrier is on below omega_high and off above
 * 1.1 omega_high (hysteresis). The bandwidth of the loop moves with the weight. That of current control is what
 * the low-speed source bears as long as the carrier is on: what is controlled is the current that the source
 * separates, with its delay. Only this module knows both sources, the one of injection/injections.def and the
 * one of observers/observers.def; both keep the contract of firmware/math/estimate.h. The low-speed source
 * steps first: it separates the fundamental current, which the observer takes, from the answer to its carrier.
 * Quality: 1 while the sources agree with the measurement, 0 when the position is lost.
 *
 * A high-speed source of the third harmonic (SOURCE_THIRD_TURN) must have shown it before its weight rises: the mean of its vector
 * along the position, which is one with what it was told, over 64 ms, above a half. Until then the low-speed source goes on, also
 * above omega_high; where that lasts for POSITION_ABSENT_MS from omega_low on the drive stops (METHODS.md 11.6.2, row 132).
 * Tests: tests/unit/drive/position_test.cpp, tests/scenario. */
#ifndef DRIVE_POSITION_H
#define DRIVE_POSITION_H

#include "firmware/drive/slip.h"
#include "firmware/math/estimate.h"
#include "firmware/math/pll.h"
#include "injection/injection.h"
#include "observers/loop.h"
#include "observers/mismatch.h"
#include "observers/observer.h"
#include "observers/second_harmonic.h"
#include "observers/speed.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    observer_config_t observer;   /* the high-speed source */
    injection_config_t injection; /* the low-speed source */
    pm_pll_config_t pll_low, pll_high;
    loop_config_t loop;
    second_harmonic_config_t second_harmonic;
    mismatch_config_t mismatch;
    speed_config_t speed;
    pm_q_t omega_low, omega_high;
    int32_t per_span;      /* 1 / (omega_high - omega_low), Q20 */
    pm_unit_t current_low; /* share of the bandwidth of current control while the carrier is on */
    pm_unit_t tied_share;  /* what a tied observer's disagreement counts */
    uint8_t traits;        /* of the low-speed source */
#if PM_CARRIES(NEEDS_NEUTRAL)
    uint8_t traits_high; /* of the observer; without these channels none is ambiguous */
#endif
    bool injects;  /* the low-speed source leads at low speed; else the observer at all speeds */
    bool corrects; /* one of the optional stages is on */
} position_config_t;

typedef struct {
    pm_pll_t pll;
    pm_pll_config_t gains; /* from pll_low to pll_high, with the weight */
    pm_q_t weight;         /* 0: injection, 1: observer */
    bool carrier;          /* may be injected; else the observer leads at all speeds */
    bool inject;           /* carrier on */
#if PM_HAS(carrier_rest)
    bool rests; /* standstill without carrier: the position stays as it is */
#endif
#if PM_HAS(zero_vector)
    uint16_t sample_at; /* for the observer, as pm_instants_t; 0: none */
#endif
    observer_t observer;
    injection_t injection; /* while `inject` */

    /* the optional stages, between source and loop and for the speed, and what 1 kHz keeps */
    mismatch_window_t window; /* while no carrier is injected */
    mismatch_t mismatch;
    PM_IN_IMAGE(two_sets, pm_q_t apart;) /* q current of the first of two sets beyond their mean */
    second_harmonic_t second_harmonic;
    loop_t loop;
    speed_t speed;
    pm_q_t omega_mean;   /* filtered for the weight */
    pm_q_t observer_eps; /* without noise, for the quality */
    pm_q_t injection_eps;
    pm_q_t eps_mean;
    pm_q_t misfit_mean;
    pm_q_t quality;
    slip_t slip;
#if PM_CARRIES(NEEDS_NEUTRAL)
    pm_q_t shown;       /* mean of the observer's vector along the position, */
    pm_q_t square;      /* and of its square */
    uint16_t absent_ms; /* for which it could not lead, as less than half was shown */
#endif
} position_t;

/* Starts where the rotor is known to be, at its speed, with the current i; `carrier`: one is injected at low speed, if the
 * configuration says so. */
void position_reset(position_t *self, const position_config_t *config, const pm_pll_t *known, pm_ab_t i,
                    bool carrier);

typedef struct {
    pm_half_dir_t ahead; /* half of the direction of the estimated frame where the next voltage acts */
    pm_dq_t i;           /* fundamental current in the frame at k */
    pm_q_t omega;
    excitation_t carrier; /* only while `inject` */
} position_out_t;

typedef struct {
    const pm_ab_t *v;      /* mean voltage over [k-1, k) */
    pm_ab_t i;             /* current at k */
    const pm_dir_t *ahead; /* by which the frame turns from k to the middle of the period in which the next
                              voltage acts */
#if PM_CARRIES(PM_MEASURED)
    const obs_more_t *more;
#endif
} position_in_t;

/* One period. */
void position_step(position_t *self, const position_config_t *config, const position_in_t *at,
                   position_out_t *out);

/* The configuration names another observer than before: it is seeded at the present position and speed, where
 * the loop had settled with the old one, so nothing jumps. What the old one had learnt of R and of the
 * amplitude is given up. Between two steps, with the current of the last and the same in its frame. */
void position_change_observer(position_t *self, const position_config_t *config, pm_ab_t i, pm_dq_t i_dq);

/* R as it was found, from here to the next reset; of active_flux, others keep that of the configuration. */
void position_set_resistance(position_t *self, const position_config_t *config, pm_q_t R);

/* While the rotor follows a given vector (align, open-loop start): the loop is opened, the position is
 * `imposed` and goes on with its speed, and the observer is tied to it. Up to the next position_slow(). */
void position_force(position_t *self, const position_config_t *config, const pm_pll_t *imposed);

/* Of the correction of wrong parameters: none while a carrier is injected. */
static inline mismatch_window_t *position_window(position_t *self)
{
    return self->inject ? NULL : &self->window;
}

/* To be added to the current reference, on the axis of config->mismatch. */
static inline pm_q_t position_injected(const position_t *self)
{
    return self->inject ? 0 : self->window.injected;
}

/* Share of the bandwidth of current control: what a slow window of the low-speed source allows, more with the
 * weight of the observer. */
pm_unit_t position_current_share(const position_t *self, const position_config_t *config);

/* Between two steps, while the low-speed source takes part: v is the voltage of the last step without carrier, Q28,
 * i_dq its current, i the sampled one. A slip is resolved: the position turns by what is returned, 0 if there was none, and both sources
 * start anew from there. */
pm_angle_t position_resolve_slip(position_t *self, const position_config_t *config,
                                 const pm_machine_t *machine, pm_dq_t v, pm_dq_t i_dq, pm_ab_t i);

/* The position turns by `turn`, speed as it is; both sources start anew from there. */
void position_turn(position_t *self, const position_config_t *config, pm_angle_t turn, pm_ab_t i);

#if PM_HAS(carrier_rest)
/* No carrier, and the position stays what it is at speed zero, until `rests` is taken back before a
 * position_slow(). */
void position_rest(position_t *self);
#endif

#if PM_CARRIES(NEEDS_NEUTRAL)
#define POSITION_ABSENT_MS 150U

/* A position that was lost at a speed that was right: there is no third harmonic, a quarter of its amplitude at most. */
bool position_lacks_third(const position_t *self, const position_config_t *config);
#endif

/* config_position.c; injection: a low-speed source leads at low speed. */
void make_position(maker_t *m, position_config_t *c, bool injection);

/* At 1 kHz, with the current of the last step and the same in its frame: weight, carrier, loop gains,
 * quality. */
void position_slow(position_t *self, const position_config_t *config, pm_ab_t i, pm_dq_t i_dq);

#ifdef __cplusplus
}
#endif

#endif
