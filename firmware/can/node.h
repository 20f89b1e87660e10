/* CANopen node (CiA 301, LSS of CiA 305): what it is to a master, over the dictionary of dictionary.h.
 *
 * NMT slave, heartbeat producer and consumer, SDO server (expedited, segmented, block), four RPDOs and four
 * TPDOs, SYNC, EMCY with history, LSS. It knows nothing of motors: values are the application's, by slot.
 *
 *   node_init(n, context, serial, now)   values of the dictionary, then boot-up
 *   node_receive(n, frame, now)                for every frame, at any time
 *   node_run(n, now)                           timers and what waits to be sent: in every round of the main
 *                                              loop while node_busy(n), else when a timer may have run out
 *   node_bus(n, state), node_error(n, ...)     what the application has noticed
 *
 * Thread context alone; nothing blocks. Time is passed in, in microseconds that wrap; node_run() must come at
 * least every 50 ms. At most NODE_RING frames wait for the host; what finds no room then is dropped and
 * counted, but an SDO block waits for room.
 *
 * Reactions: heartbeat of a master lost, RPDO time-out, bus-off, and leaving OPERATIONAL or a reset while the
 * application is on, call node_host_alarm(). After a lost heartbeat or bus-off the node goes from OPERATIONAL
 * to PRE-OPERATIONAL as 1029h says. Another node that is heard with this node id is an error; while the
 * application is off the node then stays out of OPERATIONAL until communication is reset.
 *
 * Objects with `locked` can be written while 2010h:5 is open: "open" written to it opens; it is closed after a
 * reset, and 0, NMT stop and a lost master close it. Tests: tests/unit/can. */
#ifndef CAN_NODE_H
#define CAN_NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/can/dictionary.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Classic frame, 11-bit identifier */
typedef struct {
    uint16_t id;
    uint8_t length; /* 0 ... 8 */
    uint8_t data[8];
} node_frame_t;

typedef enum {
    NODE_INITIALISING = 0, /* no node id yet: LSS alone */
    NODE_STOPPED = 4,
    NODE_OPERATIONAL = 5,
    NODE_PRE_OPERATIONAL = 127,
} node_nmt_t;

typedef enum { NODE_BUS_ACTIVE, NODE_BUS_PASSIVE, NODE_BUS_OFF } node_bus_t;

/* Since the last frame for this node longer than its object 2020h:1 allows, and what 2020h:2 wants then */
typedef enum { NODE_HEARD, NODE_SILENT_OFF, NODE_SILENT_STOP } node_silence_t;

/* Each has at most one error at a time. */
typedef enum {
    NODE_ERROR_APPLICATION,
    NODE_ERROR_HEARTBEAT,
    NODE_ERROR_RPDO,
    NODE_ERROR_LENGTH, /* of a process data object */
    NODE_ERROR_NMT,
    NODE_ERROR_BUS,
    NODE_ERROR_OVERRUN,
    NODE_ERROR_COLLISION, /* another has this node id */
    NODE_ERROR_SILENCE,   /* of the master, while the application was on */
    NODE_ERRORS,
} node_error_t;

/* Beside od_group_t: node id and bit rate alone */
#define NODE_GROUP_ALL 0U
#define NODE_GROUP_LSS 4U

/* Abort codes that the application may give; 0 is success */
#define SDO_MEMORY       0x05040005U
#define SDO_UNSUPPORTED  0x06010000U
#define SDO_INCOMPATIBLE 0x06040043U /* the cross check refuses the value */
#define SDO_HARDWARE     0x06060000U
#define SDO_INVALID      0x06090030U /* not one of the values that there are */
#define SDO_LOCKED       0x08000021U
#define SDO_STATE        0x08000022U /* not in the present state of the device */
#define SDO_NO_DATA      0x08000024U

/* Functions that the application defines for the node: called directly, so that the depth of the stack can be
 * computed. Numbers of 8 and 16 bits are passed as the value they mean; unsigned 32 bits as their bit
 * pattern. Ranges have been checked, for OD_ONLY_OFF that the bridge is off, and the lock. */
bool node_host_send(void *context, const node_frame_t *frame); /* false: no room */
bool node_host_on(void *context);                              /* the bridge is on, or about to be */
int32_t node_host_get(void *context, const od_entry_t *entry); /* OD_PARAMETER, OD_LIVE */
uint32_t node_host_put(void *context, const od_entry_t *entry, int32_t value); /* abort code */
uint32_t node_host_size(void *context, const od_entry_t *entry);               /* bytes of a live domain */

/* Of a live domain, within its size; the same bytes may be asked for again. */
void node_host_read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count);

/* In order; `last` comes once, after all checks, perhaps with count 0. Abort code. */
uint32_t node_host_write(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                         uint32_t count, bool last);

uint32_t node_host_store(void *context, uint32_t group);   /* OD_GROUP_..., NODE_GROUP_...; abort code */
uint32_t node_host_restore(void *context, uint32_t group); /* forgets what is stored; abort code */
void node_host_recall(void *context);               /* give stored communication objects: node_recall() */
void node_host_alarm(void *context, uint16_t code); /* torque off; what EMCY says */
void node_host_reset(void *context);                /* restart of all; may return before it */

typedef struct node node_t; /* caller-owned: node_state.h */

/* `context` is given back to the application; `serial` is sub 4 of 1018h. */
void node_init(node_t *node, void *context, uint32_t serial, uint32_t now_us);
void node_receive(node_t *node, const node_frame_t *frame, uint32_t now_us);
void node_run(node_t *node, uint32_t now_us);
bool node_busy(const node_t *node); /* something waits for room to be sent */

void node_bus(node_t *node, node_bus_t state);
node_silence_t node_silence(const node_t *node);

/* An error is present, or with code 0 no longer: EMCY, 1001h and 1003h follow. `info` goes into the last five
 * bytes. Repeating the same code has no effect. */
void node_error(node_t *node, node_error_t source, uint16_t code, uint32_t info);

/* Of an OD_NODE entry: from within node_host_recall(), as stored; and to be stored. Those with OD_NODE_ID are
 * relative to the node id. */
void node_recall(node_t *node, const od_entry_t *entry, int32_t value);
int32_t node_stored(const node_t *node, const od_entry_t *entry);

node_nmt_t node_nmt(const node_t *node);
uint8_t node_id(const node_t *node);

#ifdef __cplusplus
}
#endif

#endif
