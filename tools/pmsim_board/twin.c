/* Compiled once for each image, with its header. */
#include "tools/pmsim_board/twin.h"

#include <string.h>

#include "firmware/app/app_parts.h"
#include "firmware/can/dictionary.h"
#include "firmware/drive/drive_state.h"
#include "firmware/math/image.h"
#include "firmware/params/parameters.h"
#include "firmware/params/store.h"
#include "hal/hal.h"
#include "tools/pmsim/rig_sample.h"

/* What app_t begins with, the same on processor and host */
typedef struct {
    drive_t drive;
    drive_in_t in;
    drive_out_t out;
    hal_slow_t slow;
    bool swapping;
} memory_t;

static const od_entry_t *entry_of(uint32_t id)
{
    bool has_index;
    return od_find((uint16_t)(id >> 8), (uint8_t)(id & 0xFFU), &has_index);
}

static bool has(uint32_t id)
{
    return entry_of(id) != NULL;
}

static rig_scale_t inside(const twin_scale_t *scale)
{
    return (rig_scale_t){scale->v_V,       scale->i_A,    scale->omega_mech, scale->psi_Wb,
                         scale->torque_Nm, scale->J_kgm2, scale->fault_seen};
}

static twin_scale_t outside(const rig_scale_t *scale)
{
    return (twin_scale_t){scale->v_V,       scale->i_A,    scale->omega_mech, scale->psi_Wb,
                          scale->torque_Nm, scale->J_kgm2, scale->fault_seen};
}

static const char *configure(const uint32_t page[], twin_scale_t *scale, const char **parameter)
{
    drive_t drive;
    drive_params_t params;
    drive_params_default(&params);
    const int32_t count = store_check(page);
    for (int32_t n = 0; n < count; n++) {
        const store_pair_t pair = store_pair(page, (uint32_t)n);
        const od_entry_t *entry = entry_of(pair.id);
        if (entry != NULL && entry->kind == (uint8_t)OD_PARAMETER) {
            drive_param_set(&params, (drive_param_id_t)entry->slot, pair.value);
        }
    }
    app_take_board(NULL, &params);
    const drive_result_t result = drive_init(&drive, &params, PM_CHANNELS);
    const rig_scale_t made = rig_scale(&drive.config.base, params.pole_pairs, drive.config.slow_divider);
    *scale = outside(&made);
    *parameter = result.ok ? NULL : drive_param_table[result.param].name;
    return result.ok ? NULL : result.reason;
}

static int mode(const void *before)
{
    const drive_t *drive = before;
    switch (drive->stage) {
    case STAGE_OFF:
    case STAGE_SHORT:
        return FIGURE_OFF;
    case STAGE_PROCEDURE:
        return drive->state == DRIVE_CALIBRATING ? FIGURE_CALIBRATE
               : drive->state == DRIVE_RUNNING   ? FIGURE_IDENTIFY
                                                 : FIGURE_PULSES;
    case STAGE_OPEN_LOOP:
        return drive->state == DRIVE_FINDING ? FIGURE_ALIGN : FIGURE_OPEN_LOOP;
    case STAGE_SIX_STEP:
        return FIGURE_SIX_STEP;
    case STAGE_VECTOR:
        break;
    }
    if (drive->position.inject) {
        return drive->position.weight > 0 ? FIGURE_BLEND : FIGURE_INJECTION;
    }
    return drive->field_weakening.i_d < 0 ? FIGURE_WEAKENING : FIGURE_FLUX;
}

/* Byte by byte, holes included: both have copied the same memory. */
static bool same(const void *first, const void *second, size_t size)
{
    return memcmp(first, second, size) == 0;
}

static size_t difference(const drive_t *drive, const drive_out_t *out, const memory_t *image)
{
    if (same(drive, &image->drive, sizeof *drive)) {
        return same(out, &image->out, sizeof *out) ? TWIN_SAME : sizeof *drive;
    }
    const uint8_t *a = (const uint8_t *)drive;
    const uint8_t *b = (const uint8_t *)&image->drive;
    size_t at = 0;
    while (a[at] == b[at]) {
        at++;
    }
    return at;
}

/* The limits' flags stay until the slow interrupt; this period's own are seen when they are cleared before.
 */
static size_t control(void *before, const void *memory, bool event[FIGURE_EVENTS])
{
    drive_t *drive = before;
    const memory_t *image = memory;
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    if (image->drive.period == drive->period) { /* the end of a further sample: nothing is controlled */
        return difference(drive, &image->out, image);
    }
#endif
    drive_out_t out = image->out;
    const bool current = drive->voltage.limited;
    const int32_t modulator = drive->modulator.limited;
    const bool fault = drive->fault != DRIVE_FAULT_NONE;
    drive->voltage.limited = false;
    drive->modulator.limited = 0;
    drive_step(drive, &image->in, &out);
    event[FIGURE_LIMITED] = drive->voltage.limited || drive->modulator.limited != 0;
    event[FIGURE_FAULT] = !fault && drive->fault != DRIVE_FAULT_NONE;
    drive->voltage.limited = drive->voltage.limited || current;
    if (drive->modulator.limited == 0) {
        drive->modulator.limited = modulator;
    }
    return difference(drive, &out, image);
}

/* A new set of parameters is that of the image. */
static size_t slow(void *before, const void *memory, bool event[FIGURE_EVENTS])
{
    drive_t *drive = before;
    const memory_t *image = memory;
    if (image->swapping) {
        drive_reconfigure(drive, &image->drive.config);
        event[FIGURE_SWAP] = true;
        return difference(drive, &image->out, image);
    }
    const drive_slow_in_t in = {.temperature_dC = image->slow.temperature_dC};
    drive_slow(drive, &in);
    return difference(drive, &image->out, image);
}

static uint32_t period(const void *memory)
{
    return ((const memory_t *)memory)->drive.period;
}

static uint32_t slow_divider(const void *memory)
{
    return ((const memory_t *)memory)->drive.config.slow_divider;
}

static void sample(twin_scale_t *scale, const void *memory, rig_sample_t *out)
{
    const memory_t *image = memory;
    rig_scale_t own = inside(scale);
    rig_fill_sample(&own, &image->drive, &image->out, out);
    scale->fault_seen = own.fault_seen;
}

static void record(const void *memory, record_period_t *out)
{
    const memory_t *image = memory;
    out->temperature_dC = image->slow.temperature_dC;
    rig_record_legs(&image->in, &image->out, out);
}

extern const twin_t PM_TWIN;

__attribute__((visibility("default"))) const twin_t PM_TWIN = {
    .name = PM_IMAGE_NAME,
    .drive_bytes = sizeof(drive_t),
    .config_bytes = sizeof(drive_config_t),
    .memory_bytes = sizeof(memory_t),
    .has = has,
    .configure = configure,
    .mode = mode,
    .control = control,
    .slow = slow,
    .period = period,
    .slow_divider = slow_divider,
    .sample = sample,
    .record = record,
};
