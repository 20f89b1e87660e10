/* CRC-32 of IEEE 802.3: polynomial 04C11DB7h, reflected, as zlib's crc32() of the words in the order of a little-endian
 * memory.
 *
 *   crc = UINT32_MAX, then crc = pm_crc32(crc, word) for each; the checksum is ~crc
 *
 * 45 instructions a word. Tests: tests/unit/math/crc_test.cpp. */
#ifndef PM_MATH_CRC_H
#define PM_MATH_CRC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

uint32_t pm_crc32(uint32_t crc, uint32_t word);

#ifdef __cplusplus
}
#endif

#endif
