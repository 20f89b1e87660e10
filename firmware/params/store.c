#include "firmware/params/store.h"

#define MAGIC      0x31504D50U /* "PMP1" */
#define HEADER     4U
#define FNV_OFFSET 2166136261U
#define FNV_PRIME  16777619U
#define CRC_POLY   0xEDB88320U /* CRC-32 of IEEE 802.3, reflected */

enum { WORD_MAGIC, WORD_SEQUENCE, WORD_COUNT, WORD_CRC };

uint32_t store_id(const char *name)
{
    uint32_t hash = FNV_OFFSET;
    for (const char *c = name; *c != '\0'; c++) {
        hash = (hash ^ (uint8_t)*c) * FNV_PRIME;
    }
    return hash;
}

static uint32_t crc_word(uint32_t crc, uint32_t word)
{
    uint32_t rest = crc ^ word;
    for (uint32_t bit = 0; bit < 32U; bit++) {
        rest = (rest >> 1) ^ ((rest & 1U) != 0U ? CRC_POLY : 0U);
    }
    return rest;
}

/* Over sequence, count and pairs */
static uint32_t crc_of(const uint32_t page[STORE_WORDS], uint32_t count)
{
    uint32_t crc = crc_word(crc_word(UINT32_MAX, page[WORD_SEQUENCE]), count);
    for (uint32_t n = 0; n < 2U * count; n++) {
        crc = crc_word(crc, page[HEADER + n]);
    }
    return ~crc;
}

int32_t store_check(const uint32_t page[STORE_WORDS])
{
    const uint32_t count = page[WORD_COUNT];
    const bool valid =
        page[WORD_MAGIC] == MAGIC && count <= STORE_PAIRS_MAX && page[WORD_CRC] == crc_of(page, count);
    return valid ? (int32_t)count : -1;
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

store_pair_t store_pair(const uint32_t page[STORE_WORDS], uint32_t index)
{
    return (store_pair_t){.id = page[HEADER + 2U * index], .value = (int32_t)page[HEADER + 2U * index + 1U]};
}

uint32_t store_make(uint32_t page[STORE_WORDS], uint32_t sequence, const store_pair_t pairs[], uint32_t count)
{
    if (count > STORE_PAIRS_MAX) {
        return 0;
    }
    for (uint32_t n = 0; n < count; n++) {
        page[HEADER + 2U * n] = pairs[n].id;
        page[HEADER + 2U * n + 1U] = (uint32_t)pairs[n].value;
    }
    page[WORD_MAGIC] = MAGIC;
    page[WORD_SEQUENCE] = sequence;
    page[WORD_COUNT] = count;
    page[WORD_CRC] = crc_of(page, count);
    return HEADER + 2U * count;
}
