#include "tests/target/support/semihost.h"

#include <stddef.h>
#include <string.h>

enum { EXIT_APPLICATION = 0x20026 };

#if defined(__riscv)
/* The host knows the request by these three instructions together, none of them compressed, in one page. */
__asm(".section .text.semihost\n"
      ".balign 16\n"
      ".global semihost\n"
      ".type semihost, %function\n"
      "semihost:\n"
      ".option push\n"
      ".option norvc\n"
      " slli zero, zero, 0x1f\n"
      " ebreak\n"
      " srai zero, zero, 7\n"
      " ret\n"
      ".option pop\n"
      ".size semihost, . - semihost\n"
      ".text\n");
#else
int semihost(uintptr_t operation, const void *arguments)
{
    register uintptr_t r0 __asm("r0") = operation;
    register const void *r1 __asm("r1") = arguments;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return (int)r0;
}
#endif

void semihost_exit(int status)
{
    const uintptr_t arguments[2] = {EXIT_APPLICATION, (uintptr_t)status};
    (void)semihost(SYS_EXIT_EXTENDED, arguments);
    for (;;) {
    }
}

int semihost_arguments(char *argv[SEMIHOST_WORDS + 1])
{
    static char line[1024];
    const uintptr_t arguments[2] = {(uintptr_t)line, sizeof line};
    int argc = 0;
    if (semihost(SYS_GET_CMDLINE, arguments) != 0) {
        return 0;
    }
    for (char *word = strtok(line, " "); word != NULL && argc < SEMIHOST_WORDS; word = strtok(NULL, " ")) {
        argv[argc] = word;
        argc++;
    }
    return argc;
}
