#include "bldc/patterns.h"

bool pattern_chops_incoming(pattern_id_t id, uint32_t sector)
{
    return pattern_kind(id, sector) != (sector_rising(sector) ? PATTERN_OF_HIGH : PATTERN_OF_LOW);
}

uint16_t pattern_states(pattern_id_t id, bool complementary, uint32_t sector, bool reverse)
{
    const pattern_kind_t kind = pattern_kind(id, sector);
    const sector_t at = sector_legs(sector, reverse);
    pm_leg_t state[PM_LEGS];
    state[at.open] = PM_LEG_OFF;
    state[at.high] = PM_LEG_HIGH;
    state[at.low] = PM_LEG_LOW;
    if (kind != PATTERN_OF_LOW) {
        state[at.high] = complementary ? PM_LEG_PWM : PM_LEG_UPPER;
    }
    if (kind == PATTERN_AT_ONCE) {
        state[at.low] = complementary ? PM_LEG_INVERTED : PM_LEG_LOWER_INVERTED;
    } else if (kind != PATTERN_OF_HIGH) {
        state[at.low] = complementary ? PM_LEG_PWM : PM_LEG_LOWER;
    } else {
        /* closed */
    }
    return pm_legs_of(state[0], state[1], state[2]);
}

bool pattern_shows(const pattern_config_t *config, pm_q_t u)
{
    const int32_t on = pattern_on(config, u).line, least = config->least;
    const int32_t pulse = config->id == PATTERN_H_PWM_L_PWM_ALTERNATING ? pm_half(on) : on;
    return config->id == PATTERN_H_PWM_L_PWM || pulse >= least + least / 4;
}

uint32_t pattern_hidden(const pattern_config_t *config, uint32_t sector, bool reverse)
{
    const sector_t at = sector_legs(sector, reverse);
    return (uint32_t)pm_shl(1, config->id == PATTERN_H_PWM_L_PWM ? at.low : at.high);
}
