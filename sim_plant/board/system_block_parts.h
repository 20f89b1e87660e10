/* The parts of the system block, for its own files. */
#ifndef BOARD_SYSTEM_BLOCK_PARTS_H
#define BOARD_SYSTEM_BLOCK_PARTS_H

#include "sim_plant/board/cpu_state.h"

/* Offsets in the system control space, 0xE000E000 */
enum {
    ICTR = 0x004,
    ACTLR = 0x008,
    SYST_CSR = 0x010,
    SYST_RVR = 0x014,
    SYST_CVR = 0x018,
    SYST_CALIB = 0x01C,
    NVIC_ISER = 0x100,
    NVIC_ICER = 0x180,
    NVIC_ISPR = 0x200,
    NVIC_ICPR = 0x280,
    NVIC_IABR = 0x300,
    NVIC_IPR = 0x400,
    NVIC_IPR_END = NVIC_IPR + NVIC_LINES,
    CPUID = 0xD00,
    ICSR = 0xD04,
    VTOR = 0xD08,
    AIRCR = 0xD0C,
    SCR = 0xD10,
    CCR = 0xD14,
    SHPR1 = 0xD18,
    SHPR3 = 0xD20,
    SHCSR = 0xD24,
    CFSR = 0xD28,
    HFSR = 0xD2C,
    DFSR = 0xD30,
    MMFAR = 0xD34,
    BFAR = 0xD38,
    AFSR = 0xD3C,
    CPACR = 0xD88,
    MPU = 0xD90,
    MPU_END = 0xDBC,
    DHCSR = 0xDF0,
    DEMCR = 0xDFC,
    STIR = 0xF00,
    FPCCR = 0xF34,
    FPCAR = 0xF38,
    FPDSCR = 0xF3C,
};

/* Registers of each part. False: none there. */
bool systick_read(cpu_t *cpu, uint32_t offset, uint32_t *value);
bool systick_write(cpu_t *cpu, uint32_t offset, uint32_t value);
bool lines_read(cpu_t *cpu, uint32_t offset, uint32_t *value);
bool lines_write(cpu_t *cpu, uint32_t offset, uint32_t value, uint32_t mask);
bool dwt_read(void *self, uint32_t offset, uint32_t *value);
bool dwt_write(void *self, uint32_t offset, uint32_t value, uint32_t mask);
bool itm_read(void *self, uint32_t offset, uint32_t *value);
bool itm_write(void *self, uint32_t offset, uint32_t value, uint32_t mask);

/* A word of priorities; `first` is an exception. */
uint32_t priorities(const cpu_t *cpu, int first);
void set_priorities(cpu_t *cpu, int first, uint32_t value, uint32_t mask);

void dwt_enable(cpu_t *cpu, uint32_t demcr); /* TRCENA switches the counter */

#endif
