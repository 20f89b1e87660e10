/* Parameters in two pages of flash: pairs of identifier and value, so that another firmware version takes
 * over what it knows and leaves out what it does not.
 *
 * A page is complete or void: a CRC guards everything. Writing goes to the page that is not the newest, so
 * that power lost at any moment leaves the other one.
 *
 *   page = magic, sequence, count, crc, then count pairs (id, value); 32-bit little-endian words
 *
 * No access to flash here: the caller moves the bytes (hal.h). Tests: tests/unit/params. */
#ifndef PARAMS_STORE_H
#define PARAMS_STORE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t id;
    int32_t value;
} store_pair_t;

#define STORE_PAIRS_MAX 126U
#define STORE_WORDS     (4U + 2U * STORE_PAIRS_MAX) /* most of a page that is used: 1 kB */

/* Identifier of a parameter: 32-bit FNV-1a of its name. A test proves that no two collide. */
uint32_t store_id(const char *name);

/* Number of pairs of a valid page, -1: void. */
int32_t store_check(const uint32_t page[STORE_WORDS]);

/* Of two pages the valid one with the newer sequence (which wraps): 0, 1, or -1: both void. */
int32_t store_newest(const uint32_t first[STORE_WORDS], const uint32_t second[STORE_WORDS]);

uint32_t store_sequence(const uint32_t page[STORE_WORDS]);
store_pair_t store_pair(const uint32_t page[STORE_WORDS], uint32_t index);

/* Fills a page. Returns its words, even: the rest is left alone. 0: too many. */
uint32_t store_make(uint32_t page[STORE_WORDS], uint32_t sequence, const store_pair_t pairs[],
                    uint32_t count);

#endif
