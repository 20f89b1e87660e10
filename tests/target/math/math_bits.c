#include <stdio.h>

#include "tests/target/math/same_bits.h"

int main(void)
{
    const uint32_t bits = same_bits(SAME_BITS_ROUNDS);
    printf("target %08lx, host %08lx\n", (unsigned long)bits, (unsigned long)SAME_BITS_EXPECTED);
    return bits == SAME_BITS_EXPECTED ? 0 : 1;
}
