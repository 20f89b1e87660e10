/* The object dictionary: a constant table, generated from firmware/params/parameters.yaml, sorted by index
 * and sub-index. The yaml file describes each value; kind and slot say where it is stored.
 *
 * Values are up to 32 bits wide, in integer SI decimals (parameters.yaml). Strings and domains are bytes.
 * Nothing here knows of motors: the application reads and writes by slot (node.h). */
#ifndef CAN_DICTIONARY_H
#define CAN_DICTIONARY_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Data types of CiA 301 that are used */
typedef enum {
    OD_I8 = 0x02,
    OD_I16 = 0x03,
    OD_I32 = 0x04,
    OD_U8 = 0x05,
    OD_U16 = 0x06,
    OD_U32 = 0x07,
    OD_STRING = 0x09,
    OD_DOMAIN = 0x0F,
} od_type_t;

/* Where the value lives */
typedef enum {
    OD_CONSTANT,  /* `preset` itself; a string or domain: constant bytes number `slot` */
    OD_NODE,      /* word `slot` of the node's own: communication objects */
    OD_PARAMETER, /* parameter `slot` of the drive (drive_param_id_t), as the image counts them */
    OD_LIVE,      /* number `slot` of what the application shows or takes: CiA 402, measurements, trace */
} od_kind_t;

enum {
    OD_READ = 1 << 0,
    OD_WRITE = 1 << 1,
    OD_MAP_TX = 1 << 2,
    OD_MAP_RX = 1 << 3,
    OD_STORED = 1 << 4,
    OD_ONLY_OFF = 1 << 5, /* refused while the bridge is on: 0800 0022h */
    OD_NODE_ID = 1 << 6,  /* preset is relative to the node id */
    OD_RANGE = 1 << 7,    /* least and most are checked: 0609 0031h, 0609 0032h */
};

/* Groups of 1010h and 1011h, beside 1: all */
typedef enum { OD_GROUP_NONE, OD_GROUP_COMMUNICATION, OD_GROUP_APPLICATION, OD_GROUP_MACHINE } od_group_t;

/* Unsigned types: as their bit pattern */
typedef struct {
    int32_t least, preset, most;
} od_values_t;

typedef struct {
    uint16_t index;
    uint8_t sub;
    uint8_t flags;
    unsigned type : 4;  /* od_type_t */
    unsigned kind : 2;  /* od_kind_t */
    unsigned group : 2; /* od_group_t */
    unsigned slot : 10;
    unsigned values : 10; /* place in od_values or od_presets; parameters have theirs elsewhere */
    unsigned locked : 1;  /* refused while the lock is closed: 0800 0021h */
} od_entry_t;

/* Generated: dictionary_table.c, and the names of slots in dictionary_slots.h */
extern const od_entry_t od_table[];
extern const od_values_t od_values[]; /* of what has OD_RANGE: each that occurs, once; without parameters */
extern const int32_t od_presets[];    /* of what has no range */
extern const uint16_t od_count;
extern const uint32_t od_schema; /* CRC-32 over what a stored set depends on */

/* Constant strings and domains, by slot */
typedef struct {
    const uint8_t *bytes;
    uint32_t size;
} od_bytes_t;

extern const od_bytes_t od_bytes[];

/* Without OD_RANGE only the preset counts. */
od_values_t od_values_of(const od_entry_t *entry);

/* NULL: no such object, or with *has_index no such sub-index. Binary search. */
const od_entry_t *od_find(uint16_t index, uint8_t sub, bool *has_index);
uint8_t od_size(const od_entry_t *entry); /* bytes of a number; 0: string or domain */

#ifdef __cplusplus
}
#endif

#endif
