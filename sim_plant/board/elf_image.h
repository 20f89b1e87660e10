/* A program as the linker has left it: what goes where in memory, and the addresses of its symbols. */
#ifndef BOARD_ELF_IMAGE_H
#define BOARD_ELF_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct elf_image elf_image_t;

typedef struct {
    const char *name;
    uint32_t address; /* bit 0 of a function's is cleared */
    uint32_t size;
    bool function;
} elf_symbol_t;

/* NULL and a text when the file is not a 32-bit little-endian ARM program. */
elf_image_t *elf_image_open(const char *path, char *error, size_t error_size);
void elf_image_close(elf_image_t *image);

/* Every part that is to be in memory before reset, at its load address. False as soon as `load` says so. */
typedef bool (*elf_load_t)(void *context, uint32_t address, const uint8_t *data, uint32_t size);
bool elf_image_load(const elf_image_t *image, void *context, elf_load_t load);

bool elf_image_find(const elf_image_t *image, const char *name, elf_symbol_t *symbol);

/* The function that holds the address, or the last one before it. False: there is none. */
bool elf_image_function_at(const elf_image_t *image, uint32_t address, elf_symbol_t *symbol);

#ifdef __cplusplus
}
#endif

#endif
