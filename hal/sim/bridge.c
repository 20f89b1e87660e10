#include "hal/sim/port.h"

#include <assert.h>

static plant_leg_state_t state_of(pm_leg_t state)
{
    switch (state) {
    case PM_LEG_UPPER:
        return PLANT_LEG_UPPER;
    case PM_LEG_LOWER:
        return PLANT_LEG_LOWER;
    case PM_LEG_HIGH:
        return PLANT_LEG_HIGH;
    case PM_LEG_LOW:
        return PLANT_LEG_LOW;
    case PM_LEG_INVERTED:
        return PLANT_LEG_INVERTED;
    case PM_LEG_LOWER_INVERTED:
        return PLANT_LEG_LOWER_INVERTED;
    default:
        return PLANT_LEG_PWM;
    }
}

/* A leg that is held keeps its duty for what it is after a commutation within the period. */
static void set_leg(const hal_t *hal, int leg, const drive_out_t *out, plant_pwm_t *pwm)
{
    const pm_leg_t state = pm_leg(out->legs, (uint32_t)leg);
    assert(state <= PM_LEG_LOWER_INVERTED);
    pwm->compare[leg][0] = out->compare[leg][0];
    pwm->compare[leg][1] = out->compare[leg][1];
    pwm->state[leg] = state_of(state);
    pwm->driven[leg] = state != PM_LEG_OFF && hal->armed;
}

static void set_second(const hal_t *hal, int leg, const drive_out_t *out, plant_pwm_t *pwm)
{
    const int there = DRIVE_LEGS + leg;
    pwm->compare[there][0] = out->second[leg];
    pwm->compare[there][1] = out->second[leg];
    pwm->state[there] = PLANT_LEG_PWM;
    pwm->driven[there] = out->second_legs != PM_LEGS_OFF && hal->armed;
}

void sim_commutate(hal_t *hal, uint16_t legs)
{
    plant_leg_state_t state[PLANT_LEGS] = {PLANT_LEG_PWM};
    bool driven[PLANT_LEGS] = {false};
    for (uint32_t leg = 0; leg < DRIVE_LEGS; ++leg) {
        const pm_leg_t wanted = pm_leg(legs, leg);
        state[leg] = state_of(wanted);
        driven[leg] = wanted != PM_LEG_OFF && hal->armed;
    }
    plant_drive_legs(hal->plant, driven, state);
}

void hal_bridge_write(hal_t *hal, const drive_out_t *out)
{
    plant_pwm_t pwm = {0};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        set_leg(hal, leg, out, &pwm);
        set_second(hal, leg, out, &pwm);
    }
    plant_set_pwm(hal->plant, &pwm);
    for (int n = 0; n < PM_SAMPLES; ++n) {
        hal->sample_at[1][n] = out->instants.sample_at[n];
    }
    hal->commutate_at[1] = out->instants.commutate_at;
    hal->then[1] = out->instants.then;
    if (out->trip != 0U) {
        hal_bridge_off(hal);
    }
}

bool hal_bridge_arm(hal_t *hal)
{
    hal->armed = hal->configured && !hal->broke && !hal->hw_fault && !plant_break_held(hal->plant);
    return hal->armed;
}

/* Hardware does not wait for the update event. */
void hal_bridge_off(hal_t *hal)
{
    if (hal->armed) {
        hal->armed = false;
        plant_trip(hal->plant);
    }
}

void sim_break(hal_t *hal)
{
    hal_bridge_off(hal);
    hal->broke = true;
}

bool hal_bridge_armed(const hal_t *hal)
{
    return hal->armed;
}
