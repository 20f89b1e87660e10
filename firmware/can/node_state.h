/* The node's memory. Users of node.h allocate it and read it only through node.h. */
#ifndef CAN_NODE_STATE_H
#define CAN_NODE_STATE_H

#include "firmware/can/dictionary_slots.h"
#include "firmware/can/node.h"

enum { NODE_RING = 8, NODE_PDOS = 4, NODE_MAPPED = 8, NODE_CONSUMERS = 2, NODE_HISTORY = 8, NODE_EMCY = 4 };

/* A process data object as it works; made anew from the dictionary after every change of it. */
typedef struct {
    uint16_t id; /* 0: off */
    uint8_t type;
    uint8_t count, length; /* mapped objects, bytes */
    uint8_t syncs;         /* since the last transmission */
    bool waiting;          /* RPDO: for SYNC; TPDO: an event has come */
    bool timed;            /* RPDO: its time-out runs; TPDO: one has been sent */
    uint8_t data[8];       /* RPDO: received; TPDO: sent last */
    uint32_t event_us, inhibit_us, last_us;
} node_pdo_t;

typedef struct {
    uint8_t id; /* 0: none */
    bool seen;  /* it has begun, and is watched */
    uint32_t time_us, last_us;
} node_consumer_t;

typedef enum {
    SDO_IDLE,
    SDO_UPLOAD,
    SDO_DOWNLOAD,
    SDO_BLOCK_UPLOAD_BEGIN, /* until the client says start */
    SDO_BLOCK_UPLOAD,       /* segments go out as there is room */
    SDO_BLOCK_UPLOAD_WAIT,  /* for the client's answer to a block */
    SDO_BLOCK_UPLOAD_END,
    SDO_BLOCK_DOWNLOAD,
    SDO_BLOCK_DOWNLOAD_END,
} node_sdo_state_t;

typedef struct {
    node_sdo_state_t state;
    const od_entry_t *entry;
    uint32_t size;      /* of an upload; of a download 0: unknown */
    uint32_t position;  /* bytes transferred */
    uint32_t confirmed; /* block upload: bytes that the client has */
    uint32_t last_us;   /* of the client's last frame */
    uint16_t crc;
    uint8_t toggle; /* 0 or 0x10 */
    uint8_t block, sequence;
    uint8_t held_count; /* block download: bytes of the last segment, whose length the end gives */
    bool with_crc, complete;
    uint8_t object[3]; /* index and sub-index as the client sent them */
    uint8_t number[4];
    uint8_t held[7];
} node_sdo_t;

typedef struct {
    bool configuring;
    uint8_t matched;  /* of the selective identity, words in order */
    uint8_t position; /* of fast scan */
} node_lss_t;

typedef struct {
    uint16_t code;
    uint8_t error_register;
    uint32_t info;
} node_emcy_t;

struct node {
    void *context;
    node_nmt_t nmt;
    uint8_t id;    /* in use; 255: none */
    bool recalled; /* the words of node id and bit rate have been given */
    uint32_t now_us;
    uint32_t word[OD_NODE_WORDS];
    uint16_t mapped[OD_NODE_MAPPINGS]; /* rows of od_table, PDO after PDO as in `pdo`; 0: none */

    node_frame_t ring[NODE_RING];
    uint8_t ring_first, ring_count;
    uint32_t dropped; /* frames that found the ring full */

    uint32_t heard_us;     /* the last frame for this node */
    uint32_t heartbeat_us; /* 0: none */
    uint32_t heartbeat_last_us;
    node_consumer_t consumer[NODE_CONSUMERS];

    uint16_t error[NODE_ERRORS];    /* code that is there; 0: none */
    uint16_t reported[NODE_ERRORS]; /* the same, as last sent in a message */
    node_emcy_t emcy[NODE_EMCY];    /* to be sent */
    uint8_t emcy_count;
    uint32_t emcy_last_us;
    node_bus_t bus;

    uint16_t sync_id;
    uint32_t scan_us;              /* TPDOs were looked at */
    node_pdo_t pdo[2 * NODE_PDOS]; /* received, then transmitted */
    node_sdo_t sdo;
    node_lss_t lss;
};

#endif
