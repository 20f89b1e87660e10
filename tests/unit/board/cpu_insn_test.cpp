#include "sim_plant/board/cpu_insn.h"

#include <gtest/gtest.h>

namespace
{

insn_t decode(uint16_t first, uint16_t second = 0)
{
    insn_t insn;
    insn_decode(&insn, first, second);
    return insn;
}

TEST(CpuInsn, LengthsOfInstructions)
{
    EXPECT_EQ(decode(0xBF00).length, 2);
    EXPECT_EQ(decode(0xE7FE).length, 2);
    EXPECT_EQ(decode(0xE800).length, 4);
    EXPECT_EQ(decode(0xF000, 0xB800).length, 4);
}

struct Case {
    uint16_t first, second;
    insn_kind_t kind;
};

TEST(CpuInsn, Kinds)
{
    const Case cases[] = {
        {0x1888, 0, INSN_ALU},               /* adds r0, r1, r2 */
        {0x4348, 0, INSN_ALU},               /* muls r0, r1 */
        {0x6808, 0, INSN_LOAD},              /* ldr r0, [r1] */
        {0x5888, 0, INSN_LOAD},              /* ldr r0, [r1, r2] */
        {0x5688, 0, INSN_LOAD},              /* ldrsb r0, [r1, r2] */
        {0x5088, 0, INSN_STORE},             /* str r0, [r1, r2] */
        {0x4801, 0, INSN_LOAD},              /* ldr r0, [pc, #4] */
        {0xB510, 0, INSN_STORES},            /* push {r4, lr} */
        {0xBD10, 0, INSN_LOADS},             /* pop {r4, pc} */
        {0xC906, 0, INSN_LOADS},             /* ldmia r1!, {r1, r2} */
        {0xE9D1, 0x2300, INSN_LOADS},        /* ldrd r2, r3, [r1] */
        {0xE8D1, 0xF002, INSN_TABLE_BRANCH}, /* tbb [r1, r2] */
        {0xE851, 0x2F00, INSN_LOAD},         /* ldrex r2, [r1] */
        {0xD0FE, 0, INSN_BRANCH_IF},         /* beq */
        {0xF43F, 0xAFFE, INSN_BRANCH_IF},    /* beq.w */
        {0xB108, 0, INSN_BRANCH_IF},         /* cbz r0 */
        {0xE7FE, 0, INSN_BRANCH},            /* b */
        {0xF7FF, 0xFFFE, INSN_BRANCH},       /* bl */
        {0x4770, 0, INSN_BRANCH},            /* bx lr */
        {0x4687, 0, INSN_BRANCH},            /* mov pc, r0 */
        {0x4608, 0, INSN_ALU},               /* mov r0, r1 */
        {0xFB91, 0xF0F2, INSN_DIVIDE},       /* sdiv r0, r1, r2 */
        {0xFBB1, 0xF0F2, INSN_DIVIDE},       /* udiv r0, r1, r2 */
        {0xFB91, 0xF012, INSN_ALU},          /* not a division */
        {0xFB81, 0x2300, INSN_ALU},          /* smull */
        {0xBF08, 0, INSN_IT},                /* it eq */
        {0xBF00, 0, INSN_ALU},               /* nop */
        {0xBF20, 0, INSN_WAIT_EVENT},        /* wfe */
        {0xBF30, 0, INSN_WAIT_INTERRUPT},    /* wfi */
        {0xBF40, 0, INSN_SEND_EVENT},        /* sev */
        {0xF3AF, 0x8002, INSN_WAIT_EVENT},   /* wfe.w */
        {0xF3BF, 0x8F4F, INSN_BARRIER},      /* dsb */
        {0xF3EF, 0x8010, INSN_SPECIAL},      /* mrs r0, primask */
        {0xF380, 0x8811, INSN_SPECIAL},      /* msr basepri, r0 */
        {0xB672, 0, INSN_SPECIAL},           /* cpsid i */
        {0xDF05, 0, INSN_ALU},               /* svc: its cost is the exception's */
        {0xEE30, 0x0A20, INSN_FLOAT},        /* vadd.f32 */
        {0xEE00, 0x0A20, INSN_FLOAT_MAC},    /* vmla.f32 */
        {0xEE80, 0x0A20, INSN_FLOAT_DIVIDE}, /* vdiv.f32 */
        {0xEEB1, 0x0AC0, INSN_FLOAT_DIVIDE}, /* vsqrt.f32 */
        {0xEEB0, 0x0A40, INSN_FLOAT},        /* vmov.f32 */
        {0xED90, 0x0A00, INSN_LOAD},         /* vldr s0, [r0] */
        {0xED2D, 0x8B02, INSN_STORES},       /* vpush {d8} */
    };
    for (const Case &c : cases) {
        EXPECT_EQ(decode(c.first, c.second).kind, c.kind) << std::hex << c.first << " " << c.second;
    }
}

TEST(CpuInsn, WritesToThePc)
{
    EXPECT_TRUE(decode(0xBD10).writes_pc);
    EXPECT_FALSE(decode(0xBC10).writes_pc);
    EXPECT_TRUE(decode(0xF8D1, 0xF000).writes_pc); /* ldr pc, [r1] */
    EXPECT_TRUE(decode(0xE8BD, 0x8010).writes_pc); /* pop.w {r4, pc} */
    EXPECT_FALSE(decode(0xE92D, 0x4010).writes_pc);
}

struct Address {
    uint16_t first, second;
    uint32_t expected;
    int size, count;
};

TEST(CpuInsn, Addresses)
{
    uint32_t registers[16];
    for (uint32_t i = 0; i < 16; i++) {
        registers[i] = 0x1000 * (i + 1);
    }
    const Address cases[] = {
        {0x6848, 0, 0x2004, 4, 1},      /* ldr r0, [r1, #4] */
        {0x7848, 0, 0x2001, 1, 1},      /* ldrb r0, [r1, #1] */
        {0x8848, 0, 0x2002, 2, 1},      /* ldrh r0, [r1, #2] */
        {0x5888, 0, 0x5000, 4, 1},      /* ldr r0, [r1, r2] */
        {0x9801, 0, 0xE004, 4, 1},      /* ldr r0, [sp, #4] */
        {0xB510, 0, 0xDFF8, 4, 2},      /* push {r4, lr} */
        {0xBD10, 0, 0xE000, 4, 2},      /* pop {r4, pc} */
        {0xF8D1, 0x0ABC, 0x2ABC, 4, 1}, /* ldr.w r0, [r1, #0xabc] */
        {0xF851, 0x0C08, 0x1FF8, 4, 1}, /* ldr r0, [r1, #-8] */
        {0xF851, 0x0B08, 0x2000, 4, 1}, /* ldr r0, [r1], #8 */
        {0xF841, 0x0D04, 0x1FFC, 4, 1}, /* str r0, [r1, #-4]! */
        {0xF851, 0x0022, 0xE000, 4, 1}, /* ldr r0, [r1, r2, lsl #2] */
        {0xF991, 0x0003, 0x2003, 1, 1}, /* ldrsb r0, [r1, #3] */
        {0xE9D1, 0x2302, 0x2008, 4, 2}, /* ldrd r2, r3, [r1, #8] */
        {0xE8F1, 0x2302, 0x2000, 4, 2}, /* ldrd r2, r3, [r1], #8 */
        {0xE921, 0x000C, 0x1FF8, 4, 2}, /* stmdb r1!, {r2, r3} */
        {0xE8A1, 0x000C, 0x2000, 4, 2}, /* stmia r1!, {r2, r3} */
        {0xED91, 0x0A02, 0x2008, 4, 1}, /* vldr s0, [r1, #8] */
    };
    for (const Address &c : cases) {
        const insn_t insn = decode(c.first, c.second);
        EXPECT_EQ(insn_address(&insn, 0x8000, registers), c.expected)
            << std::hex << c.first << " " << c.second;
        EXPECT_EQ(insn.size, c.size) << std::hex << c.first;
        EXPECT_EQ(insn.count, c.count) << std::hex << c.first;
    }
    const insn_t literal = decode(0x4801);
    EXPECT_EQ(insn_address(&literal, 0x8002, registers), 0x8008U) << "the PC is aligned first";
}

} // namespace
