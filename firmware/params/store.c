#include "firmware/params/store.h"

#define MAGIC    0x32504D50U /* "PMP2" */
#define CRC_POLY 0xEDB88320U /* CRC-32 of IEEE 802.3, reflected */

enum { WORD_MAGIC, WORD_SEQUENCE, WORD_SCHEMA, WORD_COUNT };

static uint32_t crc_word(uint32_t crc, uint32_t word)
{
    uint32_t rest = crc ^ word;
    for (uint32_t bit = 0; bit < 32U; bit++) {
        rest = (rest >> 1) ^ ((rest & 1U) != 0U ? CRC_POLY : 0U);
    }
    return rest;
}

int32_t store_check(const uint32_t page[STORE_WORDS])
{
    const uint32_t count = page[WORD_COUNT];
    if (page[WORD_MAGIC] != MAGIC || count > STORE_PAIRS_MAX) {
        return -1;
    }
    const uint32_t end = STORE_HEADER + 2U * count;
    uint32_t crc = UINT32_MAX;
    for (uint32_t n = 0; n < end; n++) {
        crc = crc_word(crc, page[n]);
    }
    return (page[end] == ~crc && page[end + 1U] == crc) ? (int32_t)count : -1;
}

int32_t store_newest(const uint32_t first[STORE_WORDS], const uint32_t second[STORE_WORDS])
{
    const bool first_valid = store_check(first) >= 0;
    const bool second_valid = store_check(second) >= 0;
    if (first_valid && second_valid) {
        return (int32_t)(second[WORD_SEQUENCE] - first[WORD_SEQUENCE]) > 0 ? 1 : 0;
    }
    if (first_valid) {
        return 0;
    }
    return second_valid ? 1 : -1;
}

uint32_t store_sequence(const uint32_t page[STORE_WORDS])
{
    return page[WORD_SEQUENCE];
}

uint32_t store_schema(const uint32_t page[STORE_WORDS])
{
    return page[WORD_SCHEMA];
}

store_pair_t store_pair(const uint32_t page[STORE_WORDS], uint32_t index)
{
    const uint32_t at = STORE_HEADER + 2U * index;
    return (store_pair_t){.id = page[at], .value = (int32_t)page[at + 1U]};
}

bool store_find(const uint32_t page[STORE_WORDS], uint32_t id, int32_t *value)
{
    for (uint32_t n = 0; n < page[WORD_COUNT]; n++) {
        const store_pair_t pair = store_pair(page, n);
        if (pair.id == id) {
            *value = pair.value;
            return true;
        }
    }
    return false;
}

void store_begin(store_writer_t *writer, uint32_t sequence, uint32_t schema, uint32_t count,
                 uint32_t words[STORE_HEADER])
{
    words[WORD_MAGIC] = MAGIC;
    words[WORD_SEQUENCE] = sequence;
    words[WORD_SCHEMA] = schema;
    words[WORD_COUNT] = count;
    writer->crc = UINT32_MAX;
    for (uint32_t n = 0; n < STORE_HEADER; n++) {
        writer->crc = crc_word(writer->crc, words[n]);
    }
}

void store_put(store_writer_t *writer, store_pair_t pair, uint32_t words[2])
{
    words[0] = pair.id;
    words[1] = (uint32_t)pair.value;
    writer->crc = crc_word(crc_word(writer->crc, words[0]), words[1]);
}

void store_end(const store_writer_t *writer, uint32_t words[2])
{
    words[0] = ~writer->crc;
    words[1] = writer->crc;
}
