#include "sim_plant/board/flash.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <string.h>

#define KEY_1      0x45670123u
#define KEY_2      0xCDEF89ABu
#define PROGRAM_S  85e-6 /* DS12589 5.3.10: double word, page */
#define ERASE_S    22.1e-3
#define ERASED     0xFFu
#define WAIT_HZ    30e6 /* per wait state, in range 1 and its boost */
#define WAIT_BOOST 34e6

enum { ACR = 0x00, KEYR = 0x08, SR = 0x10, CR = 0x14, ECCR = 0x18 };

#define LATENCY 0x0000000Fu
#define EOP     0x00000001u
#define PROGERR 0x00000008u
#define PGAERR  0x00000020u
#define SIZERR  0x00000040u
#define PGSERR  0x00000080u
#define ERRORS  0x0000C3FAu
#define BSY     0x00010000u
#define PG      0x00000001u
#define PER     0x00000002u
#define STRT    0x00010000u
#define LOCK    0x80000000u

static const board_register_t list[] = {
    {ACR, "ACR", 0x00040600u, 0x00001F0Fu, 0},
    {KEYR, "KEYR", 0, 0xFFFFFFFFu, 0},
    {SR, "SR", 0, ERRORS | EOP, BSY},
    {CR, "CR", 0xC0000000u, PG | PER | 0x3F8u | STRT | LOCK, 0x40000000u},
    {ECCR, "ECCR", 0, 0, 0},
};

/* It is kept, and written later. */
/* NOLINTNEXTLINE(readability-non-const-parameter) */
void flash_init(flash_t *flash, board_chip_t *chip, uint8_t *memory)
{
    *flash = (flash_t){.chip = chip, .memory = memory};
    board_registers_init(&flash->regs, chip->cpu, "FLASH", list, sizeof list / sizeof *list);
}

void flash_reset(flash_t *flash)
{
    board_registers_reset(&flash->regs);
    flash->latency = 0u;
    flash->busy_until_s = 0.0;
    flash->keys = 0;
    flash->half = false;
    flash->cut = false;
}

void flash_check_clock(flash_t *flash)
{
    const rcc_t *rcc = &flash->chip->rcc;
    double most_Hz = (flash->latency + 1.0) * (rcc_boost(rcc) ? WAIT_BOOST : WAIT_HZ);
    if (rcc->clock_Hz > most_Hz) {
        cpu_fail(flash->chip->cpu, "FLASH_ACR: %u wait states are too few for %.1f MHz",
                 (unsigned)flash->latency, 1e-6 * rcc->clock_Hz);
    }
}

static bool busy(const flash_t *flash)
{
    return rcc_seconds(&flash->chip->rcc) < flash->busy_until_s;
}

static void error(flash_t *flash, uint32_t flag)
{
    *board_register(&flash->regs, SR) |= flag;
}

static void occupy(flash_t *flash, double duration_s)
{
    const rcc_t *rcc = &flash->chip->rcc;
    flash->busy_until_s = rcc_seconds(rcc) + duration_s;
    cpu_stall(flash->chip->cpu, FLASH_BASE, cpu_now(flash->chip->cpu) + rcc_cycles(rcc, duration_s));
}

/* True: the power goes now, in the midst of it. */
static bool counts_down(flash_t *flash)
{
    if (flash->cut_after > 0u && --flash->cut_after == 0u) {
        flash->cut = true;
        tim1_reset(&flash->chip->tim1); /* the rest of the reset follows when the run comes to an end */
        cpu_halt(flash->chip->cpu, true);
    }
    return flash->cut;
}

static void erase(flash_t *flash, uint32_t page)
{
    uint32_t offset = page * FLASH_PAGE_SIZE;
    if (offset >= FLASH_SIZE) {
        cpu_fail(flash->chip->cpu, "FLASH_CR: there is no page %u", (unsigned)page);
        return;
    }
    uint32_t size = counts_down(flash) ? FLASH_PAGE_SIZE / 2u : FLASH_PAGE_SIZE;
    memset(flash->memory + offset, ERASED, size);
    cpu_code_changed(flash->chip->cpu, FLASH_BASE + offset, FLASH_PAGE_SIZE);
    occupy(flash, ERASE_S);
}

