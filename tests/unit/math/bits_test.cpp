#include "tests/target/math/same_bits.h"

#include <gtest/gtest.h>

namespace
{

// The target program math_bits expects the same number from the same code.
TEST(MathBits, HostGivesTheRecordedBits)
{
    EXPECT_EQ(same_bits(SAME_BITS_ROUNDS), SAME_BITS_EXPECTED);
}

} // namespace
