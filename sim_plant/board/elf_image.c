#include "sim_plant/board/elf_image.h"

#include <elf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct elf_image {
    uint8_t *data;
    size_t size;
    Elf32_Ehdr header;
    elf_symbol_t *symbol; /* by address */
    size_t symbols;
};

static uint8_t *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return NULL;
    }
    uint8_t *data = NULL;
    if (fseek(file, 0, SEEK_END) == 0) {
        const long length = ftell(file);
        if (length > 0 && fseek(file, 0, SEEK_SET) == 0) {
            data = malloc((size_t)length + 1);
            *size = (size_t)length;
        }
    }
    if (data != NULL && fread(data, 1, *size, file) != *size) {
        free(data);
        data = NULL;
    }
    (void)fclose(file);
    if (data != NULL) {
        data[*size] = 0; /* ends the last string of a file that does not */
    }
    return data;
}

/* The n-th record of a table in the file; false when it is not inside. */
static bool record(const elf_image_t *image, uint64_t offset, uint64_t index, void *out, size_t size)
{
    const uint64_t start = offset + index * size;
    if (start > image->size || image->size - start < size) {
        return false;
    }
    memcpy(out, image->data + start, size);
    return true;
}

static int by_address(const void *a, const void *b)
{
    const elf_symbol_t *x = a, *y = b;
    if (x->address != y->address) {
        return x->address < y->address ? -1 : 1;
    }
    return strcmp(x->name, y->name);
}

static void keep_symbol(elf_image_t *image, const Elf32_Sym *raw, uint64_t names)
{
    const unsigned type = ELF32_ST_TYPE(raw->st_info);
    if (raw->st_shndx == SHN_UNDEF || type == STT_SECTION || type == STT_FILE ||
        names + raw->st_name >= image->size) {
        return;
    }
    const char *name = (const char *)image->data + names + raw->st_name;
    if (name[0] == 0 || name[0] == '$') { /* mapping symbols between code and data */
        return;
    }
    const bool function = type == STT_FUNC;
    image->symbol[image->symbols] =
        (elf_symbol_t){name, function ? raw->st_value & ~1U : raw->st_value, raw->st_size, function};
    image->symbols++;
}

static void read_symbols(elf_image_t *image)
{
    Elf32_Shdr table, strings;
    for (unsigned i = 0; record(image, image->header.e_shoff, i, &table, sizeof table); i++) {
        if (i >= image->header.e_shnum) {
            return;
        }
        if (table.sh_type != SHT_SYMTAB ||
            !record(image, image->header.e_shoff, table.sh_link, &strings, sizeof strings)) {
            continue;
        }
        const size_t most = table.sh_size / sizeof(Elf32_Sym);
        image->symbol = calloc(most + 1, sizeof image->symbol[0]);
        Elf32_Sym raw;
        for (size_t k = 0; image->symbol != NULL && k < most; k++) {
            if (record(image, table.sh_offset, k, &raw, sizeof raw)) {
                keep_symbol(image, &raw, strings.sh_offset);
            }
        }
        if (image->symbol != NULL) {
            qsort(image->symbol, image->symbols, sizeof image->symbol[0], by_address);
        }
        return;
    }
}

elf_image_t *elf_image_open(const char *path, char *error, size_t error_size)
{
    elf_image_t *image = calloc(1, sizeof *image);
    if (image == NULL) {
        return NULL;
    }
    image->data = read_file(path, &image->size);
    if (image->data == NULL) {
        (void)snprintf(error, error_size, "%s: cannot be read", path);
    } else if (!record(image, 0, 0, &image->header, sizeof image->header) ||
               memcmp(image->header.e_ident, ELFMAG, SELFMAG) != 0 ||
               image->header.e_ident[EI_CLASS] != ELFCLASS32 ||
               image->header.e_ident[EI_DATA] != ELFDATA2LSB || image->header.e_machine != EM_ARM ||
               image->header.e_type != ET_EXEC) {
        (void)snprintf(error, error_size, "%s: not a program for an ARM processor", path);
    } else {
        read_symbols(image);
        return image;
    }
    elf_image_close(image);
    return NULL;
}

void elf_image_close(elf_image_t *image)
{
    if (image != NULL) {
        free(image->symbol);
        free(image->data);
        free(image);
    }
}

bool elf_image_load(const elf_image_t *image, void *context, elf_load_t load)
{
    Elf32_Phdr part;
    for (unsigned i = 0; i < image->header.e_phnum; i++) {
        if (!record(image, image->header.e_phoff, i, &part, sizeof part)) {
            return false;
        }
        if (part.p_type != PT_LOAD || part.p_filesz == 0) {
            continue;
        }
        if (part.p_offset > image->size || image->size - part.p_offset < part.p_filesz ||
            !load(context, part.p_paddr, image->data + part.p_offset, part.p_filesz)) {
            return false;
        }
    }
    return true;
}

bool elf_image_find(const elf_image_t *image, const char *name, elf_symbol_t *symbol)
{
    for (size_t i = 0; i < image->symbols; i++) {
        if (strcmp(image->symbol[i].name, name) == 0) {
            *symbol = image->symbol[i];
            return true;
        }
    }
    return false;
}

bool elf_image_function_at(const elf_image_t *image, uint32_t address, elf_symbol_t *symbol)
{
    bool found = false;
    for (size_t i = 0; i < image->symbols && image->symbol[i].address <= address; i++) {
        if (image->symbol[i].function) {
            *symbol = image->symbol[i];
            found = true;
        }
    }
    return found;
}
