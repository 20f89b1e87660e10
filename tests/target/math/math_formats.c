/* Runs the kernel of every number format, for count.py: see docs/decisions/001-signal-format.md. */
#include <stddef.h>

#include "tests/target/math/formats.h"

/* The FPU is off after reset. */
static void enable_fpu(void)
{
    *(volatile uint32_t *)0xE000ED88U |= 0xFU << 20;
    __asm volatile("dsb\n isb" ::: "memory");
}

int main(void)
{
    static const format_t *const formats[] = {&format_q28, &format_q31, &format_q24, &format_q15,
                                              &format_float};
    enable_fpu();
    for (size_t n = 0; n < sizeof formats / sizeof *formats; ++n) {
        format_signal_t signal = {0};
        formats[n]->reset(true);
        for (int k = 0; k < 400; ++k) {
            const format_in_t in = format_signal_next(&signal, k < 200 ? 1.0 : -0.3);
            (void)formats[n]->step(&in);
        }
    }
    return 0;
}
