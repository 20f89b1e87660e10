/* Start-up and semihosting system calls for measurement programs on QEMU's Cortex-M boards.
 * main(argc, argv) is called with the arguments given to count.py; its result is QEMU's exit status.
 * printf, fopen and fread work on the host's files through newlib. No interrupts are used. */
#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>

#include "tests/target/support/semihost.h"

extern uint32_t pm_data_load[], pm_data_start[], pm_data_end[], pm_bss_start[], pm_bss_end[], pm_heap_start[],
    pm_heap_end[], pm_stack_top[];

int main(int argc, char **argv);
void pm_reset_handler(void);
void pm_fault_handler(void);
int _open(const char *path, int flags, int mode);
int _close(int file);
int _read(int file, char *data, int size);
int _write(int file, const char *data, int size);
int _lseek(int file, int offset, int whence);
int _fstat(int file, struct stat *status);
int _isatty(int file);
int _kill(int process, int signal);
int _getpid(void);
void *_sbrk(ptrdiff_t step);
void _exit(int status) __attribute__((noreturn));

void _exit(int status)
{
    semihost_exit(status);
}

/* newlib's 0, 1, 2 are the console, which semihosting opens by name: "r" for input, "w" for output. The host
 * counts its own handles from 1, so a file's number is its handle beyond these three. */
#define FIRST_FILE 3

static int host_file(int file)
{
    static int console[3] = {-1, -1, -1};
    if (file >= FIRST_FILE) {
        return file - FIRST_FILE;
    }
    if (console[file] < 0) {
        const uintptr_t arguments[3] = {(uintptr_t) ":tt", file == 0 ? 0u : file == 1 ? 4u : 8u, 3u};
        console[file] = semihost(SYS_OPEN, arguments);
    }
    return console[file];
}

int _open(const char *path, int flags, int mode)
{
    (void)mode;
    const uintptr_t arguments[3] = {(uintptr_t)path, (flags & 3) == 0 ? 1u : 5u, strlen(path)};
    int file = semihost(SYS_OPEN, arguments);
    if (file < 0) {
        errno = ENOENT;
        return -1;
    }
    return file + FIRST_FILE;
}

int _close(int file)
{
    const uintptr_t arguments[1] = {(uintptr_t)host_file(file)};
    return semihost(SYS_CLOSE, arguments);
}

int _read(int file, char *data, int size)
{
    const uintptr_t arguments[3] = {(uintptr_t)host_file(file), (uintptr_t)data, (uintptr_t)size};
    return size - semihost(SYS_READ, arguments);
}

int _write(int file, const char *data, int size)
{
    const uintptr_t arguments[3] = {(uintptr_t)host_file(file), (uintptr_t)data, (uintptr_t)size};
    return size - semihost(SYS_WRITE, arguments);
}

int _lseek(int file, int offset, int whence)
{
    /* Only absolute positions exist in semihosting; relative ones are not needed by sequential readers. */
    const uintptr_t arguments[2] = {(uintptr_t)host_file(file), (uintptr_t)offset};
    if (whence != 0 || semihost(SYS_SEEK, arguments) < 0) {
        errno = ESPIPE;
        return -1;
    }
    return offset;
}

int _fstat(int file, struct stat *status)
{
    memset(status, 0, sizeof *status);
    status->st_mode = file <= 2 ? S_IFCHR : S_IFREG;
    return 0;
}

int _isatty(int file)
{
    return file <= 2;
}

int _kill(int process, int signal)
{
    (void)process;
    (void)signal;
    errno = EINVAL;
    return -1;
}

int _getpid(void)
{
    return 1;
}

void *_sbrk(ptrdiff_t step)
{
    static char *heap = (char *)pm_heap_start;
    char *old = heap;
    if (heap + step > (char *)pm_heap_end) {
        errno = ENOMEM;
        return (void *)-1;
    }
    heap += step;
    return old;
}

void pm_reset_handler(void)
{
    static char *argv[SEMIHOST_WORDS + 1];
    memcpy(pm_data_start, pm_data_load, (size_t)((char *)pm_data_end - (char *)pm_data_start));
    memset(pm_bss_start, 0, (size_t)((char *)pm_bss_end - (char *)pm_bss_start));
    int argc = semihost_arguments(argv);
    extern void exit(int) __attribute__((noreturn));
    exit(main(argc, argv));
}

/* A fault must end the run with an error, not hang it. */
void pm_fault_handler(void)
{
    static const char text[] = "target: processor fault\n";
    (void)_write(2, text, sizeof text - 1);
    _exit(99);
}

__attribute__((section(".vectors"), used)) static const uintptr_t vectors[16] = {
    (uintptr_t)pm_stack_top,     (uintptr_t)pm_reset_handler, (uintptr_t)pm_fault_handler,
    (uintptr_t)pm_fault_handler, (uintptr_t)pm_fault_handler, (uintptr_t)pm_fault_handler,
    (uintptr_t)pm_fault_handler,
};
