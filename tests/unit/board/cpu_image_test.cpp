#include "sim_plant/board/elf_image.h"

#include <elf.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/temporary_file.h"

namespace
{

/* A program of one segment that runs at 0x20000000 and lies at 0x08000100, with two symbols. */
struct File {
    std::vector<uint8_t> bytes;
    Elf32_Ehdr header{};
    Elf32_Phdr part{};

    File()
    {
        const char names[] = "\0main\0speed";
        Elf32_Sym symbols[3] = {};
        symbols[1] = {1, 0x08000101, 8, ELF32_ST_INFO(STB_GLOBAL, STT_FUNC), 0, 1};
        symbols[2] = {6, 0x20000004, 4, ELF32_ST_INFO(STB_GLOBAL, STT_OBJECT), 0, 1};
        Elf32_Shdr sections[3] = {};
        const uint32_t data_at = sizeof header + sizeof part;
        sections[1].sh_type = SHT_SYMTAB;
        sections[1].sh_offset = data_at + 8;
        sections[1].sh_size = sizeof symbols;
        sections[1].sh_link = 2;
        sections[2].sh_type = SHT_STRTAB;
        sections[2].sh_offset = data_at + 8 + sizeof symbols;
        sections[2].sh_size = sizeof names;
        std::memcpy(header.e_ident, ELFMAG, SELFMAG);
        header.e_ident[EI_CLASS] = ELFCLASS32;
        header.e_ident[EI_DATA] = ELFDATA2LSB;
        header.e_machine = EM_ARM;
        header.e_type = ET_EXEC;
        header.e_phoff = sizeof header;
        header.e_phnum = 1;
        header.e_shoff = sections[2].sh_offset + sizeof names;
        header.e_shnum = 3;
        part.p_type = PT_LOAD;
        part.p_offset = data_at;
        part.p_vaddr = 0x20000000;
        part.p_paddr = 0x08000100;
        part.p_filesz = 8;
        append(&header, sizeof header);
        append(&part, sizeof part);
        append("12345678", 8);
        append(symbols, sizeof symbols);
        append(names, sizeof names);
        append(sections, sizeof sections);
    }

    void append(const void *data, size_t size)
    {
        const auto *first = static_cast<const uint8_t *>(data);
        bytes.insert(bytes.end(), first, first + size);
    }

    elf_image_t *open(std::string *error = nullptr)
    {
        const tests::TemporaryFile place("image.elf");
        const std::string path = place.path();
        FILE *file = std::fopen(path.c_str(), "wb");
        EXPECT_EQ(std::fwrite(bytes.data(), 1, bytes.size(), file), bytes.size());
        std::fclose(file);
        char text[256] = "";
        elf_image_t *image = elf_image_open(path.c_str(), text, sizeof text);
        if (error != nullptr) {
            *error = text;
        }
        return image;
    }
};

struct Loaded {
    uint32_t address = 0;
    std::string data;
};

bool load(void *context, uint32_t address, const uint8_t *data, uint32_t size)
{
    auto *loaded = static_cast<Loaded *>(context);
    loaded->address = address;
    loaded->data.assign(data, data + size);
    return true;
}

TEST(CpuImage, LoadsWhereItLiesNotWhereItRuns)
{
    elf_image_t *image = File().open();
    ASSERT_NE(image, nullptr);
    Loaded loaded;
    EXPECT_TRUE(elf_image_load(image, &loaded, load));
    EXPECT_EQ(loaded.address, 0x08000100U);
    EXPECT_EQ(loaded.data, "12345678");
    elf_image_close(image);
}

TEST(CpuImage, FindsSymbols)
{
    elf_image_t *image = File().open();
    ASSERT_NE(image, nullptr);
    elf_symbol_t symbol;
    ASSERT_TRUE(elf_image_find(image, "speed", &symbol));
    EXPECT_EQ(symbol.address, 0x20000004U);
    EXPECT_EQ(symbol.size, 4U);
    ASSERT_TRUE(elf_image_find(image, "main", &symbol));
    EXPECT_EQ(symbol.address, 0x08000100U);
    EXPECT_FALSE(elf_image_find(image, "spee", &symbol));
    ASSERT_TRUE(elf_image_function_at(image, 0x08000106, &symbol));
    EXPECT_STREQ(symbol.name, "main");
    EXPECT_FALSE(elf_image_function_at(image, 0x080000FE, &symbol));
    elf_image_close(image);
}

TEST(CpuImage, RefusesOtherFiles)
{
    std::string error;
    File other;
    other.bytes[EI_CLASS] = ELFCLASS64;
    EXPECT_EQ(other.open(&error), nullptr);
    EXPECT_NE(error.find("not a program for an ARM processor"), std::string::npos);
    File text;
    text.bytes = {'h', 'i'};
    EXPECT_EQ(text.open(&error), nullptr);
    char buffer[128];
    EXPECT_EQ(elf_image_open("/nowhere", buffer, sizeof buffer), nullptr);
}

/* Whatever is cut off or wrong inside must not be read. */
TEST(CpuImage, BrokenFilesAreNoHarm)
{
    const File whole;
    for (size_t size = 0; size < whole.bytes.size(); size++) {
        File cut = whole;
        cut.bytes.resize(size);
        if (size == 0) {
            continue;
        }
        elf_image_t *image = cut.open();
        Loaded loaded;
        elf_symbol_t symbol;
        if (image != nullptr) {
            (void)elf_image_load(image, &loaded, load);
            (void)elf_image_find(image, "speed", &symbol);
        }
        elf_image_close(image);
    }
    for (size_t i = 0; i < whole.bytes.size(); i++) {
        File changed = whole;
        changed.bytes[i] = 0xFF;
        elf_image_t *image = changed.open();
        Loaded loaded;
        elf_symbol_t symbol;
        if (image != nullptr) {
            (void)elf_image_load(image, &loaded, load);
            (void)elf_image_find(image, "speed", &symbol);
        }
        elf_image_close(image);
    }
}

} // namespace
