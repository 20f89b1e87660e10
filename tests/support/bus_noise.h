// What other nodes may send, right or wrong: frames of any kind that are no command to node 1.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include "hal/can_frame.h"

namespace bus_noise
{

constexpr uint16_t sdo = 0x601;

// NMT, the controlwords and targets of RPDOs, LSS, and the heartbeat of the master that is watched
inline bool commands(const hal_can_frame_t &f)
{
    const unsigned kind = f.data[0] >> 5;
    const bool writes = kind == 0 || kind == 1 || kind == 6; // of an SDO: download, its segments, by block
    return (f.id == 0x000 && f.length == 2) || (f.id == 0x201 && f.length >= 7) || f.id == 0x7E5 ||
           f.id == 0x77F || (f.id == sdo && f.length == 8 && writes);
}

class Source
{
  public:
    explicit Source(unsigned seed) : random_(seed)
    {
    }

    // Half of them with the identifiers that the node listens to or sends with
    hal_can_frame_t garbage()
    {
        static const uint16_t ours[] = {0x000, 0x080, 0x081, 0x181, 0x201, 0x301, sdo, 0x581};
        hal_can_frame_t f = {};
        do {
            const auto word = static_cast<uint32_t>(random_());
            f.id = static_cast<uint16_t>(word % 2 == 0 ? ours[word / 2 % std::size(ours)] : word / 2 % 0x800);
            f.length = static_cast<uint8_t>(random_() % 9);
            for (uint8_t &byte : f.data) {
                byte = static_cast<uint8_t>(random_());
            }
        } while (commands(f));
        return f;
    }

  private:
    std::mt19937 random_;
};

// Bits of the longest frame of that many bytes, stuffed at its worst, with the three behind it
constexpr int most_bits(int length)
{
    return 47 + 8 * length + (34 + 8 * length - 1) / 4;
}

// Bits of the shortest
constexpr int least_bits(int length)
{
    return 47 + 8 * length;
}

} // namespace bus_noise
