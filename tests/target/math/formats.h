/* One control kernel in five number formats, to choose the signal format by measurement
 * (docs/decisions/001-signal-format.md).
 *
 * Clarke, flux integrator, direction of the angle, Park, two PI controllers with limit and back-calculation,
 * inverse Park. Each file writes it the way its format is best written; the kernel's own types are hidden
 * behind values in per-unit, so that the same inputs go into all of them and into the double reference. */
#ifndef TESTS_TARGET_MATH_FORMATS_H
#define TESTS_TARGET_MATH_FORMATS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* All multiples of 2^-13 pu and below 4 pu in magnitude, so that even 16 bits hold them exactly. */
typedef struct {
    double i_a, i_b, i_c;   /* measured currents */
    double v_alpha, v_beta; /* voltage of the last period */
    double d_ref, q_ref;    /* current references */
    uint32_t theta;         /* 2^32 per turn */
} format_in_t;

typedef struct {
    double psi_alpha, psi_beta; /* flux */
    double i_d, i_q;            /* current in the rotor frame */
    double u_alpha, u_beta;     /* voltage asked for */
} format_out_t;

/* psi += K_FLUX (v - R i) - leak psi; leak 0 is the bare integrator. */
#define FORMAT_K_FLUX 0.0628318530717958648 /* base speed 2 pi 200 rad/s, period 50 us */
#define FORMAT_R      0.05
#define FORMAT_LEAK   1e-4 /* 2 rad/s */
#define FORMAT_KP     2.0
#define FORMAT_KI     0.05
#define FORMAT_KB     0.025
#define FORMAT_LIMIT  1.0 /* of each voltage component */

typedef struct {
    const char *name;
    void (*reset)(bool leak);
    format_out_t (*step)(const format_in_t *in);
} format_t;

/* The machine at constant speed, seen through a 12-bit converter. state: start from zero. */
typedef struct {
    uint32_t theta;
} format_signal_t;

format_in_t format_signal_next(format_signal_t *state, double omega_pu);

extern const format_t format_q28, format_q31, format_q24, format_q15, format_float;

#ifdef __cplusplus
}
#endif

#endif
