#include "tests/target/emulator/semihosting.h"

#include <stdio.h>
#include <string.h>

enum {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_SEEK = 0x0A,
    SYS_FLEN = 0x0C,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20,
    EXIT_APPLICATION = 0x20026,
    SEMIHOSTING = 0xAB,
    FILES = 16,
};

static FILE *files[FILES];

static FILE *file_of(uint32_t handle)
{
    return handle >= 1 && handle <= FILES ? files[handle - 1] : NULL;
}

static uint32_t open_file(const char *name, uint32_t mode)
{
    static const char *const modes[] = {"r",  "rb",  "r+", "r+b", "w",  "wb",
                                        "w+", "w+b", "a",  "ab",  "a+", "a+b"};
    FILE *file = NULL;
    if (mode >= sizeof modes / sizeof modes[0]) {
        return UINT32_MAX;
    }
    if (strcmp(name, ":tt") == 0) {
        file = mode < 4 ? stdin : mode < 8 ? stdout : stderr;
    } else {
        file = fopen(name, modes[mode]);
    }
    for (uint32_t i = 0; file != NULL && i < FILES; i++) {
        if (files[i] == NULL) {
            files[i] = file;
            return i + 1;
        }
    }
    return UINT32_MAX;
}

static uint32_t close_file(uint32_t handle)
{
    FILE *file = file_of(handle);
    if (file == NULL) {
        return UINT32_MAX;
    }
    files[handle - 1] = NULL;
    return file == stdin || file == stdout || file == stderr || fclose(file) == 0 ? 0 : UINT32_MAX;
}

static uint32_t length_of(FILE *file)
{
    const long here = ftell(file);
    if (here < 0 || fseek(file, 0, SEEK_END) != 0) {
        return UINT32_MAX;
    }
    const long length = ftell(file);
    return fseek(file, here, SEEK_SET) == 0 ? (uint32_t)length : UINT32_MAX;
}

static uint32_t command_line(semihosting_t *s, const uint32_t arguments[3])
{
    const uint32_t length = (uint32_t)strlen(s->command_line);
    char *place = (char *)cpu_memory(s->cpu, arguments[0], arguments[1]);
    if (place == NULL || length + 1 > arguments[1]) {
        return UINT32_MAX;
    }
    memcpy(place, s->command_line, length + 1);
    return 0;
}

static uint32_t serve(semihosting_t *s, uint32_t operation, const uint32_t a[3])
{
    FILE *file = file_of(a[0]);
    void *data = cpu_memory(s->cpu, a[1], a[2]);
    switch (operation) {
    case SYS_OPEN: {
        const char *name = (const char *)cpu_memory(s->cpu, a[0], a[2] + 1);
        return name == NULL ? UINT32_MAX : open_file(name, a[1]);
    }
    case SYS_CLOSE:
        return close_file(a[0]);
    case SYS_WRITE: /* both return what has not been moved */
        return file == NULL || data == NULL ? a[2] : a[2] - (uint32_t)fwrite(data, 1, a[2], file);
    case SYS_READ:
        return file == NULL || data == NULL ? a[2] : a[2] - (uint32_t)fread(data, 1, a[2], file);
    case SYS_SEEK:
        return file != NULL && fseek(file, (long)a[1], SEEK_SET) == 0 ? 0 : UINT32_MAX;
    case SYS_FLEN:
        return file == NULL ? UINT32_MAX : length_of(file);
    case SYS_GET_CMDLINE:
        return command_line(s, a);
    case SYS_EXIT_EXTENDED:
        s->exited = true;
        s->status = a[0] == EXIT_APPLICATION ? (int)a[1] : 1;
        return 0;
    default:
        cpu_fail(s->cpu, "semihosting operation 0x%x", operation);
        return UINT32_MAX;
    }
}

bool semihosting_call(void *semihosting, uint8_t number)
{
    semihosting_t *s = semihosting;
    uint32_t arguments[3] = {0};
    const uint32_t place = cpu_register(s->cpu, 1);
    for (uint32_t i = 0; i < 3; i++) {
        const uint8_t *word = cpu_memory(s->cpu, place + 4 * i, 4);
        if (word != NULL) {
            memcpy(&arguments[i], word, 4);
        }
    }
    if (number != SEMIHOSTING) {
        cpu_fail(s->cpu, "breakpoint %d", number);
        return false;
    }
    cpu_set_register(s->cpu, 0, serve(s, cpu_register(s->cpu, 0), arguments));
    return !s->exited;
}
