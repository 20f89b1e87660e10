/* What the compiler calls to copy and to clear; nothing else of the C library is in the image. */
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memset(void *to, int value, size_t size);

static int aligned(const void *a, const void *b, size_t size)
{
    return (((uintptr_t)a | (uintptr_t)b | size) & 3U) == 0U;
}

void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    if (aligned(to, from, size)) {
        uint32_t *restrict t = to;
        const uint32_t *restrict f = from;
        for (size_t n = size / 4U; n > 0U; --n) {
            *t++ = *f++;
        }
    } else {
        uint8_t *restrict t = to;
        const uint8_t *restrict f = from;
        for (size_t n = size; n > 0U; --n) {
            *t++ = *f++;
        }
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    const uint32_t byte = (uint8_t)value;
    if (aligned(to, NULL, size)) {
        uint32_t *t = to;
        for (size_t n = size / 4U; n > 0U; --n) {
            *t++ = byte * 0x01010101U;
        }
    } else {
        uint8_t *t = to;
        for (size_t n = size; n > 0U; --n) {
            *t++ = (uint8_t)byte;
        }
    }
    return to;
}
