/* Copy and clear functions that the compiler calls; nothing else of the C library is in the image. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *first, const void *second, size_t size);

static bool by_words(uintptr_t a, uintptr_t b, size_t size)
{
    return ((a | b | size) & 3U) == 0U;
}

void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    if (by_words((uintptr_t)to, (uintptr_t)from, size)) {
        uint32_t *restrict t = to;
        const uint32_t *restrict f = from;
        for (size_t n = 0; n < size / 4U; ++n) {
            t[n] = f[n];
        }
    } else {
        uint8_t *restrict t = to;
        const uint8_t *restrict f = from;
        for (size_t n = 0; n < size; ++n) {
            t[n] = f[n];
        }
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    const uint32_t byte = (uint8_t)value;
    if (by_words((uintptr_t)to, 0U, size)) {
        const uint32_t word = byte * 0x01010101U;
        uint32_t *t = to;
        const uint32_t *const end = &t[size / 4U];
        if ((size & 4U) != 0U) {
            t[0] = word;
            t = &t[1];
        }
        while (t != end) { /* by two: some kilobytes within a control period */
            t[0] = word;
            t[1] = word;
            t = &t[2];
        }
    } else {
        uint8_t *t = to;
        for (size_t n = 0; n < size; ++n) {
            t[n] = (uint8_t)byte;
        }
    }
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    uint8_t *t = to;
    const uint8_t *f = from;
    if ((uintptr_t)to < (uintptr_t)from) {
        for (size_t n = 0; n < size; ++n) {
            t[n] = f[n];
        }
    } else {
        for (size_t n = size; n > 0U; --n) {
            t[n - 1U] = f[n - 1U];
        }
    }
    return to;
}

int memcmp(const void *first, const void *second, size_t size)
{
    const uint8_t *a = first;
    const uint8_t *b = second;
    for (size_t n = 0; n < size; ++n) {
        if (a[n] != b[n]) {
            return (int)a[n] - (int)b[n];
        }
    }
    return 0;
}
