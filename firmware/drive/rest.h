/* The carrier is off at standstill without torque, where it is only heard (METHODS.md 5.9; parameter
 * `injection_rest`, option carrier_rest of an image).
 *
 * Asleep after `injection_rest` of it: no speed or torque is wanted, the rotor stands, i_q is below a 32nd of
 * i_rated in the mean. Then the position stays what it was, the currents are held at zero, and the voltage that this takes is the
 * EMF. Awake again, with the carrier from the next millisecond on,
 *   - within a millisecond of another command
 *   - when the EMF, through 10 ms, shows more than REST_OMEGA: what turns faster is seen by it,
 *   - every REST_LOOK_MS for REST_AWAKE_MS: what turns more slowly gets no further than REST_OMEGA REST_LOOK_MS = 0.6
 *     rad between two looks, from where injection finds it; a pole cannot be slipped.
 * The tone is that of the looks, 15 % of the time. Where psi_m REST_OMEGA is below the noise of the voltage the drive
 * never falls asleep for long. Tests: tests/unit/drive/rest_test.cpp, tests/scenario/carrier_rest.yaml. */
#ifndef DRIVE_REST_H
#define DRIVE_REST_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define REST_OMEGA    8 /* 1/s, electrical */
#define REST_LOOK_MS  80
#define REST_AWAKE_MS 14

typedef struct {
    uint16_t after_ms; /* 0: never */
    pm_q_t emf;        /* psi_m REST_OMEGA */
    pm_q_t omega;      /* below it the rotor stands */
    pm_q_t i_q;
} rest_config_t;

typedef struct {
    uint16_t ms;  /* awake: without anything to do; asleep: since when */
    pm_dq_t mean; /* asleep: of the voltage; awake: of i_q */
} rest_t;

void make_rest(maker_t *m, rest_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
