// CRC-32 of IEEE 802.3: its check value, and the definition bit by bit.
#include "firmware/math/crc.h"

#include <gtest/gtest.h>

#include "tests/unit/math/samples.h"

namespace
{

uint32_t by_bits(uint32_t crc, uint32_t word)
{
    for (int bit = 0; bit < 32; ++bit) {
        const bool out = ((crc ^ word >> bit) & 1) != 0;
        crc = crc >> 1 ^ (out ? 0xEDB88320 : 0);
    }
    return crc;
}

// Of eight bytes "12345678", as zlib and all others have it.
TEST(MathCrc, CheckValue)
{
    const uint32_t crc = pm_crc32(pm_crc32(UINT32_MAX, 0x34333231), 0x38373635);
    EXPECT_EQ(~crc, 0x9AE0DAAF);
}

TEST(MathCrc, AnyWordAfterAnyOther)
{
    samples::Random random;
    for (int n = 0; n < 100000; ++n) {
        const auto crc = uint32_t(random.word()), word = uint32_t(random.word());
        ASSERT_EQ(pm_crc32(crc, word), by_bits(crc, word)) << crc << ' ' << word;
    }
}

} // namespace
