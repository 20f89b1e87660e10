/* Interface between the parts of the node; not for users of node.h. */
#ifndef CAN_NODE_PARTS_H
#define CAN_NODE_PARTS_H

#include "firmware/can/node_state.h"

#ifdef __cplusplus
extern "C" {
#endif

#define NODE_NO_ID 255U

/* Indices of CiA 301 */
enum {
    OD_ERROR_REGISTER = 0x1001,
    OD_ERROR_HISTORY = 0x1003,
    OD_SYNC_ID = 0x1005,
    OD_STORE = 0x1010,
    OD_RESTORE = 0x1011,
    OD_EMCY_ID = 0x1014,
    OD_EMCY_INHIBIT = 0x1015,
    OD_CONSUMER = 0x1016,
    OD_HEARTBEAT = 0x1017,
    OD_IDENTITY = 0x1018,
    OD_ERROR_BEHAVIOUR = 0x1029,
    OD_COMMAND_WATCH = 0x2020,
    OD_RPDO = 0x1400,
    OD_RPDO_MAP = 0x1600,
    OD_TPDO = 0x1800,
    OD_TPDO_MAP = 0x1A00,
};

/* Abort codes of CiA 301 beside those of node.h */
#define SDO_OK           0x00000000U
#define SDO_TOGGLE       0x05030000U
#define SDO_TIMEOUT      0x05040000U
#define SDO_COMMAND      0x05040001U
#define SDO_BLOCK_SIZE   0x05040002U
#define SDO_SEQUENCE     0x05040003U
#define SDO_CRC          0x05040004U
#define SDO_WRITE_ONLY   0x06010001U
#define SDO_READ_ONLY    0x06010002U
#define SDO_NO_OBJECT    0x06020000U
#define SDO_NOT_MAPPABLE 0x06040041U
#define SDO_PDO_LENGTH   0x06040042U
#define SDO_TOO_LONG     0x06070012U
#define SDO_TOO_SHORT    0x06070013U
#define SDO_NO_SUB       0x06090011U
#define SDO_TOO_HIGH     0x06090031U
#define SDO_TOO_LOW      0x06090032U
#define SDO_SIGNATURE    0x08000020U

/* object.c: little-endian */
uint32_t le_get(const uint8_t bytes[], uint32_t count);
void le_put(uint8_t bytes[], uint32_t count, uint32_t value);

/* node.c */
bool node_send(node_t *node, const node_frame_t *frame); /* false: dropped */
uint32_t node_room(const node_t *node);
void node_alarm(node_t *node, node_error_t source, uint16_t code); /* the error, and torque off */
void node_lose_master(node_t *node);                               /* as 1029h says */
void node_boot_up(node_t *node);                                   /* communication anew */

static inline void node_lock(node_t *node)
{
    node->word[OD_NODE_PARAMETERS_OPEN] = 0;
}

static inline void node_hear(node_t *node) /* a valid frame for it */
{
    node->heard_us = node->now_us;
}

static inline bool node_elapsed(const node_t *node, uint32_t since_us, uint32_t time_us)
{
    return node->now_us - since_us >= time_us;
}

/* object.c: entries of the dictionary with all checks; results are abort codes */
uint32_t object_find(uint16_t index, uint8_t sub, const od_entry_t **entry);
uint32_t object_word(const node_t *node, uint16_t index,
                     uint8_t sub); /* OD_NODE or constant; 0: there is none */
uint32_t object_node_word(const node_t *node, const od_entry_t *entry); /* OD_NODE */
void object_set_node_word(node_t *node, const od_entry_t *entry, uint32_t value);
int32_t object_preset(const node_t *node, const od_entry_t *entry);
int32_t object_get(const node_t *node, const od_entry_t *entry); /* a number */
uint32_t object_check_write(const node_t *node, const od_entry_t *entry);
uint32_t object_put(node_t *node, const od_entry_t *entry, int32_t value); /* a number */
int32_t object_from_bytes(const od_entry_t *entry, const uint8_t bytes[]); /* od_size() of them */

/* communication.c: OD_NODE entries that mean something to the node */
uint32_t communication_put(node_t *node, const od_entry_t *entry, uint32_t value);
void communication_reset(node_t *node); /* presets, what is stored, and all that follows from it */

/* heartbeat.c */
void heartbeat_setup(node_t *node);
void heartbeat_receive(node_t *node, const node_frame_t *frame);
void heartbeat_run(node_t *node);

/* emcy.c */
void emcy_run(node_t *node);
void emcy_forget(node_t *node); /* clears the queued messages */

/* pdo.c, pdo_transmit.c */
uint32_t pdo_mappable(uint32_t mapping, bool receive);
uint32_t pdo_length(const node_t *node, uint16_t map_index, uint32_t count,
                    uint32_t *length); /* of its first objects */
const od_entry_t *pdo_object(const node_t *node, const node_pdo_t *pdo, uint32_t n); /* mapped in place n */
void pdo_setup(node_t *node, bool receive, uint32_t number);
void pdo_start(node_t *node); /* OPERATIONAL is entered */
void pdo_receive(node_t *node, const node_frame_t *frame);
void pdo_sync(node_t *node);
void pdo_run(node_t *node);
void pdo_transmit_sync(node_t *node);
void pdo_transmit_run(node_t *node);

/* sdo.c, sdo_block.c */
void sdo_receive(node_t *node, const uint8_t request[8]);
void sdo_run(node_t *node);
void sdo_reply(node_t *node, const uint8_t reply[8]);
void sdo_abort(node_t *node, uint32_t code);
void sdo_fetch(const node_t *node, uint32_t position, uint8_t bytes[], uint32_t count);
uint32_t sdo_deliver(node_t *node, const uint8_t bytes[], uint32_t count, bool last);
uint32_t sdo_begin_download(node_t *node, const uint8_t request[8], bool sized);
uint32_t sdo_begin_upload(node_t *node, const uint8_t request[8]);
void sdo_block_receive(node_t *node, const uint8_t request[8]);
void sdo_block_run(node_t *node);

/* lss.c */
void lss_receive(node_t *node, const node_frame_t *frame);

#ifdef __cplusplus
}
#endif

#endif
