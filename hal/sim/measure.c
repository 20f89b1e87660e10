#include "hal/sim/port.h"

#include <math.h>
#include <string.h>

#define MID_SCALE 0x8000

/* Of the sensors that the plant has. */
uint32_t hal_channels(const hal_t *hal)
{
    const plant_sensor_t *sensor = plant_sensor(hal->plant);
    const bool terminals = sensor->v_leg_full_scale_V > 0.0;
    const bool neutral = terminals || sensor->v_zero_full_scale_V > 0.0;
    const uint32_t all = NEEDS_SECOND_SAMPLE | NEEDS_HALVES | NEEDS_HELD | NEEDS_ONE_SWITCH |
                         NEEDS_COMMUTATE | (terminals ? NEEDS_TERMINALS : 0U) |
                         (neutral ? NEEDS_NEUTRAL : 0U) |
                         (sensor->i_dc_full_scale_A > 0.0 ? NEEDS_DC_CURRENT : 0U) |
                         (sensor->capture_s > 0.0 ? NEEDS_CAPTURES : 0U) |
                         (plant_leg_count(hal->plant) > DRIVE_LEGS ? NEEDS_BRIDGES | NEEDS_SECOND_SET : 0U) |
                         (plant_inverter(hal->plant)->bootstrap_charge_s > 0.0 ? PM_BOOTSTRAP : 0U);
    return all & ~hal->without;
}

/* Of a period of the plant. */
static double count_s(const hal_t *hal)
{
    return 1.0 / (double)hal->timer_Hz;
}

/* In order of time: before a sample at that instant, or in what is left of the period. */
static void commutate_before(hal_t *hal, uint32_t instant)
{
    const uint16_t at = hal->commutate_at[0];
    if (at != 0U && at < instant) {
        plant_move(hal->plant, at * count_s(hal));
        sim_commutate(hal, hal->then[0]);
        hal->commutate_at[0] = 0;
    }
}

void sim_run_period(hal_t *hal)
{
    hal->sampled = 0;
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        const uint16_t at = hal->sample_at[0][n];
        if (at != 0U) {
            commutate_before(hal, at);
            plant_sample_at(hal->plant, at * count_s(hal), &hal->sample[n]);
            hal->sampled = (uint16_t)(hal->sampled | (1U << n));
        }
        hal->sample_at[0][n] = hal->sample_at[1][n];
        hal->sample_at[1][n] = 0;
    }
    commutate_before(hal, UINT32_MAX);
    hal->commutate_at[0] = hal->commutate_at[1];
    hal->then[0] = hal->then[1];
    hal->commutate_at[1] = 0;
    plant_run_period(hal->plant);
    double after_s;
    if (plant_broke(hal->plant, &after_s)) {
        sim_break(hal);
    }
}

/* Star point against the mean of the terminals. The plant's differential channel sees the opposite; without
 * it the difference of the channels takes its place, half of the code's range on either side. */
static uint16_t neutral_code(const plant_adc_t *adc, const plant_sensor_t *sensor, int set)
{
    if (sensor->v_zero_full_scale_V > 0.0) {
        const int32_t mirrored = 2 * MID_SCALE - adc->v_zero[set];
        return (uint16_t)(mirrored < UINT16_MAX ? mirrored : UINT16_MAX);
    }
    const uint16_t *leg = &adc->v_leg[PM_LEGS * set];
    const int32_t sum = leg[0] + leg[1] + leg[2];
    return (uint16_t)(MID_SCALE + (3 * adc->v_neutral[set] - sum) / (2 * PM_LEGS));
}

static void fill_second(const hal_t *hal, uint32_t channels, pm_measure_t *more)
{
    for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
        more->i_second[leg] = hal->adc.i_leg[PM_LEGS + leg];
    }
    if ((channels & NEEDS_NEUTRAL) != 0U) {
        more->v_neutral_second = neutral_code(&hal->adc, plant_sensor(hal->plant), 1);
    }
}

static void fill_samples(const hal_t *hal, uint32_t channels, pm_measure_t *more)
{
    more->sampled = hal->sampled;
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        const plant_adc_t *adc = &hal->sample[n];
        for (uint32_t leg = 0; leg < PM_LEGS; leg++) {
            more->i_sample[n][leg] = adc->i_leg[leg];
            more->v_sample[n][leg] = (channels & NEEDS_TERMINALS) != 0U ? adc->v_leg[leg] : 0U;
        }
        more->v_dc_sample[n] = adc->v_dc;
        more->v_neutral_sample[n] =
            (channels & NEEDS_NEUTRAL) != 0U ? neutral_code(adc, plant_sensor(hal->plant), 0) : 0U;
    }
}

static void fill_captures(const hal_t *hal, pm_measure_t *more)
{
    const double capture_s = plant_sensor(hal->plant)->capture_s;
    plant_capture_t edge[PM_CAPTURES];
    const int seen = plant_captured(hal->plant, edge, PM_CAPTURES);
    more->captures = (uint16_t)(seen < PM_CAPTURES ? seen : PM_CAPTURES);
    for (uint32_t n = 0; n < more->captures; n++) {
        more->capture[n] = (pm_capture_t){.at = (uint16_t)lrint(edge[n].count * capture_s / count_s(hal)),
                                          .leg = edge[n].leg,
                                          .rising = edge[n].rising};
    }
}

static void fill_more(const hal_t *hal, pm_measure_t *more)
{
    const uint32_t channels = hal_channels(hal);
    *more = (pm_measure_t){0};
    if ((channels & NEEDS_DC_CURRENT) != 0U) {
        more->i_dc = hal->adc.i_dc;
    }
    if ((channels & NEEDS_TERMINALS) != 0U) {
        memcpy(more->v_terminal, hal->adc.v_leg, sizeof more->v_terminal);
    }
    if ((channels & NEEDS_NEUTRAL) != 0U) {
        more->v_neutral = neutral_code(&hal->adc, plant_sensor(hal->plant), 0);
    }
    if ((channels & NEEDS_SECOND_SET) != 0U) {
        fill_second(hal, channels, more);
    }
    if ((channels & NEEDS_SECOND_SAMPLE) != 0U) {
        fill_samples(hal, channels, more);
    }
    if ((channels & NEEDS_CAPTURES) != 0U) {
        fill_captures(hal, more);
    }
}

void hal_measure(hal_t *hal, drive_in_t *in)
{
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        in->i_leg[leg] = hal->adc.i_leg[leg];
    }
    in->v_dc = hal->adc.v_dc;
    fill_more(hal, &in->more);
    in->hw_fault = hal->broke || plant_break_held(hal->plant) || hal->hw_fault;
    hal->broke = false;
    if (in->hw_fault) {
        hal_bridge_off(hal);
    }
}

void hal_measure_slow(hal_t *hal, hal_slow_t *slow)
{
    *slow = (hal_slow_t){.temperature_dC = hal->temperature_dC,
                         .temperature_missing = hal->temperature_missing,
                         .reference_off = hal->reference_off};
}