static void program(flash_t *flash, uint32_t address, uint32_t low, uint32_t high)
{
    uint8_t *at = flash->memory + (address - FLASH_BASE);
    uint32_t word[2] = {low, high};
    uint8_t none[8], zero[8] = {0};
    memset(none, ERASED, sizeof none);
    /* All zero may be written over anything: RM0440 5.3.7 */
    if (memcmp(at, none, sizeof none) != 0 && memcmp(word, zero, sizeof zero) != 0) {
        error(flash, PROGERR);
        return;
    }
    memcpy(at, word, counts_down(flash) ? sizeof word / 2 + 1 : sizeof word);
    cpu_code_changed(flash->chip->cpu, address, sizeof word);
    occupy(flash, PROGRAM_S);
}

static void write_cr(flash_t *flash, uint32_t before)
{
    uint32_t *cr = board_register(&flash->regs, CR);
    uint32_t now = *cr;
    if ((before & LOCK) != 0u || busy(flash)) {
        cpu_fail(flash->chip->cpu, "FLASH_CR: write while %s", busy(flash) ? "busy" : "locked");
        *cr = before;
        return;
    }
    if ((now & LOCK) != 0u) {
        flash->keys = 0;
    }
    flash->half = flash->half && (now & PG) != 0u;
    if ((now & STRT) != 0u) {
        *cr &= ~STRT;
        if ((now & PER) == 0u || (now & PG) != 0u || (flash->regs.value[SR / 4] & ERRORS) != 0u) {
            error(flash, PGSERR);
        } else {
            erase(flash, board_field(now, 3, 7));
        }
    }
}

static void write_key(flash_t *flash, uint32_t key)
{
    bool right = flash->keys >= 0 && key == (flash->keys == 0 ? KEY_1 : KEY_2) && flash->keys < 2;
    if (!right || (flash->regs.value[CR / 4] & LOCK) == 0u) {
        flash->keys = -1;
        cpu_fail(flash->chip->cpu, "FLASH_KEYR: wrong key 0x%08x: a bus fault, locked until reset",
                 (unsigned)key);
        return;
    }
    if (++flash->keys == 2) {
        *board_register(&flash->regs, CR) &= ~LOCK;
    }
}

static bool flash_read(void *self, uint32_t offset, uint32_t *value)
{
    flash_t *flash = self;
    uint32_t *sr = board_register(&flash->regs, SR);
    *sr = (*sr & ~BSY) | (busy(flash) ? BSY : 0u);
    return board_registers_read(&flash->regs, offset, value);
}

static bool flash_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    flash_t *flash = self;
    uint32_t before = offset / 4 < BOARD_REGISTERS_MOST ? flash->regs.value[offset / 4] : 0u;
    if (!board_registers_write(&flash->regs, offset, value, mask)) {
        return false;
    }
    switch (offset) {
    case ACR:
        flash->latency = flash->regs.value[ACR / 4] & LATENCY;
        flash_check_clock(flash);
        break;
    case KEYR:
        write_key(flash, value);
        break;
    case SR:
        *board_register(&flash->regs, SR) = before & ~(value & mask & (ERRORS | EOP));
        break;
    case CR:
        write_cr(flash, before);
        break;
    default:
        break;
    }
    return true;
}

/* A double word is two words in order, the first at a multiple of eight. RM0440 5.3.7 */
static bool memory_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    flash_t *flash = self;
    uint32_t address = FLASH_BASE + offset;
    if (busy(flash)) {
        cpu_fail(flash->chip->cpu, "flash: write to 0x%08x while busy", (unsigned)address);
    } else if ((flash->regs.value[CR / 4] & PG) == 0u || (flash->regs.value[SR / 4] & ERRORS) != 0u) {
        error(flash, PGSERR);
    } else if (mask != 0xFFFFFFFFu) {
        error(flash, SIZERR);
    } else if (!flash->half) {
        flash->half = offset % 8u == 0u;
        flash->half_address = address;
        flash->half_value = value;
        if (!flash->half) {
            error(flash, PGAERR);
        }
    } else {
        flash->half = false;
        if (address != flash->half_address + 4u) {
            error(flash, PGAERR);
        } else {
            program(flash, flash->half_address, flash->half_value, value);
        }
    }
    return true;
}

cpu_device_t flash_device(flash_t *flash)
{
    return (cpu_device_t){"FLASH", 0x40022000u, 0x400u, flash, flash_read, flash_write};
}

cpu_device_t flash_memory_device(flash_t *flash)
{
    return (cpu_device_t){"flash memory", FLASH_BASE, FLASH_SIZE, flash, NULL, memory_write};
}
