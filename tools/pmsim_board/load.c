#include "tools/pmsim_board/load.h"

#include <stddef.h>

#include "firmware/can/dictionary.h"
#include "firmware/params/parameters.h"

#define NODE_ID        1U
#define REQUEST_ID     (0x600U + NODE_ID)
#define ANSWER_ID      (0x580U + NODE_ID)
#define REQUEST_EVERY  30U                                     /* periods: each finds the last one answered */
#define REPEAT_EVERY   540U                                    /* of the trace's ring of some 4000 numbers */
#define DOWNLOAD(size) ((uint8_t)(0x23U | (4U - (size)) << 2)) /* expedited */
#define ABORT          0x80U

enum { TRACE = 0x3100, TRACE_SIGNALS = 0x3101, SIGNALS = 0x2900 };
enum { COMMAND = 1, TRIGGER = 5, EDGE = 6, LEVEL = 7 };
enum { OFF, ARM };

typedef struct {
    uint16_t index;
    uint8_t sub, size;
    int32_t value;
} request_t;

/* As many signals as there can be, the angle among them; the trigger is the q-axis current passing zero. */
static const request_t setup[] = {
    {TRACE_SIGNALS, 1, 4, SIGNALS * 0x10000 + 0x100},
    {TRACE_SIGNALS, 2, 4, SIGNALS * 0x10000 + 0x200},
    {TRACE_SIGNALS, 3, 4, SIGNALS * 0x10000 + 0x300},
    {TRACE_SIGNALS, 4, 4, SIGNALS * 0x10000 + 0x400},
    {TRACE_SIGNALS, 5, 4, SIGNALS * 0x10000 + 0x500},
    {TRACE_SIGNALS, 6, 4, SIGNALS * 0x10000 + 0x600},
    {TRACE_SIGNALS, 7, 4, SIGNALS * 0x10000 + 0xA00},
    {TRACE_SIGNALS, 8, 4, SIGNALS * 0x10000 + 0xB00},
    {TRACE, TRIGGER, 1, 2},
    {TRACE, EDGE, 1, 0},
    {TRACE, LEVEL, 4, 0},
    {TRACE, COMMAND, 1, ARM},
};

enum { SETUP = sizeof setup / sizeof setup[0], REPEATED = 3 };

load_t load_make(board_t *board, const drive_params_t *params)
{
    return (load_t){.board = board, .acceleration = params->acceleration};
}

static void send(load_t *load, const request_t *request)
{
    board_frame_t frame = {.id = REQUEST_ID, .length = 8};
    frame.data[0] = DOWNLOAD(request->size);
    frame.data[1] = (uint8_t)(request->index & 0xFFU);
    frame.data[2] = (uint8_t)(request->index >> 8);
    frame.data[3] = request->sub;
    for (unsigned n = 0; n < request->size; n++) {
        frame.data[4 + n] = (uint8_t)((uint32_t)request->value >> (8U * n));
    }
    (void)board_can_send(load->board, &frame);
}

static request_t parameter(drive_param_id_t id, int32_t value)
{
    for (uint32_t row = 0; row < od_count; row++) {
        const od_entry_t *entry = &od_table[row];
        if (entry->kind == (uint8_t)OD_PARAMETER && entry->slot == (uint16_t)id) {
            return (request_t){entry->index, entry->sub, od_size(entry), value};
        }
    }
    return (request_t){0};
}

/* Off and on again, and a parameter to and fro by a hundredth. */
static request_t repeated(const load_t *load)
{
    const uint32_t n = load->next - SETUP;
    const bool odd = n / REPEATED % 2U != 0U;
    switch (n % REPEATED) {
    case 0:
        return (request_t){TRACE, COMMAND, 1, OFF};
    case 1:
        return (request_t){TRACE, COMMAND, 1, ARM};
    default:
        return parameter(DRIVE_PARAM_acceleration, load->acceleration + (odd ? load->acceleration / 100 : 0));
    }
}

void load_step(load_t *load)
{
    const bool first = load->next < SETUP || (load->next - SETUP) % REPEATED != 0U;
    if (++load->periods < (first ? REQUEST_EVERY : REPEAT_EVERY)) {
        return;
    }
    const request_t request = load->next < SETUP ? setup[load->next] : repeated(load);
    send(load, &request);
    load->next++;
    load->periods = 0;
}

void load_take(load_t *load, const board_frame_t *frame)
{
    if (frame->id == ANSWER_ID && frame->data[0] == ABORT) {
        load->refused++;
    }
}
