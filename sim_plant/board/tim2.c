#include "sim_plant/board/tim2.h"

#include "sim_plant/board/board_chip.h"

enum { CR1 = 0x00, EGR = 0x14, CNT = 0x24, PSC = 0x28 };

#define CEN 0x1u
#define UG  0x1u

static const board_register_t list[] = {
    {CR1, "CR1", 0, CEN, 0},
    {EGR, "EGR", 0, UG, 0},
    {CNT, "CNT", 0, 0, 0},
    {PSC, "PSC", 0, 0xFFFFu, 0},
};

void tim2_init(tim2_t *tim, board_chip_t *chip)
{
    *tim = (tim2_t){.prescaler = 1u};
    board_registers_init(&tim->regs, chip->cpu, "TIM2", list, sizeof list / sizeof *list);
}

void tim2_reset(tim2_t *tim)
{
    board_registers_reset(&tim->regs);
    tim->prescaler = 1u;
    tim->count = 0u;
}

static uint32_t count(const tim2_t *tim)
{
    bool runs = (tim->regs.value[CR1 / 4] & CEN) != 0u;
    return tim->count + (runs ? (uint32_t)((cpu_now(tim->regs.cpu) - tim->since) / tim->prescaler) : 0u);
}

static bool tim2_read(void *self, uint32_t offset, uint32_t *value)
{
    tim2_t *tim = self;
    *board_register(&tim->regs, CNT) = count(tim);
    return board_registers_read(&tim->regs, offset, value);
}

static bool tim2_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    tim2_t *tim = self;
    uint32_t present = count(tim);
    bool ran = (tim->regs.value[CR1 / 4] & CEN) != 0u;
    if (!board_registers_write(&tim->regs, offset, value, mask)) {
        return false;
    }
    bool runs = (tim->regs.value[CR1 / 4] & CEN) != 0u;
    if (offset == EGR && (value & UG) != 0u) {
        tim->prescaler = tim->regs.value[PSC / 4] + 1u;
        tim->count = 0u;
        tim->since = cpu_now(tim->regs.cpu);
    } else if (ran != runs) {
        tim->count = present;
        tim->since = cpu_now(tim->regs.cpu);
    }
    *board_register(&tim->regs, EGR) = 0u;
    return true;
}

cpu_device_t tim2_device(tim2_t *tim)
{
    return (cpu_device_t){"TIM2", 0x40000000u, 0x400u, tim, tim2_read, tim2_write};
}
