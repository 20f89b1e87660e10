/* TIM1: centre-aligned PWM of three legs, the converters' trigger, break. RM0440 28.
 *
 * The counter is computed from the time, not ticked. Compare values and reload are preloaded; the repetition
 * counter takes RCR at every update event, so that with RCR = 1 the events stay at the extreme that the first
 * one had: the overflow when RCR is written between start and first overflow. A leg is driven while its pins
 * are the timer's, an output of its channel is enabled and the main output is; breaks switch that off at once. Outputs and
 * modes of the legs change when they are written, or with CR2.CCPC at the next COM event, by software or by TIM3.
 *
 * Refused on arming, because the plant could not follow: a dead time that is not the plant's, update events
 * at the underflow, another period than the plant's. Not modelled: interrupts, flags of compare channels,
 * stopping. Tests: tim1_test.cpp. */
#ifndef BOARD_TIM1_H
#define BOARD_TIM1_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    uint32_t reload, compare[4]; /* in effect, */
    uint32_t enables, modes[2];  /* as these of CCER and CCMR */
    uint32_t repetitions;        /* left until the next update event */
    bool counting, frozen;
    bool top;         /* the last update event was at the overflow ... */
    uint64_t extreme; /* ... at this cycle; before the first one: start at the underflow */
    uint64_t update;  /* next event */
    uint64_t updates; /* since the start */
    bool armed_before;
    bool pulsed;        /* the break input, as the filter lets it through ... */
    uint64_t pulse_end; /* ... until this cycle */
} tim1_t;

void tim1_init(tim1_t *tim, board_chip_t *chip);
void tim1_reset(tim1_t *tim);
cpu_device_t tim1_device(tim1_t *tim);

bool tim1_counting(const tim1_t *tim);
bool tim1_main_output(const tim1_t *tim);
uint64_t tim1_next_update(const tim1_t *tim); /* cycle; UINT64_MAX: does not count */
uint32_t tim1_period(const tim1_t *tim);      /* cycles from one update event to the next */
void tim1_update(tim1_t *tim);                /* its cycle has come */
bool tim1_follows_plant(const tim1_t *tim);   /* its update events are ends of the plant's periods */

void tim1_triggered(tim1_t *tim);    /* by TIM3 */
void tim1_outputs(tim1_t *tim);      /* pins have changed */
void tim1_break(tim1_t *tim);        /* a comparator has acted in the plant */
void tim1_check_break(tim1_t *tim);  /* a break input may have changed */
void tim1_system_break(tim1_t *tim); /* clock security */
/* The break input is active from that cycle on for so many: with the filter's delay, or too short for it. */
void tim1_pulse_break(tim1_t *tim, uint64_t cycle, uint64_t cycles);
void tim1_freeze(tim1_t *tim, bool frozen); /* by the debugger: outputs off; the counter goes on */

/* Whether the comparator of that leg reaches the break input, and how late. */
bool tim1_break_by_comparator(const tim1_t *tim, int leg, double *delay_s);

#endif
