// Length of a classic frame with an 11-bit identifier and that many bytes on the bus, with the three bits
// behind it.
#pragma once

namespace bus_bits
{

// Stuffed at its worst
constexpr int most(int length)
{
    return 47 + 8 * length + (34 + 8 * length - 1) / 4;
}

// Without a stuff bit
constexpr int least(int length)
{
    return 47 + 8 * length;
}

} // namespace bus_bits
