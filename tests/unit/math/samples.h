// Values to try: the corners of 32 bits and a repeatable random sequence.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "firmware/math/fixed.h"

namespace samples
{

inline std::vector<int32_t> corners()
{
    std::vector<int32_t> values = {0};
    for (int bit = 0; bit < 31; ++bit) {
        for (const int32_t near : {-1, 0, 1}) {
            const auto x = static_cast<int32_t>((int64_t{1} << bit) + near);
            values.push_back(x);
            values.push_back(-x);
        }
    }
    for (const int32_t x : {INT32_MAX, INT32_MAX - 1, INT32_MIN, INT32_MIN + 1}) {
        values.push_back(x);
    }
    return values;
}

class Random
{
  public:
    int32_t word()
    {
        return static_cast<int32_t>(static_cast<uint32_t>(engine_() >> 32));
    }
    // Every magnitude equally often.
    int32_t any_size()
    {
        return word() >> (engine_() % 31);
    }
    // Standard distributions differ between libraries; this does not.
    double within(double lo, double hi)
    {
        return lo + (hi - lo) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }

  private:
    std::mt19937_64 engine_{20240611};
};

inline double real(pm_q_t x)
{
    return x * 0x1p-28;
}

inline pm_q_t q(double x)
{
    return static_cast<pm_q_t>(x * 0x1p28 + (x < 0 ? -0.5 : 0.5));
}

} // namespace samples
