/* Noise of the Kalman filters; for *_config.c. */
#ifndef OBSERVERS_EKF_NOISE_CONFIG_H
#define OBSERVERS_EKF_NOISE_CONFIG_H

#include "firmware/params/maker.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Standard deviations. */
typedef struct {
    pm_num_t current; /* of a sample, A */
    pm_num_t voltage; /* of a period's mean, V */
    pm_num_t speed;   /* change of the electrical speed in a period, rad/s */
    pm_num_t angle;   /* rad, likewise */
    pm_num_t u;       /* unit of flux: EMF of base speed in a period, Wb */
} ekf_noise_t;

ekf_noise_t ekf_noise(const maker_t *m);

/* Variances (sigma / unit)^2, Q30, clamped to what keeps the covariance in range. */
int32_t ekf_process(pm_num_t sigma, pm_num_t unit, int32_t least);
int32_t ekf_measurement(pm_num_t sigma, pm_num_t unit);

#ifdef __cplusplus
}
#endif

#endif
