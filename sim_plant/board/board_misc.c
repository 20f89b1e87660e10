#include "sim_plant/board/board_misc.h"

enum { SYSCFG_CFGR2 = 0x1C, DBGMCU_APB1FZR1 = 0x08, DBGMCU_APB2FZR = 0x10 };
enum { SPL = 0x2, PVDL = 0x4, SPF = 0x100 }; /* CLL and ECCL lock what cannot happen here */
enum { FREEZE_IWDG = 0x1000, FREEZE_TIM1 = 0x800 };

static const board_register_t syscfg_list[] = {{SYSCFG_CFGR2, "CFGR2", 0, 0xFu, SPF}};
static const board_register_t debug_list[] = {
    {DBGMCU_APB1FZR1, "APB1FZR1", 0, FREEZE_IWDG, 0},
    {DBGMCU_APB2FZR, "APB2FZR", 0, FREEZE_TIM1, 0},
};

void board_misc_init(board_misc_t *misc, cpu_t *cpu)
{
    board_registers_init(&misc->syscfg, cpu, "SYSCFG", syscfg_list, 1);
    board_registers_init(&misc->debug, cpu, "DBGMCU", debug_list, 2);
}

/* DBGMCU keeps its bits but for a power-on reset. */
void board_misc_reset(board_misc_t *misc)
{
    board_registers_reset(&misc->syscfg);
}

bool board_misc_freezes_iwdg(const board_misc_t *misc)
{
    return (misc->debug.value[DBGMCU_APB1FZR1 / 4] & FREEZE_IWDG) != 0u;
}

bool board_misc_freezes_tim1(const board_misc_t *misc)
{
    return (misc->debug.value[DBGMCU_APB2FZR / 4] & FREEZE_TIM1) != 0u;
}

bool board_misc_locks_detector(const board_misc_t *misc)
{
    return (misc->syscfg.value[SYSCFG_CFGR2 / 4] & PVDL) != 0u;
}

bool board_misc_breaks(const board_misc_t *misc, bool supply_low)
{
    uint32_t set = misc->syscfg.value[SYSCFG_CFGR2 / 4];
    return (supply_low && (set & PVDL) != 0u) || ((set & SPL) != 0u && (set & SPF) != 0u);
}

void board_misc_parity_error(board_misc_t *misc)
{
    *board_register(&misc->syscfg, SYSCFG_CFGR2) |= SPF;
}

static bool read_any(void *self, uint32_t offset, uint32_t *value)
{
    return board_registers_read(self, offset, value);
}

static bool write_any(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    return board_registers_write(self, offset, value, mask);
}

cpu_device_t board_misc_syscfg(board_misc_t *misc)
{
    return (cpu_device_t){"SYSCFG", 0x40010000u, 0x30u, &misc->syscfg, read_any, write_any};
}

cpu_device_t board_misc_debug(board_misc_t *misc)
{
    return (cpu_device_t){"DBGMCU", 0xE0042000u, 0x400u, &misc->debug, read_any, write_any};
}
