#include "tools/pmsim_board/master.h"

#include <math.h>

#include "firmware/can/cia402.h"
#include "firmware/params/parameters.h"

/* controlword, mode, velocity; controlword, torque, current; duty */
#define NODE_ID   1U
#define NMT_ID    0x000U
#define RPDO1_ID  (0x200U + NODE_ID)
#define RPDO2_ID  (0x300U + NODE_ID)
#define RPDO3_ID  (0x400U + NODE_ID)
#define SDO_ID    (0x600U + NODE_ID)
#define ANSWER_ID (0x580U + NODE_ID)
#define NMT_START 1U

/* identification.command */
#define COMMAND     0x3000
#define COMMAND_SUB 0x01

enum { SDO_DOWNLOAD_1 = 0x2F, SDO_DOWNLOAD_4 = 0x23, SDO_ABORT = 0x80 };

/* Of RPDO2 and RPDO3. */
enum {
    PARAMETERS_2 = 0x1401,
    PARAMETERS_3 = 0x1402,
    MAPPING_3 = 0x1602,
    COB_ID = 1,
    TARGET_DUTY = 0x28000210
};

enum { SHUTDOWN = 0x06, SWITCH_ON = 0x07, ENABLE_OPERATION = 0x0F, FAULT_RESET = 0x80 };

static void put_number(uint8_t *bytes, int count, int32_t value)
{
    for (int n = 0; n < count; n++) {
        bytes[n] = (uint8_t)((uint32_t)value >> (8 * n));
    }
}

static void write_object(master_t *master, int index, int sub, int size, int32_t value)
{
    board_frame_t frame = {.id = SDO_ID, .length = 8};
    frame.data[0] = size == 1 ? SDO_DOWNLOAD_1 : SDO_DOWNLOAD_4;
    put_number(&frame.data[1], 2, index);
    put_number(&frame.data[3], 1, sub);
    put_number(&frame.data[4], size, value);
    (void)board_can_send(master->board, &frame);
}

static int mode_number(drive_mode_t mode)
{
    switch (mode) {
    case DRIVE_MODE_DUTY:
        return CIA402_MODE_DUTY;
    case DRIVE_MODE_TORQUE:
        return CIA402_MODE_TORQUE;
    case DRIVE_MODE_CURRENT:
        return CIA402_MODE_CURRENT;
    case DRIVE_MODE_IDENTIFY:
        return CIA402_MODE_IDENTIFY;
    case DRIVE_MODE_SPEED:
    default:
        return CIA402_MODE_VELOCITY;
    }
}

static void send_control(master_t *master, const drive_command_t *command, int controlword)
{
    board_frame_t frame = {.id = RPDO1_ID, .length = 7};
    put_number(&frame.data[0], 2, controlword);
    put_number(&frame.data[2], 1, mode_number(command->mode));
    put_number(&frame.data[3], 4, command->speed_mrad_s);
    (void)board_can_send(master->board, &frame);
}

/* What to identify: the node takes it while the drive is off. */
static void send_routines(master_t *master, const drive_command_t *command)
{
    const bool identifies = command->mode == DRIVE_MODE_IDENTIFY;
    if (identifies && command->routines != master->routines) {
        write_object(master, COMMAND, COMMAND_SUB, 1, command->routines);
        master->routines = command->routines;
    }
}

static void send_targets(master_t *master, const drive_command_t *command, int controlword)
{
    const double permille = 1e-3 * command->torque_uNm / master->rated_torque_Nm;
    board_frame_t frame = {.id = RPDO2_ID, .length = 8};
    put_number(&frame.data[0], 2, controlword);
    put_number(&frame.data[2], 2, (int32_t)lround(permille));
    put_number(&frame.data[4], 4, command->current_mA);
    (void)board_can_send(master->board, &frame);
}

#if PM_HAS(six_step)
/* Mapped when it is first asked for: an image without block commutation has no such object. */
static void send_duty(master_t *master, const drive_command_t *command)
{
    if (command->mode != DRIVE_MODE_DUTY) {
        return;
    }
    if (!master->gives_duty) {
        write_object(master, MAPPING_3, 1, 4, TARGET_DUTY);
        write_object(master, MAPPING_3, 0, 1, 1);
        write_object(master, PARAMETERS_3, COB_ID, 4, RPDO3_ID);
        master->gives_duty = true;
    }
    board_frame_t frame = {.id = RPDO3_ID, .length = 2};
    put_number(&frame.data[0], 2, (int32_t)lround(1e-2 * command->duty_ppm));
    (void)board_can_send(master->board, &frame);
}
#endif

master_t master_make(board_t *board, const drive_params_t *params)
{
    return (master_t){
        .board = board,
        .rated_torque_Nm = 1.5 * params->pole_pairs * 1e-9 * params->psi_m * 1e-3 * params->i_rated,
    };
}

void master_start(master_t *master)
{
    const board_frame_t start = {.id = NMT_ID, .length = 2, .data = {NMT_START, NODE_ID}};
    write_object(master, PARAMETERS_2, COB_ID, 4, RPDO2_ID);
    (void)board_can_send(master->board, &start);
}

/* The targets come first. */
void master_send(master_t *master, const drive_command_t *command)
{
    const bool starts = command->enable && !master->enabled;
    const int now = master->enabled ? ENABLE_OPERATION : SWITCH_ON;
    send_targets(master, command, command->enable ? now : SWITCH_ON);
    PM_IN_IMAGE(six_step, send_duty(master, command);)
    if (starts) {
        send_routines(master, command);
        send_control(master, command, SHUTDOWN);
        send_control(master, command, SWITCH_ON);
    }
    master->enabled = command->enable;
    send_control(master, command, master->enabled ? ENABLE_OPERATION : SWITCH_ON);
}

bool master_is_refused(const board_frame_t *frame)
{
    const int index = frame->data[1] | frame->data[2] << 8;
    return frame->id == ANSWER_ID && frame->data[0] == SDO_ABORT && index == COMMAND &&
           frame->data[3] == COMMAND_SUB;
}

void master_clear_fault(master_t *master, const drive_command_t *command)
{
    master->enabled = false;
    send_control(master, command, FAULT_RESET);
    master_send(master, command);
}
