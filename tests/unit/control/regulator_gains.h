// Gains of the regulators of the current.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const synchronous_pi_config_t &c)
{
    return {{"d.kp", c.d.kp}, {"d.ki", c.d.ki}, {"d.kb", c.d.kb},
            {"q.kp", c.q.kp}, {"q.ki", c.q.ki}, {"q.kb", c.q.kb}};
}

inline Names must_be_positive(const deadbeat_config_t &c)
{
    return {{"deadbeat k_d", c.k_d},
            {"deadbeat k_q", c.k_q},
            {"deadbeat per_L_d", c.model.per_L_d},
            {"deadbeat per_L_q", c.model.per_L_q}};
}

inline Names must_be_positive(const finite_set_config_t &c)
{
    return must_be_positive(c.deadbeat);
}

inline Names must_be_positive(const predictive_config_t &c)
{
    return {{"predictive per_L_d", c.model.per_L_d},
            {"predictive per_L_q", c.model.per_L_q},
            {"predictive share", c.share}};
}

inline Names must_be_positive(const direct_torque_config_t &c)
{
    return {{"direct_torque per_period", c.per_period},
            {"direct_torque k_drift", c.k_drift},
            {"direct_torque torque_band", c.torque_band},
            {"direct_torque per_L_d", c.model.per_L_d},
            {"direct_torque per_L_q", c.model.per_L_q}};
}

} // namespace gains
