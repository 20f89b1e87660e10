/* The registers of the private peripheral bus: NVIC, system control block, SysTick, MPU, DWT's cycle counter,
 * and of ITM what an image needs to find out that nobody listens. ARMv7-M ARM B3. */
#ifndef BOARD_SYSTEM_BLOCK_H
#define BOARD_SYSTEM_BLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "sim_plant/board/cpu.h"

/* Configurable fault status */
#define CFSR_IACCVIOL    UINT32_C(0x00000001)
#define CFSR_DACCVIOL    UINT32_C(0x00000002)
#define CFSR_MUNSTKERR   UINT32_C(0x00000008)
#define CFSR_MSTKERR     UINT32_C(0x00000010)
#define CFSR_MMARVALID   UINT32_C(0x00000080)
#define CFSR_IBUSERR     UINT32_C(0x00000100)
#define CFSR_PRECISERR   UINT32_C(0x00000200)
#define CFSR_UNSTKERR    UINT32_C(0x00000800)
#define CFSR_STKERR      UINT32_C(0x00001000)
#define CFSR_BFARVALID   UINT32_C(0x00008000)
#define CFSR_UNDEFINSTR  UINT32_C(0x00010000)
#define CFSR_INVSTATE    UINT32_C(0x00020000)
#define CFSR_INVPC       UINT32_C(0x00040000)
#define CFSR_NOCP        UINT32_C(0x00080000)
#define CFSR_UNALIGNED   UINT32_C(0x01000000)
#define CFSR_DIVBYZERO   UINT32_C(0x02000000)
#define HFSR_VECTTBL     UINT32_C(0x00000002)
#define HFSR_FORCED      UINT32_C(0x40000000)
#define CCR_UNALIGN_TRAP UINT32_C(0x00000008)
#define CCR_DIVIDE_TRAP  UINT32_C(0x00000010)

typedef struct {
    uint32_t vtor, ccr, scr, cfsr, hfsr, dfsr, mmfar, bfar, cpacr, demcr, actlr;
    uint32_t fpccr, fpcar, fpdscr;
    struct {
        uint32_t control, reload;
        uint64_t zero_at; /* cycle of reaching zero, while enabled */
        uint32_t value;   /* while disabled */
        bool passed_zero; /* COUNTFLAG */
    } systick;
    struct {
        uint32_t control;
        uint64_t origin; /* cycle at which it was zero, while counting */
        uint32_t value;  /* while not */
    } dwt;
} system_block_t;

void system_block_attach(cpu_t *cpu); /* puts the registers on the bus */
void system_block_reset(cpu_t *cpu);

#endif
