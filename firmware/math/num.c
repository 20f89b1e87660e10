#include "firmware/math/num.h"

enum { MANTISSA_BITS = 31, LONGEST_EXPONENT10 = 12 };

/* magnitude 2^e with the sign, to 31 bits, rounded to nearest. */
static pm_num_word_t make(bool negative, uint64_t magnitude, int32_t e)
{
    if (magnitude == 0U) {
        return 0;
    }
    const int spare = __builtin_clzll(magnitude);
    uint64_t m = magnitude << spare; /* 2^63 ... 2^64 */
    const int drop = 64 - MANTISSA_BITS;
    m = (m >> drop) + ((m >> (drop - 1)) & 1U);
    e += drop - spare;
    if (m >> MANTISSA_BITS != 0U) { /* rounded up to a power of two */
        m >>= 1;
        e += 1;
    }
    return pm_num_word((pm_num_t){.m = negative ? -(int32_t)m : (int32_t)m, .e = e});
}

static uint64_t magnitude(int32_t x)
{
    return (uint64_t)(x < 0 ? -(int64_t)x : (int64_t)x);
}

/* One digit of 16 bits: (rest 2^16 + next) / den, with rest < den and the top bit of den set. The upper half of
 * den gives a digit that is at most two too large. */
static uint32_t digit(uint32_t *rest, uint32_t next, uint32_t den)
{
    uint32_t q = *rest / (den >> 16);
    int64_t left = (int64_t)((uint64_t)*rest << 16 | next) - (int64_t)((uint64_t)q * den);
    while (left < 0) {
        q--;
        left += den;
    }
    *rest = (uint32_t)left;
    return q;
}

/* The upper half in one division, the lower half by two digits; 0 < den <= 2^31. */
static uint64_t quotient(uint64_t num, uint32_t den)
{
    const uint32_t top = (uint32_t)(num >> 32);
    const int spare = __builtin_clz(den);
    const uint64_t left = ((uint64_t)(top % den) << 32 | (uint32_t)num) << spare;
    uint32_t rest = (uint32_t)(left >> 32);
    const uint32_t high = digit(&rest, (uint32_t)(left >> 16) & 0xFFFFU, den << spare);
    const uint32_t low = digit(&rest, (uint32_t)left & 0xFFFFU, den << spare);
    return ((uint64_t)(top / den) << 32) + ((uint64_t)high << 16) + low;
}

int64_t pm_quotient(int64_t num, int32_t den)
{
    if (den == 0) {
        return 0;
    }
    const uint64_t size = quotient(num < 0 ? 0U - (uint64_t)num : (uint64_t)num, (uint32_t)magnitude(den));
    return (int64_t)((num < 0) == (den < 0) ? size : 0U - size);
}

pm_num_word_t pm_num_word_int(int32_t value)
{
    return make(value < 0, magnitude(value), 0);
}

/* 10^n = 5^n 2^n, and 5^12 is still exact in a mantissa, so there is one rounding only. */
pm_num_word_t pm_num_word_dec(int32_t value, int exponent10)
{
    const int n = exponent10 < 0 ? -exponent10 : exponent10;
    if (n > LONGEST_EXPONENT10) {
        return 0;
    }
    int32_t power = 1;
    for (int i = 0; i < n; ++i) {
        power *= 5;
    }
    pm_num_t scale = pm_num(power);
    scale.e += n;
    return pm_num_word(exponent10 < 0 ? pm_num_div(pm_num(value), scale) : pm_num_mul(pm_num(value), scale));
}

pm_num_word_t pm_num_word_ratio(int32_t num, int32_t den)
{
    return pm_num_word(pm_num_div(pm_num(num), pm_num(den)));
}

pm_num_word_t pm_num_word_add(pm_num_word_t a_word, pm_num_word_t b_word)
{
    const pm_num_t a = pm_num_of(a_word);
    const pm_num_t b = pm_num_of(b_word);
    if (a.m == 0 || b.m == 0) {
        return a.m == 0 ? b_word : a_word;
    }
    const pm_num_t large = a.e >= b.e ? a : b;
    const pm_num_t small = a.e >= b.e ? b : a;
    const int32_t apart = large.e - small.e;
    if (apart > MANTISSA_BITS) { /* less than half a unit of the last place, which rounding may ignore */
        return a.e >= b.e ? a_word : b_word;
    }
    const int64_t sum = (int64_t)large.m * (INT64_C(1) << apart) + small.m;
    return make(sum < 0, (uint64_t)(sum < 0 ? -sum : sum), small.e);
}

