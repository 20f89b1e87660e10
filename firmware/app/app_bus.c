/* The node and the drive profile: requests to the drive, and its state for the bus. */
#include <stddef.h>
#include <string.h>

#include "firmware/app/app_parts.h"

/* Most frames per round, so that the rest of the round is not delayed. */
#define FRAMES_MOST 16U
/* An overrun ends after this time without another lost frame. */
#define LOST_US      1000000U
#define CODE_OVERRUN 0x8110U
#define CODE_SILENCE 0x8130U

static app_t *app_of(void *context)
{
    return context;
}

/* Error code of a fault in CiA 301 and CiA 402 */
static uint16_t code_of(drive_fault_t fault)
{
    static const uint16_t codes[DRIVE_FAULT_COUNT] = {
        [DRIVE_FAULT_NONE] = 0,
#define PM_ERROR(name, code, bit) [DRIVE_FAULT_##name] = (code),
#include "firmware/app/error_codes.def"
#undef PM_ERROR
    };
    return codes[fault];
}

static uint16_t error_code(const app_t *app)
{
    const drive_fault_t fault = app->drive.fault;
    return fault == DRIVE_FAULT_REMOTE_LOST ? app->alarm : code_of(fault);
}

/* --- called by the node ----------------------------------------------------------------------------- */

bool node_host_send(void *context, const node_frame_t *frame)
{
    hal_can_frame_t out = {.id = frame->id, .length = frame->length};
    (void)memcpy(out.data, frame->data, sizeof out.data);
    return hal_can_send(app_of(context)->hal, &out);
}

bool app_is_on(const app_t *app)
{
    const drive_state_t state = app->drive.state;
    return cia402_on(&app->cia402) || hal_bridge_armed(app->hal) ||
           (state != DRIVE_OFF && state != DRIVE_FAULT);
}

bool node_host_on(void *context)
{
    return app_is_on(app_of(context));
}

int32_t node_host_get(void *context, const od_entry_t *entry)
{
    app_t *app = app_of(context);
    int32_t value = 0;
    if (entry->kind == (uint8_t)OD_PARAMETER) {
        return drive_param_get(&app->params, (drive_param_id_t)entry->slot);
    }
    if (entry->slot == (uint16_t)OD_LIVE_STATUSWORD) {
        const cia402_in_t facts = app_drive_facts(app);
        return cia402_statusword(&app->cia402, &facts);
    }
    if (entry->slot == (uint16_t)OD_LIVE_ERROR_CODE) {
        return error_code(app);
    }
    if (!cia402_get(&app->cia402, entry->slot, &value) && !trace_get(&app->trace, entry->slot, &value)) {
        (void)app_value(app, entry->slot, &value);
    }
    return value;
}

uint32_t node_host_put(void *context, const od_entry_t *entry, int32_t value)
{
    app_t *app = app_of(context);
    uint32_t code = 0;
    if (entry->kind == (uint8_t)OD_PARAMETER) {
        return app_put_parameter(app, (drive_param_id_t)entry->slot, value);
    }
    if (entry->slot == (uint16_t)OD_LIVE_PARAMETER_BATCH) {
        return app_put_batch(app, value != 0);
    }
    const bool done = app_identify_put(app, entry->slot, value) ||
                      cia402_put(&app->cia402, entry->slot, value, &code) ||
                      trace_put(&app->trace, entry->slot, value, &code);
    return done ? code : SDO_UNSUPPORTED;
}

static bool is_board_name(const od_entry_t *entry)
{
    return entry->slot == (uint16_t)OD_LIVE_HARDWARE_VERSION;
}

uint32_t node_host_size(void *context, const od_entry_t *entry)
{
    const app_t *app = app_of(context);
    if (is_board_name(entry)) {
        return (uint32_t)strlen(hal_board_name(app->hal));
    }
    return entry->slot == (uint16_t)OD_LIVE_TRACE_DATA ? trace_size(&app->trace) : 0U;
}

void node_host_read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    const app_t *app = app_of(context);
    if (is_board_name(entry)) {
        (void)memcpy(bytes, &hal_board_name(app->hal)[offset], count);
    } else {
        trace_read(&app->trace, offset, bytes, count);
    }
}

uint32_t node_host_write(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                         uint32_t count, bool last)
{
    (void)context;
    (void)entry;
    (void)offset;
    (void)bytes;
    (void)count;
    (void)last;
    return SDO_UNSUPPORTED; /* the dictionary has no domain that is written */
}

uint32_t node_host_store(void *context, uint32_t group)
{
    app_t *app = app_of(context);
    const uint32_t code = app_store_group(app, group, true);
    if (code == 0U && (group == NODE_GROUP_ALL || group == (uint32_t)OD_GROUP_MACHINE)) {
        app->stored = true;
    }
    return code;
}

uint32_t node_host_restore(void *context, uint32_t group)
{
    return app_store_group(app_of(context), group, false);
}

void node_host_recall(void *context)
{
    app_recall(app_of(context), OD_NODE);
}

/* While it is off there is nothing to save. */
void node_host_alarm(void *context, uint16_t code)
{
    app_t *app = app_of(context);
    if (app_is_on(app) && app->drive.fault == DRIVE_FAULT_NONE) {
        app->alarm = code;
        app_trip(app, DRIVE_FAULT_REMOTE_LOST);
    }
}

void node_host_reset(void *context)
{
    hal_reset(app_of(context)->hal);
}

/* --- the drive ---------------------------------------------------------------------------------------- */

