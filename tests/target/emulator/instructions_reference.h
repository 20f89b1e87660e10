/* What the instructions do, from the pseudo-code of the ARMv7-M ARM (A7): for instructions.def on the host.
 */
#ifndef EMULATOR_INSTRUCTIONS_REFERENCE_H
#define EMULATOR_INSTRUCTIONS_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

typedef struct {
    uint32_t lo, hi, flags; /* flags as in APSR: NZCVQ and GE */
} result_t;

static inline int64_t wide(uint32_t x)
{
    return (int32_t)x;
}

static inline uint32_t narrow(int64_t x)
{
    return (uint32_t)x;
}

static inline int64_t low(uint32_t x)
{
    return (int16_t)x;
}

static inline int64_t high(uint32_t x)
{
    return (int16_t)(x >> 16);
}

static inline uint32_t half(uint32_t x)
{
    return (uint32_t)(int32_t)(int16_t)x;
}

static inline uint32_t byte(uint32_t x)
{
    return (uint32_t)(int32_t)(int8_t)x;
}

static inline uint32_t pack(uint32_t bottom, uint32_t upper)
{
    return (bottom & 0xFFFFU) | upper << 16;
}

static inline uint64_t pair(uint32_t bottom, uint32_t upper)
{
    return (uint64_t)upper << 32 | bottom;
}

static inline uint32_t top(uint64_t x)
{
    return (uint32_t)(x >> 32);
}

static inline void put(result_t *r, uint64_t x)
{
    r->lo = (uint32_t)x;
    r->hi = top(x);
}

static inline uint32_t asr(uint32_t x, unsigned n)
{
    return (uint32_t)((int32_t)x >> n);
}

static inline uint32_t ror(uint32_t x, unsigned n)
{
    return n == 0 ? x : x >> n | x << (32 - n);
}

/* Flags */
static inline uint32_t carry(const result_t *r)
{
    return r->flags >> 29 & 1;
}

static inline uint32_t nz(result_t *r, uint32_t value)
{
    r->flags = (r->flags & 0x3FFFFFFFU) | (value & 0x80000000U) | (value == 0 ? 0x40000000U : 0);
    return value;
}

static inline uint32_t nzc(result_t *r, uint32_t value, uint32_t new_carry)
{
    r->flags = (r->flags & ~0x20000000U) | new_carry << 29;
    return nz(r, value);
}

static inline uint32_t add(result_t *r, uint32_t x, uint32_t y, uint32_t carry_in)
{
    const uint64_t sum = (uint64_t)x + y + carry_in;
    const int64_t exact = wide(x) + wide(y) + carry_in;
    const uint32_t value = (uint32_t)sum;
    const bool overflow = exact != wide(value);
    r->flags = (r->flags & ~0x10000000U) | (overflow ? 0x10000000U : 0);
    return nzc(r, value, (uint32_t)(sum >> 32));
}

static inline void sticky(result_t *r)
{
    r->flags |= 0x08000000U;
}

/* Shifts by a register */
static inline uint32_t shift_left(result_t *r, uint32_t x, uint32_t n)
{
    if (n == 0) {
        return nz(r, x);
    }
    return nzc(r, n < 32 ? x << n : 0, n <= 32 ? x >> (32 - n) & 1 : 0);
}

static inline uint32_t shift_right(result_t *r, uint32_t x, uint32_t n, uint32_t fill)
{
    if (n == 0) {
        return nz(r, x);
    }
    const uint64_t filled = (uint64_t)fill << 32 | x;
    return nzc(r, n < 32 ? (uint32_t)(filled >> n) : fill, n <= 32 ? x >> (n - 1) & 1 : fill & 1);
}

static inline uint32_t rotate(result_t *r, uint32_t x, uint32_t n)
{
    if (n == 0) {
        return nz(r, x);
    }
    const uint32_t value = ror(x, n % 32);
    return nzc(r, value, value >> 31);
}

/* Bits */
static inline uint32_t leading_zeros(uint32_t x)
{
    uint32_t n = 0;
    while (n < 32 && (x >> (31 - n) & 1) == 0) {
        n++;
    }
    return n;
}

static inline uint32_t reversed(uint32_t x)
{
    uint32_t value = 0;
    for (unsigned i = 0; i < 32; i++) {
        value |= (x >> i & 1) << (31 - i);
    }
    return value;
}

static inline uint32_t select_bytes(const result_t *r, uint32_t x, uint32_t y)
{
    uint32_t value = 0;
    for (unsigned i = 0; i < 4; i++) {
        value |= ((r->flags >> (16 + i) & 1) != 0 ? x : y) & 0xFFU << (8 * i);
    }
    return value;
}

static inline uint32_t differences(uint32_t x, uint32_t y)
{
    uint32_t sum = 0;
    for (unsigned i = 0; i < 4; i++) {
        const uint32_t p = x >> (8 * i) & 0xFFU, q = y >> (8 * i) & 0xFFU;
        sum += p > q ? p - q : q - p;
    }
    return sum;
}

/* Saturation */
static inline int64_t clamp(int64_t x, int64_t least, int64_t most)
{
    return x < least ? least : x > most ? most : x;
}