pm_num_word_t pm_num_word_sub(pm_num_word_t a_word, pm_num_word_t b_word)
{
    const pm_num_t a = pm_num_of(a_word);
    const pm_num_t b = pm_num_of(b_word);
    return pm_num_word(pm_num_add(a, pm_num_neg(b)));
}

pm_num_word_t pm_num_word_mul(pm_num_word_t a_word, pm_num_word_t b_word)
{
    const pm_num_t a = pm_num_of(a_word);
    const pm_num_t b = pm_num_of(b_word);
    return make((a.m < 0) != (b.m < 0), magnitude(a.m) * magnitude(b.m), a.e + b.e);
}

pm_num_word_t pm_num_word_div(pm_num_word_t a_word, pm_num_word_t b_word)
{
    const pm_num_t a = pm_num_of(a_word);
    const pm_num_t b = pm_num_of(b_word);
    if (a.m == 0 || b.m == 0) {
        return 0;
    }
    /* 33 or 34 bits of quotient: cutting it costs an eighth of a unit in the last place of 31. */
    return make((a.m < 0) != (b.m < 0), quotient(magnitude(a.m) << 33, (uint32_t)magnitude(b.m)),
                a.e - b.e - 33);
}

pm_num_word_t pm_num_word_sqrt(pm_num_word_t a_word)
{
    const pm_num_t a = pm_num_of(a_word);
    if (a.m <= 0) {
        return 0;
    }
    /* An even exponent and 64 bits under the root leave 32 bits of result, found from the top. */
    const int32_t odd = a.e & 1;
    uint64_t rest = magnitude(a.m) << (32 + odd);
    uint64_t root = 0U;
    for (uint64_t bit = UINT64_C(1) << 62; bit != 0U; bit >>= 2) {
        if (rest >= root + bit) {
            rest -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
    }
    return make(false, root, (a.e - odd) / 2 - 16);
}

int pm_num_word_cmp(pm_num_word_t a, pm_num_word_t b)
{
    const int32_t sign = pm_num_sub(pm_num_of(a), pm_num_of(b)).m;
    return (sign > 0) - (sign < 0);
}

bool pm_num_word_to_fixed(pm_num_word_t word, int frac_bits, int32_t *out)
{
    const pm_num_t a = pm_num_of(word);
    const int32_t shift = a.e + frac_bits;
    *out = 0;
    if (a.m == 0 || shift < -MANTISSA_BITS - 1) {
        return true;
    }
    const int64_t limit = a.m < 0 ? INT64_C(0x80000000) : INT64_C(0x7FFFFFFF);
    int64_t value = (int64_t)magnitude(a.m);
    if (shift > 1) {
        value = limit + 1; /* a mantissa has its top bit set: it cannot fit */
    } else if (shift >= 0) {
        value <<= shift;
    } else {
        value = (value + (INT64_C(1) << (-shift - 1))) >> -shift;
    }
    const bool fits = value <= limit;
    value = fits ? value : limit;
    *out = (int32_t)(a.m < 0 ? -value : value);
    return fits;
}

pm_num_word_t pm_num_word_from_fixed(int32_t x, int frac_bits)
{
    pm_num_t r = pm_num(x);
    r.e -= r.m == 0 ? 0 : frac_bits;
    return pm_num_word(r);
}

int32_t pm_num_word_times(pm_num_word_t word, int32_t value, int frac_bits)
{
    const pm_num_t unit = pm_num_of(word);
    const int64_t product = (int64_t)value * unit.m;
    const int32_t shift = -unit.e - frac_bits;
    int64_t x = 0;
    if (shift < 1) { /* a mantissa has its top bit set: twice that fits for zero only */
        x = shift < 0 ? 2 * product : product;
    } else if (shift <= 2 * MANTISSA_BITS) {
        x = ((product >> (shift - 1)) + 1) >> 1;
    } else {
        /* less than half */
    }
    if (x != (int32_t)x) {
        return x < 0 ? INT32_MIN : INT32_MAX;
    }
    return (int32_t)x;
}
