// Variances of the Kalman filters.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const ekf_full_config_t &e)
{
    return {{"ekf per_unit", e.per_unit},
            {"ekf q_lambda beyond rounding", e.q_lambda + 1 - PM_KALMAN_LEAST(EKF_STATES)},
            {"ekf q_omega beyond rounding", e.q_omega + 1 - PM_KALMAN_LEAST(EKF_STATES)},
            {"ekf q_delta beyond rounding", e.q_delta + 1 - PM_KALMAN_LEAST(EKF_STATES)},
            {"ekf r_d in range", e.r_d + 1 - PM_KALMAN_LEAST_R},
            {"ekf r_q in range", e.r_q + 1 - PM_KALMAN_LEAST_R}};
}

inline Names must_be_positive(const ekf_reduced_config_t &e)
{
    return {{"ekf omega_min", e.omega_min}, {"ekf r in range", e.r + 1 - PM_KALMAN_LEAST_R}};
}

} // namespace gains
