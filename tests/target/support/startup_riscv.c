/* Start-up for measurement programs on QEMU's RISC-V machine `virt`; files and printf are those of picolibc's
 * semihosting library. The linker script is picolibc's too. No interrupts are used. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "tests/target/support/semihost.h"

extern char __data_start[], __data_source[], __data_size[], __bss_start[], __bss_size[];

int main(int argc, char **argv);
void pm_start(void) __attribute__((noreturn, used));
void pm_trap(void) __attribute__((used));
void _exit(int status) __attribute__((noreturn));

/* The machine begins at the start of its memory. Relaxed, `la gp` would be relative to gp itself. The
 * instruction in numbers is `csrw mtvec, t0`, which some assemblers have only under another name of the same
 * processor. */
__asm(".section .text.init.enter, \"ax\"\n"
      ".global _start\n"
      ".type _start, %function\n"
      "_start:\n"
      ".option push\n"
      ".option norelax\n"
      " la gp, __global_pointer$\n"
      " la t0, pm_trap_entry\n"
      " .insn i 0x73, 1, zero, t0, 0x305\n"
      ".option pop\n"
      " la sp, __stack\n"
      " la tp, __tls_base\n"
      " j pm_start\n"
      ".balign 4\n"
      "pm_trap_entry:\n"
      " la sp, __stack\n"
      " j pm_trap\n"
      ".text\n");

void _exit(int status)
{
    semihost_exit(status);
}

void pm_start(void)
{
    static char *argv[SEMIHOST_WORDS + 1];
    memcpy(__data_start, __data_source, (size_t)(uintptr_t)__data_size);
    memset(__bss_start, 0, (size_t)(uintptr_t)__bss_size);
    int argc = semihost_arguments(argv);
    exit(main(argc, argv));
}

/* A fault must end the run with an error, not hang it. */
void pm_trap(void)
{
    static const char text[] = "target: processor fault\n";
    const uintptr_t open[3] = {(uintptr_t) ":tt", 8U, 3U};
    const uintptr_t write[3] = {(uintptr_t)semihost(SYS_OPEN, open), (uintptr_t)text, sizeof text - 1U};
    (void)semihost(SYS_WRITE, write);
    _exit(99);
}
