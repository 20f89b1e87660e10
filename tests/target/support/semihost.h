/* Semihosting: what a program on an emulated processor asks of the host. Operations and arguments are the
 * same on Arm and RISC-V. */
#ifndef TESTS_TARGET_SUPPORT_SEMIHOST_H
#define TESTS_TARGET_SUPPORT_SEMIHOST_H

#include <stdint.h>

enum {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_SEEK = 0x0A,
    SYS_FLEN = 0x0C,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20,
};

enum { SEMIHOST_WORDS = 16 };

int semihost(uintptr_t operation, const void *arguments);

/* Ends the emulation; status is that of QEMU. */
void semihost_exit(int status) __attribute__((noreturn));

/* Splits the command line at blanks into argv, which has room for one more; the first word is the program's
 * name. Gives their count. */
int semihost_arguments(char *argv[SEMIHOST_WORDS + 1]);

#endif