static drive_command_t command_of(const app_t *app, const cia402_out_t *out)
{
    drive_command_t command = {.enable = out->enable,
                               .coast = out->coast,
                               .mode = DRIVE_MODE_SPEED,
                               .speed_mrad_s = out->velocity,
                               .torque_uNm = app_torque_uNm(app, out->torque),
                               .current_mA = out->current,
                               PM_IN_IMAGE(six_step, .duty_ppm = 100 * out->duty)};
    if (out->mode == CIA402_MODE_TORQUE) {
        command.mode = DRIVE_MODE_TORQUE;
    } else if (out->mode == CIA402_MODE_CURRENT) {
        command.mode = DRIVE_MODE_CURRENT;
    } else if (PM_HAS(six_step) != 0 && out->mode == CIA402_MODE_DUTY) {
        command.mode = DRIVE_MODE_DUTY;
    } else if (out->mode == CIA402_MODE_IDENTIFY) {
        app_identify_command(app, &command);
    } else {
        /* speed, also while there is none */
    }
    return command;
}

static bool same(const cia402_out_t *a, const cia402_out_t *b)
{
#if PM_HAS(six_step)
    if (a->duty != b->duty) {
        return false;
    }
#endif
    return a->enable == b->enable && a->coast == b->coast && a->mode == b->mode &&
           a->velocity == b->velocity && a->torque == b->torque && a->current == b->current;
}

/* Commands are passed on when they change: between changes, another source may command the drive. */
static void profile(app_t *app)
{
    const cia402_in_t facts = app_drive_facts(app);
    const cia402_out_t out = cia402_step(&app->cia402, &facts);
    if (!same(&out, &app->given) || out.clear_fault) {
        app->given = out;
        const drive_command_t command = command_of(app, &out);
        hal_lock(app->hal);
        drive_command(&app->drive, &command);
        if (out.clear_fault) {
            (void)drive_clear_fault(&app->drive);
            app->armed = false; /* the fault has opened the bridge, perhaps unseen by the main loop */
        }
        hal_unlock(app->hal);
    }
    if (out.clear_fault) { /* the state follows now, if it is gone */
        const cia402_in_t after = app_drive_facts(app);
        (void)cia402_step(&app->cia402, &after);
    }
}

bool app_bus_take(app_t *app)
{
    hal_can_frame_t in;
    uint32_t n = 0;
    while (n < FRAMES_MOST && hal_can_receive(app->hal, &in)) {
        node_frame_t frame = {.id = in.id, .length = in.length};
        (void)memcpy(frame.data, in.data, sizeof frame.data);
        node_receive(&app->node, &frame, hal_time_us(app->hal));
        profile(app); /* two controlwords in one round are two */
        n++;
    }
    return n > 0U;
}

static void watch_bus(app_t *app)
{
    static const node_bus_t states[HAL_CAN_BUS_OFF + 1] = {
        [HAL_CAN_ACTIVE] = NODE_BUS_ACTIVE,
        [HAL_CAN_PASSIVE] = NODE_BUS_PASSIVE,
        [HAL_CAN_BUS_OFF] = NODE_BUS_OFF,
    };
    const uint32_t now_us = hal_time_us(app->hal);
    const uint32_t lost = hal_can_lost(app->hal);
    node_bus(&app->node, states[hal_can_state(app->hal)]);
    if (lost != app->can_lost) {
        app->can_lost = lost;
        app->can_lost_us = now_us;
        node_error(&app->node, NODE_ERROR_OVERRUN, CODE_OVERRUN, lost);
    } else if (now_us - app->can_lost_us >= LOST_US) {
        node_error(&app->node, NODE_ERROR_OVERRUN, 0, lost);
    } else {
        /* not over yet */
    }
}

/* Of a master that has enabled the drive: another source of commands is its own business. */
static void watch_master(app_t *app)
{
    const node_silence_t silence = node_silence(&app->node);
    if (silence == NODE_HEARD) {
        node_error(&app->node, NODE_ERROR_SILENCE, 0, 0);
    } else if (cia402_on(&app->cia402)) {
        node_error(&app->node, NODE_ERROR_SILENCE, CODE_SILENCE, 0);
        if (silence == NODE_SILENT_OFF) {
            node_host_alarm(app, CODE_SILENCE);
        } else {
            cia402_abandon(&app->cia402);
        }
    } else {
        /* nothing runs by its command */
    }
}

/* The node has already reported a lost master. */
static void tell_fault(app_t *app)
{
    const drive_fault_t fault = app->drive.fault;
    const uint16_t code = fault == DRIVE_FAULT_REMOTE_LOST ? 0U : code_of(fault);
    node_error(&app->node, NODE_ERROR_APPLICATION, code, (uint32_t)fault);
}

void app_bus_init(app_t *app)
{
    uint32_t id[3];
    hal_unique_id(app->hal, id);
    cia402_init(&app->cia402);
    app_recall(app, OD_LIVE);
    trace_init(&app->trace, app->trace_ring, APP_TRACE_NUMBERS, app);
    const cia402_in_t facts = app_drive_facts(app);
    app->given = cia402_step(&app->cia402, &facts); /* no effect beyond what the drive does already */
    node_init(&app->node, app, id[0] ^ id[1] ^ id[2], hal_time_us(app->hal));
}

void app_bus_run(app_t *app)
{
    watch_bus(app);
    watch_master(app);
    profile(app);
    tell_fault(app);
    node_run(&app->node, hal_time_us(app->hal));
}
