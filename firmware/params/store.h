/* Values in two pages of flash: pairs of identifier and value, so that another firmware version takes over
 * the identifiers that it knows and ignores the others.
 *
 * A page is complete or void: a CRC over all of it is written behind it. Writing goes to the page that is not the
 * newest, so that a loss of power at any moment leaves the other one. Cells that were being written then read as
 * anything, and not always as the same: a CRC that is whole once may be void the next time. So the page holds
 * only from its seal on, which is written after the CRC has been read back: where any of it can be seen, the
 * CRC was finished. Before the other page is erased, which is the next save, the seal is written once more
 * behind, for the first may have been cut. A page without a seal counts only where there is no sealed one, and
 * of two the older one, which was whole when the other was begun.
 *
 *   page = magic, sequence, schema, count, then count pairs (id, value), then crc, ~crc, then up to four times
 *          seal, ~seal
 *
 * 32-bit little-endian words; an identifier is index * 256 + sub-index of the dictionary and is never reused.
 * The schema shows whether the page is of another version: then known identifiers are still read, and the
 * caller counts the others.
 *
 * No access to flash here: the caller moves the words (hal.h), two at a time, in order.
 * Tests: tests/unit/params. */
#ifndef PARAMS_STORE_H
#define PARAMS_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint32_t id;
    int32_t value;
} store_pair_t;

#define STORE_WORDS     (STORE_PAGE / 4U)
#define STORE_HEADER    4U /* words */
#define STORE_SEALS     4U
#define STORE_PAIRS_MAX ((STORE_WORDS - STORE_HEADER - 2U) / 2U - STORE_SEALS)

/* Number of pairs of a valid page, -1: void. */
int32_t store_check(const uint32_t page[STORE_WORDS]);

/* Of a valid page */
uint32_t store_seals(const uint32_t page[STORE_WORDS]); /* up to the last of which anything can be seen */

/* Of two pages the valid one that is sealed, of two sealed ones that with the newer sequence (which wraps), of two
 * without seals the older: 0, 1, or -1: both void. */
int32_t store_newest(const uint32_t first[STORE_WORDS], const uint32_t second[STORE_WORDS]);

/* Of a valid page */
uint32_t store_sequence(const uint32_t page[STORE_WORDS]);
uint32_t store_schema(const uint32_t page[STORE_WORDS]);
store_pair_t store_pair(const uint32_t page[STORE_WORDS], uint32_t index);
bool store_find(const uint32_t page[STORE_WORDS], uint32_t id, int32_t *value); /* false: it has none */

/* A page is made in order: begin, as many pairs as were announced, end, and when store_check() has found it valid
 * where it is, seal. Each gives the words to be written next: the header four, the others two. */
typedef struct {
    uint32_t crc;
} store_writer_t;

void store_begin(store_writer_t *writer, uint32_t sequence, uint32_t schema, uint32_t count,
                 uint32_t words[STORE_HEADER]);
void store_put(store_writer_t *writer, store_pair_t pair, uint32_t words[2]);
void store_end(const store_writer_t *writer, uint32_t words[2]);
void store_seal(uint32_t words[2]);

#ifdef __cplusplus
}
#endif

#endif
