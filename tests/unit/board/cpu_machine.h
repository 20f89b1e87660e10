/* A processor with a little memory, and programs of a few half-words. */
#ifndef CPU_MACHINE_H
#define CPU_MACHINE_H

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "sim_plant/board/cpu.h"
#include "sim_plant/board/nvic.h"

namespace machine
{

constexpr uint32_t flash = 0x08000000, ram = 0x20000000, ccm = 0x10000000, ccm_alias = 0x20005800;
constexpr uint32_t stack_top = ram + 0x1000, main_code = flash + 0x400;

/* Instructions */
constexpr uint16_t nop = 0xBF00, wfi = 0xBF30, wfe = 0xBF20, sev = 0xBF40, bx_lr = 0x4770, here = 0xE7FE;
constexpr uint16_t cpsid = 0xB672, cpsie = 0xB662, svc = 0xDF05, bkpt = 0xBE07, undefined = 0xDE01;

constexpr uint16_t movs(int rd, int value)
{
    return static_cast<uint16_t>(0x2000 | rd << 8 | value);
}

constexpr uint16_t adds(int rd, int value)
{
    return static_cast<uint16_t>(0x3000 | rd << 8 | value);
}

constexpr uint16_t str(int rt, int rn, int offset = 0)
{
    return static_cast<uint16_t>(0x6000 | offset / 4 << 6 | rn << 3 | rt);
}

constexpr uint16_t ldr(int rt, int rn, int offset = 0)
{
    return static_cast<uint16_t>(0x6800 | offset / 4 << 6 | rn << 3 | rt);
}

struct Cpu : ::testing::Test {
    cpu_t *cpu = nullptr;

    void SetUp() override
    {
        char error[128] = "";
        cpu = cpu_create(error, sizeof error);
        ASSERT_NE(cpu, nullptr) << error;
        const cpu_memory_t memories[] = {
            {"flash", flash, 0x1000, true, false, 0},
            {"ram", ram, 0x1000, true, true, 0},
            {"ccm", ccm, 0x800, true, true, 0},
            {"ccm alias", ccm_alias, 0x800, true, true, ccm},
        };
        for (const cpu_memory_t &memory : memories) {
            cpu_add_memory(cpu, &memory);
        }
        put(flash, stack_top);
        vector(1, main_code);
        for (int i = 2; i < 64; i++) {
            vector(i, flash + 0x200); /* a handler that hangs */
        }
        code(flash + 0x200, {here});
    }

    void TearDown() override
    {
        cpu_destroy(cpu);
    }

    void put(uint32_t address, uint32_t word)
    {
        std::memcpy(cpu_memory(cpu, address, 4), &word, 4);
    }

    uint32_t get(uint32_t address)
    {
        uint32_t word;
        std::memcpy(&word, cpu_memory(cpu, address, 4), 4);
        return word;
    }

    void code(uint32_t address, const std::vector<uint16_t> &words)
    {
        std::memcpy(cpu_memory(cpu, address, static_cast<uint32_t>(2 * words.size())), words.data(),
                    2 * words.size());
        cpu_code_changed(cpu, address, static_cast<uint32_t>(2 * words.size()));
    }

    void vector(int exception, uint32_t address)
    {
        put(flash + 4U * static_cast<uint32_t>(exception), address | 1);
    }

    void handler(int exception, const std::vector<uint16_t> &words)
    {
        const uint32_t address = flash + 0x800 + 0x20U * static_cast<uint32_t>(exception);
        vector(exception, address);
        code(address, words);
    }

    /* Resets into that program, with r0 ... as given. */
    void start(const std::vector<uint16_t> &words, const std::vector<uint32_t> &registers = {})
    {
        code(main_code, words);
        cpu_reset(cpu, flash);
        for (size_t i = 0; i < registers.size(); i++) {
            cpu_set_register(cpu, static_cast<int>(i), registers[i]);
        }
    }

    void run(uint64_t cycles)
    {
        EXPECT_TRUE(cpu_run(cpu, cpu_now(cpu) + cycles)) << cpu_error(cpu);
    }

    std::string failure(uint64_t cycles)
    {
        EXPECT_FALSE(cpu_run(cpu, cpu_now(cpu) + cycles));
        return cpu_error(cpu);
    }

    uint32_t r(int n)
    {
        return cpu_register(cpu, n);
    }

    /* As an image does it, but from outside: through the processor's own bus only code can. */
    void write_register(uint32_t address, uint32_t value)
    {
        static constexpr uint32_t place = flash + 0x300;
        code(place, {str(1, 0), here});
        const uint32_t pc = cpu_pc(cpu), r0 = r(0), r1 = r(1);
        cpu_set_register(cpu, 0, address);
        cpu_set_register(cpu, 1, value);
        cpu_set_register(cpu, 15, place);
        run(20);
        cpu_set_register(cpu, 0, r0);
        cpu_set_register(cpu, 1, r1);
        cpu_set_register(cpu, 15, pc);
    }

    void enable_line(int irq, uint8_t priority)
    {
        write_register(0xE000E400U + (static_cast<uint32_t>(irq) & ~3U), static_cast<uint32_t>(priority)
                                                                             << (8 * (irq & 3)));
        write_register(0xE000E100U, 1U << irq);
    }
};

} // namespace machine

#endif
