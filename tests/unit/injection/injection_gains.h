// Gains of the low-speed sources.
#pragma once

#include "tests/contract/gains.h"

namespace gains
{

inline Names must_be_positive(const pulsating_square_config_t &c)
{
    return {{"v_h", c.v_h}, {"gain_0", c.saliency.gain_0}, {"h_d", c.h_d}, {"h_d_inverse", c.h_d_inverse}};
}

inline Names and_of(const sine_config_t &c, Names own)
{
    own.insert(own.end(), {{"sine v_h", c.v_h}, {"sine per_n", c.per_n}, {"sine n", c.n - 7}});
    return own;
}

inline Names must_be_positive(const rotating_sine_config_t &c)
{
    return and_of(c.sine, {{"sine gain_0", c.saliency.gain_0}});
}

inline Names must_be_positive(const pulsating_sine_config_t &c)
{
    return and_of(c.sine, {{"pulsating gain_0", c.saliency.gain_0}, {"pulsating h_d", c.h_d}});
}

inline Names must_be_positive(const current_sine_config_t &c)
{
    return and_of(c.sine, {{"current gain_0", c.saliency.gain_0},
                           {"current i_h", c.i_h},
                           {"current i_later", c.i_later},
                           {"current v_d", c.v_d},
                           {"current k_0", c.k_0},
                           {"current half_turn", c.half_turn}});
}

inline Names must_be_positive(const stationary_sine_config_t &c)
{
    return and_of(c.sine, {{"stationary gain_0", c.saliency.gain_0},
                           {"stationary i_p_0", c.saliency.i_p_0},
                           {"stationary i_n", c.stationary.i_n},
                           {"stationary tau", c.tau}});
}

inline Names must_be_positive(const stationary_square_config_t &c)
{
    return {{"square v_h", c.v_h},
            {"square gain_0", c.saliency.gain_0},
            {"square i_p_0", c.saliency.i_p_0},
            {"square i_n", c.stationary.i_n}};
}

inline Names must_be_positive(const zero_config_t &c) // of all three sources
{
    return {{"zero v_h", c.v_h},
            {"zero v_now", c.v_now},
            {"zero v_past", c.v_past},
            {"zero c_re", c.c_re},
            {"zero power_0", c.power_0},

            {"zero half", static_cast<int32_t>(c.half)},
            {"zero warm", c.warm},
            {"zero turn6", c.turn6},
            {"zero i_p_0", c.saliency.i_p_0}};
}

inline Names must_be_positive(const inform_config_t &c)
{
    return {{"inform v_h", c.v_h}, {"inform gain_0", c.axes.saliency.gain_0}, {"inform lag", c.axes.lag}};
}

inline Names must_be_positive(const pwm_excitation_config_t &c)
{
    return {{"excitation v_h", c.v_h},
            {"excitation gain_0", c.axes.saliency.gain_0},
            {"excitation lag", c.axes.lag},
            {"excitation between", c.between}};
}

// Of a configuration that has a saliency of its own or that of the axes.
template <class Config> auto saliency_of(const Config &c) -> decltype((c.saliency))
{
    return c.saliency;
}

template <class Config> auto saliency_of(const Config &c) -> decltype((c.axes.saliency))
{
    return c.axes.saliency;
}

} // namespace gains
