#include "firmware/params/store.h"

#define MAGIC    0x33504D50U /* "PMP3" */
#define SEAL     0x4C414553U /* "SEAL" */
#define ERASED   UINT32_MAX
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

uint32_t store_seals(const uint32_t page[STORE_WORDS])
{
    const uint32_t *seal = &page[STORE_HEADER + 2U * page[WORD_COUNT] + 2U];
    uint32_t words = 2U * STORE_SEALS;
    while (words > 0U && seal[words - 1U] == ERASED) {
        words--;
    }
    return (words + 1U) / 2U;
}

/* The higher the better: void, valid, sealed */
static uint32_t rank(const uint32_t page[STORE_WORDS])
{
    if (store_check(page) < 0) {
        return 0;
    }
    return store_seals(page) > 0U ? 2U : 1U;
}

int32_t store_newest(const uint32_t first[STORE_WORDS], const uint32_t second[STORE_WORDS])
{
    const uint32_t first_rank = rank(first);
    const uint32_t second_rank = rank(second);
    if (first_rank == 0U && second_rank == 0U) {
        return -1;
    }
    if (first_rank != second_rank) {
        return second_rank > first_rank ? 1 : 0;
    }
    const bool second_newer = (int32_t)(second[WORD_SEQUENCE] - first[WORD_SEQUENCE]) > 0;
    return second_newer == (first_rank == 2U) ? 1 : 0;
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

void store_seal(uint32_t words[2])
{
    words[0] = SEAL;
    words[1] = ~SEAL;
}
