#include "bldc/patterns.h"

#define HIGH 1U
#define LOW  2U

/* Which of the two are chopped in even and odd sectors. The low leg has just come in even ones, the high leg in odd ones. */
static uint32_t chopped(pattern_id_t id, uint32_t sector)
{
    static const uint8_t of[PATTERN_COUNT][2] = {
        {HIGH | LOW, HIGH | LOW}, {HIGH, HIGH}, {LOW, LOW}, {LOW, HIGH}, {HIGH, LOW},
        {HIGH | LOW, HIGH | LOW},
    };
    return of[id][sector & 1U];
}

bool pattern_chops_incoming(pattern_id_t id, uint32_t sector)
{
    return (chopped(id, sector) & (sector_rising(sector) ? LOW : HIGH)) != 0U;
}

uint16_t pattern_states(pattern_id_t id, bool complementary, uint32_t sector, bool reverse)
{
    const uint32_t chops = chopped(id, sector);
    const sector_t at = sector_legs(sector, reverse);
    pm_leg_t state[PM_LEGS];
    state[at.open] = PM_LEG_OFF;
    state[at.high] = PM_LEG_HIGH;
    state[at.low] = PM_LEG_LOW;
    if ((chops & HIGH) != 0U) {
        state[at.high] = complementary ? PM_LEG_PWM : PM_LEG_UPPER;
    }
    if (id == PATTERN_H_PWM_L_PWM) {
        state[at.low] = complementary ? PM_LEG_INVERTED : PM_LEG_LOWER_INVERTED;
    } else if ((chops & LOW) != 0U) {
        state[at.low] = complementary ? PM_LEG_PWM : PM_LEG_LOWER;
    } else {
        /* closed */
    }
    return pm_legs_of(state[0], state[1], state[2]);
}

/* Share for which a chopped switch is on. */
static pm_q_t on_share(const pattern_config_t *config, pm_q_t u)
{
    return pattern_chops_both(config->id) ? pm_mean(PM_ONE, u) : u;
}

void pattern_duties(const pattern_config_t *config, uint32_t sector, bool reverse, pm_q_t u, pm_legs_t *out)
{
    const sector_t at = sector_legs(sector, reverse);
    const pm_q_t D = on_share(config, u);
    const pm_q_t low = config->id == PATTERN_H_PWM_L_PWM ? D : PM_ONE - D;
    out->duty[at.high] = D;
    out->duty[at.low] = low;
    out->duty[at.open] = sector_rising(sector) ? D : low;
}

pattern_sample_t pattern_sample(const pattern_config_t *config, uint32_t sector, pm_q_t u)
{
    const uint32_t chops = chopped(config->id, sector);
    const int32_t N = config->half_period, lead = config->lead;
    const int32_t D = pm_frac(on_share(config, u), (pm_frac_t)pm_shl(N, 32 - PM_Q_BITS)); /* of N */
    const int32_t on = pm_frac(u, (pm_frac_t)pm_shl(N, 33 - PM_Q_BITS));
    int32_t at;
    zero_legs_t legs = ZERO_LEGS_APART;
    if (config->id == PATTERN_H_PWM_L_PWM) {
        at = N + D - lead;
    } else if (chops == (HIGH | LOW)) { /* the first of two pulses, from N - D to D */
        const bool enough = pm_half(on) >= config->least;
        at = (enough ? D : N - D) - lead;
        legs = enough ? ZERO_LEGS_APART : ZERO_LEGS_LOW;
    } else if (on >= config->least) {
        at = (chops == HIGH ? N + D : D) - lead;
    } else {
        at = (chops == HIGH ? N - D : 2 * N - D) - lead;
        legs = chops == HIGH ? ZERO_LEGS_LOW : ZERO_LEGS_HIGH;
    }
    return (pattern_sample_t){.at = (uint16_t)pm_clamp(at, 1, 2 * N - 1), .legs = legs};
}

bool pattern_shows(const pattern_config_t *config, pm_q_t u)
{
    const int32_t on = pm_frac(u, (pm_frac_t)pm_shl(config->half_period, 33 - PM_Q_BITS)),
                  least = config->least;
    const int32_t pulse = config->id == PATTERN_H_PWM_L_PWM_ALTERNATING ? pm_half(on) : on;
    return config->id == PATTERN_H_PWM_L_PWM || pulse >= least + least / 4;
}

uint32_t pattern_hidden(const pattern_config_t *config, uint32_t sector, bool reverse)
{
    const sector_t at = sector_legs(sector, reverse);
    return (uint32_t)pm_shl(1, config->id == PATTERN_H_PWM_L_PWM ? at.low : at.high);
}