static inline uint32_t saturate(result_t *r, int64_t x, unsigned bits)
{
    const int64_t value = clamp(x, -(INT64_C(1) << (bits - 1)), (INT64_C(1) << (bits - 1)) - 1);
    if (value != x) {
        sticky(r);
    }
    return (uint32_t)value;
}

static inline uint32_t saturate_unsigned(result_t *r, int64_t x, unsigned bits)
{
    const int64_t value = clamp(x, 0, (INT64_C(1) << bits) - 1);
    if (value != x) {
        sticky(r);
    }
    return (uint32_t)value;
}

/* A sum that wraps and says so */
static inline uint32_t accumulate(result_t *r, int64_t x)
{
    if (x != wide((uint32_t)x)) {
        sticky(r);
    }
    return (uint32_t)x;
}

static inline uint32_t divided(uint32_t x, uint32_t y)
{
    return y == 0 ? 0 : (uint32_t)(wide(x) / wide(y));
}

/* Lanes side by side: GE says, for s and u, where the result was not negative or carried. */
typedef enum { KIND_s, KIND_q, KIND_sh, KIND_u, KIND_uq, KIND_uh } parallel_kind_t;
typedef enum { ADD, SUB, ASX, SAX } parallel_operation_t;

static inline uint32_t lane(result_t *r, parallel_kind_t kind, bool minus, int64_t x, int64_t y,
                            unsigned bits, unsigned first)
{
    const int64_t value = minus ? x - y : x + y;
    const uint32_t mask = (1U << bits) - 1;
    const uint32_t flags = (bits == 16 ? 3U : 1U) << (16 + first);
    bool ge = value >= 0;
    switch (kind) {
    case KIND_q:
        return (uint32_t)clamp(value, -(INT64_C(1) << (bits - 1)), (INT64_C(1) << (bits - 1)) - 1) & mask;
    case KIND_uq:
        return (uint32_t)clamp(value, 0, mask);
    case KIND_sh:
    case KIND_uh:
        return (uint32_t)(value >> 1) & mask;
    case KIND_u:
        ge = minus ? value >= 0 : value > (int64_t)mask;
        break;
    default:
        break;
    }
    r->flags = (r->flags & ~flags) | (ge ? flags : 0);
    return (uint32_t)value & mask;
}

static inline int64_t lane_of(parallel_kind_t kind, uint32_t x, unsigned shift, unsigned bits)
{
    const uint32_t raw = x >> shift & ((1U << bits) - 1);
    const bool negative = kind < KIND_u && raw >> (bits - 1) != 0;
    return negative ? (int64_t)raw - (INT64_C(1) << bits) : (int64_t)raw;
}

static inline uint32_t halves(result_t *r, parallel_kind_t kind, parallel_operation_t operation, uint32_t x,
                              uint32_t y)
{
    const bool crossed = operation == ASX || operation == SAX;
    const int64_t bottom = lane_of(kind, y, crossed ? 16 : 0, 16),
                  upper = lane_of(kind, y, crossed ? 0 : 16, 16);
    const bool minus_bottom = operation == SUB || operation == ASX,
               minus_upper = operation == SUB || operation == SAX;
    return lane(r, kind, minus_bottom, lane_of(kind, x, 0, 16), bottom, 16, 0) |
           lane(r, kind, minus_upper, lane_of(kind, x, 16, 16), upper, 16, 2) << 16;
}

static inline uint32_t bytes(result_t *r, parallel_kind_t kind, parallel_operation_t operation, uint32_t x,
                             uint32_t y)
{
    uint32_t value = 0;
    for (unsigned i = 0; i < 4; i++) {
        value |= lane(r, kind, operation == SUB, lane_of(kind, x, 8 * i, 8), lane_of(kind, y, 8 * i, 8), 8, i)
                 << (8 * i);
    }
    return value;
}

/* Memory, little-endian */
static inline uint32_t load(const uint32_t *memory, uint32_t offset, uint32_t size)
{
    uint32_t value = 0;
    memcpy(&value, (const uint8_t *)memory + offset, size);
    return value;
}

static inline void store(uint32_t *memory, uint32_t offset, uint32_t size, uint32_t value)
{
    memcpy((uint8_t *)memory + offset, &value, size);
}

/* Conditions after a comparison */
static inline bool flag(const result_t *r, unsigned bit)
{
    return (r->flags >> bit & 1) != 0;
}

#define CONDITION_OF(name, expression)                                                                       \
    static inline bool condition_##name(const result_t *r)                                                   \
    {                                                                                                        \
        const bool n = flag(r, 31), z = flag(r, 30), c = flag(r, 29), v = flag(r, 28);                       \
        (void)n, (void)z, (void)c, (void)v;                                                                  \
        return expression;                                                                                   \
    }
CONDITION_OF(eq, z)
CONDITION_OF(ne, !z)
CONDITION_OF(hs, c)
CONDITION_OF(lo, !c)
CONDITION_OF(mi, n)
CONDITION_OF(pl, !n)
CONDITION_OF(vs, v)
CONDITION_OF(vc, !v)
CONDITION_OF(hi, c && !z)
CONDITION_OF(ls, !c || z)
CONDITION_OF(ge, n == v)
CONDITION_OF(lt, n != v)
CONDITION_OF(gt, !z && n == v)
CONDITION_OF(le, z || n != v)
#undef CONDITION_OF

#endif
