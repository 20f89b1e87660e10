#include "sim_plant/board/iwdg.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <stdint.h>

#define LSI_HZ  32000.0
#define CROSS_S (5.0 / LSI_HZ)
#define FEED    0xAAAAu
#define OPEN    0x5555u
#define START   0xCCCCu
#define PVU     0x1u
#define RVU     0x2u

enum { KR = 0x0, PR = 0x4, RLR = 0x8, SR = 0xC };

static const board_register_t list[] = {
    {KR, "KR", 0, 0xFFFFu, 0},
    {PR, "PR", 0, 0x7u, 0},
    {RLR, "RLR", 0xFFFu, 0xFFFu, 0},
    {SR, "SR", 0, 0, PVU | RVU},
};

static void expire(void *owner, uint64_t cycle)
{
    iwdg_t *iwdg = owner;
    (void)cycle;
    iwdg->expired = true;
    tim1_reset(&iwdg->chip->tim1); /* the rest of the reset follows when the run comes to an end */
    cpu_halt(iwdg->chip->cpu, true);
}

static void arm(iwdg_t *iwdg)
{
    const rcc_t *rcc = &iwdg->chip->rcc;
    cpu_t *cpu = iwdg->chip->cpu;
    if (!iwdg->running || iwdg->frozen) {
        cpu_alarm(cpu, iwdg, UINT64_MAX, expire);
        return;
    }
    cpu_alarm(cpu, iwdg, cpu_now(cpu) + rcc_cycles(rcc, fmax(iwdg->end_s - rcc_seconds(rcc), 0.0)), expire);
}

static void take_over(iwdg_t *iwdg)
{
    double now_s = rcc_seconds(&iwdg->chip->rcc);
    if (now_s >= iwdg->divider_s) {
        uint32_t pr = iwdg->regs.value[PR / 4];
        iwdg->divider = 4u << (pr < 6u ? pr : 6u);
    }
    if (now_s >= iwdg->reload_s) {
        iwdg->reload = iwdg->regs.value[RLR / 4];
    }
    uint32_t *sr = board_register(&iwdg->regs, SR);
    *sr = (now_s < iwdg->divider_s ? PVU : 0u) | (now_s < iwdg->reload_s ? RVU : 0u);
}

/* The counter takes the reload value that has crossed by now. */
static void feed(iwdg_t *iwdg)
{
    take_over(iwdg);
    iwdg->end_s = rcc_seconds(&iwdg->chip->rcc) + (iwdg->reload + 1.0) * iwdg->divider / LSI_HZ;
    arm(iwdg);
}

void iwdg_init(iwdg_t *iwdg, board_chip_t *chip)
{
    *iwdg = (iwdg_t){.chip = chip};
    board_registers_init(&iwdg->regs, chip->cpu, "IWDG", list, sizeof list / sizeof *list);
}

void iwdg_reset(iwdg_t *iwdg)
{
    board_registers_reset(&iwdg->regs);
    iwdg->running = iwdg->open = iwdg->frozen = iwdg->expired = false;
    iwdg->divider = 4u;
    iwdg->reload = 0xFFFu;
    iwdg->divider_s = iwdg->reload_s = 0.0;
    arm(iwdg);
}

void iwdg_clock_changed(iwdg_t *iwdg)
{
    arm(iwdg);
}

void iwdg_freeze(iwdg_t *iwdg, bool frozen)
{
    double now_s = rcc_seconds(&iwdg->chip->rcc);
    if (frozen && !iwdg->frozen) {
        iwdg->left_s = iwdg->end_s - now_s;
    } else if (!frozen && iwdg->frozen) {
        iwdg->end_s = now_s + iwdg->left_s;
    }
    iwdg->frozen = frozen;
    arm(iwdg);
}

static bool iwdg_read(void *self, uint32_t offset, uint32_t *value)
{
    iwdg_t *iwdg = self;
    take_over(iwdg);
    return board_registers_read(&iwdg->regs, offset, value);
}

static bool iwdg_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    iwdg_t *iwdg = self;
    double now_s = rcc_seconds(&iwdg->chip->rcc);
    take_over(iwdg);
    if (!board_registers_write(&iwdg->regs, offset, value, mask)) {
        return false;
    }
    if (offset == KR) {
        *board_register(&iwdg->regs, KR) = 0u;
        iwdg->open = value == OPEN;
        if (value == START && !iwdg->running) {
            iwdg->running = true;
            rcc_start_lsi(&iwdg->chip->rcc);
            feed(iwdg);
        } else if (value == FEED) {
            feed(iwdg);
        } else if (value != OPEN && value != START) {
            cpu_fail(iwdg->chip->cpu, "IWDG_KR: 0x%x is no key", (unsigned)value);
        }
        return true;
    }
    if (!iwdg->open || now_s < (offset == PR ? iwdg->divider_s : iwdg->reload_s)) {
        cpu_fail(iwdg->chip->cpu, "IWDG: write to offset 0x%x while %s", (unsigned)offset,
                 iwdg->open ? "the last one is under way" : "protected");
        return true;
    }
    if (!iwdg->running) {
        /* without LSI nothing crosses: RM0440 42.3 wants the watchdog started first */
        cpu_fail(iwdg->chip->cpu, "IWDG: write to offset 0x%x before LSI runs", (unsigned)offset);
        return true;
    }
    *(offset == PR ? &iwdg->divider_s : &iwdg->reload_s) = now_s + CROSS_S;
    return true;
}

cpu_device_t iwdg_device(iwdg_t *iwdg)
{
    return (cpu_device_t){"IWDG", 0x40003000u, 0x400u, iwdg, iwdg_read, iwdg_write};
}
