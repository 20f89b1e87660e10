#include "sim_plant/board/fdcan.h"

#include "sim_plant/board/board_chip.h"

#include <stdint.h>
#include <string.h>

#define IRQ       21
#define INIT      0x1u
#define CCE       0x2u
#define RF0N      0x1u
#define RF0L      0x4u
#define TFE       0x200u
#define EP_IR     0x20000u
#define BO_IR     0x80000u
#define IR_BITS   0x00FFFFFFu
#define PSR_EP    0x20u
#define PSR_EW    0x40u
#define PSR_BO    0x80u
#define PASSIVE   128u
#define WARNING   96u
#define JOIN_BITS 11u
#define RECOVERY  (128u * 11u)
#define ELEMENT   18u
#define RX_FIRST  44u  /* word of the message memory: FIFO 0, ... */
#define TX_FIRST  158u /* transmit buffers */
#define XTD_RTR   0x60000000u
#define FDF_BRS   0x00300000u

enum {
    CCCR = 0x18,
    NBTP = 0x1C,
    PSR = 0x44,
    IR = 0x50,
    IE = 0x54,
    ILE = 0x5C,
    RXGFC = 0x80,
    RXF0S = 0x90,
    RXF0A = 0x94,
    TXFQS = 0xC4,
    TXBAR = 0xCC
};

static const board_register_t list[] = {
    {CCCR, "CCCR", INIT, INIT | CCE, 0}, {NBTP, "NBTP", 0x06000A03u, 0xFFFFFF7Fu, 0},
    {PSR, "PSR", 0x707u, 0, 0},          {IR, "IR", 0, IR_BITS, 0},
    {IE, "IE", 0, IR_BITS, 0},           {ILE, "ILE", 0, 0x1u, 0},
    {RXGFC, "RXGFC", 0, 0x3Fu, 0},       {RXF0S, "RXF0S", 0, 0, 0},
    {RXF0A, "RXF0A", 0, 0x7u, 0},        {TXFQS, "TXFQS", 0x3u, 0, 0},
    {TXBAR, "TXBAR", 0, 0x7u, 0},
};

static const gpio_pin_t rx = {PORT_A, 11, 9};
static const gpio_pin_t tx = {PORT_B, 9, 9};

static void frame_over(void *owner, uint64_t cycle);

void fdcan_init(fdcan_t *can, board_chip_t *chip)
{
    memset(can, 0, sizeof *can);
    can->chip = chip;
    board_registers_init(&can->regs, chip->cpu, "FDCAN1", list, sizeof list / sizeof *list);
}

void fdcan_reset(fdcan_t *can)
{
    board_registers_reset(&can->regs);
    can->rx_get = can->rx_fill = can->tx_get = can->tx_put = can->tx_fill = can->errors_sent = 0u;
    can->bus_off = false;
    can->bus = BUS_IDLE;
    can->joined = UINT64_MAX;
    can->to_image.taken = can->to_image.put;
    cpu_alarm(can->chip->cpu, can, UINT64_MAX, frame_over);
    cpu_irq(can->chip->cpu, IRQ, false);
}

static void signal_state(fdcan_t *can)
{
    const uint32_t *value = can->regs.value;
    cpu_irq(can->chip->cpu, IRQ, (value[IR / 4] & value[IE / 4]) != 0u && value[ILE / 4] != 0u);
}

static void flag(fdcan_t *can, uint32_t bits)
{
    *board_register(&can->regs, IR) |= bits;
    signal_state(can);
}

static void count_errors(fdcan_t *can)
{
    uint32_t *psr = board_register(&can->regs, PSR);
    *psr = (*psr & ~(PSR_EP | PSR_EW | PSR_BO)) | (can->errors_sent >= WARNING ? PSR_EW : 0u) |
           (can->errors_sent >= PASSIVE || can->bus_off ? PSR_EP : 0u) | (can->bus_off ? PSR_BO : 0u);
}

static fdcan_frame_t element_frame(const uint32_t *element)
{
    fdcan_frame_t frame = {.id = (uint16_t)board_field(element[0], 18, 11)};
    uint32_t length = board_field(element[1], 16, 4);
    frame.length = (uint8_t)(length > 8u ? 8u : length);
    for (unsigned n = 0; n < frame.length; n++) {
        frame.data[n] = (uint8_t)board_field(element[2u + n / 4u], 8 * (int)(n % 4u), 8);
    }
    return frame;
}

static bool takes_part(const fdcan_t *can)
{
    return !can->bus_off && can->joined <= cpu_now(can->chip->cpu);
}

/* Begins the next frame on an idle bus. */
static void arbitrate(fdcan_t *can, uint64_t cycle)
{
    if (can->bus != BUS_IDLE || can->bus_off || can->joined == UINT64_MAX) {
        return;
    }
    if (cycle < can->joined) {
        cpu_alarm(can->chip->cpu, can, can->joined, frame_over);
        return;
    }
    bool out = can->tx_fill > 0u;
    bool in = can->to_image.put != can->to_image.taken;
    fdcan_frame_t mine = element_frame(&can->ram[TX_FIRST + ELEMENT * can->tx_get]);
    const fdcan_frame_t *other = &can->to_image.frame[can->to_image.taken % FDCAN_QUEUE];
    if (!out && !in) {
        return;
    }
    can->bus = out && (!in || mine.id <= other->id) ? BUS_OUT : BUS_IN;
    unsigned bits = fdcan_frame_bits(can->bus == BUS_OUT ? &mine : other);
    cpu_alarm(can->chip->cpu, can, cycle + (uint64_t)bits * can->bit_cycles, frame_over);
}

static void keep(fdcan_queue_t *queue, const fdcan_frame_t *frame)
{
    queue->frame[queue->put++ % FDCAN_QUEUE] = *frame;
    if (queue->put - queue->taken > FDCAN_QUEUE) {
        queue->taken = queue->put - FDCAN_QUEUE;
    }
}

static void sent(fdcan_t *can)
{
    const gpio_t *gpio = &can->chip->gpio;
    const uint32_t *element = &can->ram[TX_FIRST + ELEMENT * can->tx_get];
    if ((element[0] & XTD_RTR) != 0u || (element[1] & FDF_BRS) != 0u) {
        cpu_fail(can->chip->cpu,
                 "FDCAN1: frames other than classic data frames with 11 bits are not modelled");
    }
    if (!gpio_connects(gpio, tx) || !gpio_connects(gpio, rx) || gpio_drives_high(gpio, PORT_C, 11)) {
        cpu_fail(can->chip->cpu,
                 "FDCAN1: PB9 and PA11 are not its pins (AF9), or PC11 shuts the transceiver down");
    }
    fdcan_frame_t frame = element_frame(element);
    keep(&can->from_image, &frame);
    can->tx_get = (can->tx_get + 1u) % FDCAN_ELEMENTS;
    can->tx_fill--;
    can->errors_sent -= can->errors_sent > 0u ? 1u : 0u;
    count_errors(can);
    flag(can, can->tx_fill == 0u ? TFE : 0u);
}

static void received(fdcan_t *can, const fdcan_frame_t *frame)
{
    if (board_field(can->regs.value[RXGFC / 4], 4, 2) != 0u) {
        return; /* rejected; into FIFO 1 is refused when written */
    }
    if (can->rx_fill == FDCAN_ELEMENTS) {
        flag(can, RF0L);
        return;
    }
    uint32_t *element = &can->ram[RX_FIRST + ELEMENT * ((can->rx_get + can->rx_fill) % FDCAN_ELEMENTS)];
    memset(element, 0, 4 * sizeof *element);
    element[0] = (uint32_t)frame->id << 18;
    element[1] = 0x80000000u | (uint32_t)frame->length << 16; /* ANMF: no filter has matched */
    for (unsigned n = 0; n < frame->length; n++) {
        element[2u + n / 4u] |= (uint32_t)frame->data[n] << (8u * (n % 4u));
    }
    can->rx_fill++;
    flag(can, RF0N);
}

static void frame_over(void *owner, uint64_t cycle)
{
    fdcan_t *can = owner;
    if (can->bus == BUS_OUT) {
        sent(can);
    } else if (can->bus == BUS_IN) {
        fdcan_frame_t frame = can->to_image.frame[can->to_image.taken++ % FDCAN_QUEUE];
        received(can, &frame);
    } else if (can->bus_off && cycle >= can->joined) {
        can->bus_off = false; /* recovered */
        can->errors_sent = 0u;
        count_errors(can);
    }
    can->bus = BUS_IDLE;
    arbitrate(can, cycle);
}

bool fdcan_put(fdcan_t *can, const fdcan_frame_t *frame)
{
    if (!takes_part(can) || can->to_image.put - can->to_image.taken >= FDCAN_QUEUE) {
        return false;
    }
    can->to_image.frame[can->to_image.put++ % FDCAN_QUEUE] = *frame;
    arbitrate(can, cpu_now(can->chip->cpu));
    return true;
}

bool fdcan_take(fdcan_t *can, fdcan_frame_t *frame)
{
    if (can->from_image.put == can->from_image.taken) {
        return false;
    }
    *frame = can->from_image.frame[can->from_image.taken++ % FDCAN_QUEUE];
    return true;
}

void fdcan_error(fdcan_t *can, bool bus_off)
{
    can->errors_sent = bus_off ? 0u : PASSIVE;
    can->bus_off = bus_off;
    count_errors(can);
    if (bus_off) {
        *board_register(&can->regs, CCCR) |= INIT;
        can->joined = UINT64_MAX;
        can->bus = BUS_IDLE;
        cpu_alarm(can->chip->cpu, can, UINT64_MAX, frame_over);
    }
    flag(can, bus_off ? BO_IR : EP_IR);
}

/* kbit/s of NBTP; 0: none of the four, or the kernel clock is not PCLK1. */
static unsigned bit_rate(fdcan_t *can)
{
    uint32_t nbtp = can->regs.value[NBTP / 4];
    uint32_t quanta = 3u + board_field(nbtp, 8, 8) + board_field(nbtp, 0, 7);
    can->bit_cycles = (board_field(nbtp, 16, 9) + 1u) * quanta;
    static const unsigned rates[] = {125, 250, 500, 1000};
    for (int n = 0; n < 4 && rcc_fdcan_on_pclk(&can->chip->rcc); n++) {
        if (can->chip->rcc.clock_Hz == rates[n] * 1000u * can->bit_cycles) {
            return rates[n];
        }
    }
    return 0u;
}

static void write_cccr(fdcan_t *can, uint32_t before)
{
    uint32_t *cccr = board_register(&can->regs, CCCR);
    if ((*cccr & CCE) != 0u && (before & INIT) == 0u) {
        *cccr &= ~CCE; /* only once INIT reads as one */
    }
    if ((before & INIT) != 0u && (*cccr & INIT) == 0u) {
        *cccr &= ~CCE;
        if (bit_rate(can) == 0u) {
            cpu_fail(can->chip->cpu,
                     "FDCAN1_NBTP 0x%08x at %.3f MHz, or CCIPR, does not make 125, 250, 500 or 1000 kbit/s",
                     (unsigned)can->regs.value[NBTP / 4], 1e-6 * can->chip->rcc.clock_Hz);
        }
        uint64_t now = cpu_now(can->chip->cpu);
        can->joined = now + (uint64_t)can->bit_cycles * (can->bus_off ? RECOVERY : JOIN_BITS);
        cpu_alarm(can->chip->cpu, can, can->joined, frame_over);
    } else if ((before & INIT) == 0u && (*cccr & INIT) != 0u) {
        can->joined = UINT64_MAX;
        can->bus = BUS_IDLE;
        cpu_alarm(can->chip->cpu, can, UINT64_MAX, frame_over);
    }
}

static void request(fdcan_t *can, uint32_t buffers)
{
    for (unsigned n = 0; n < FDCAN_ELEMENTS && can->tx_fill < FDCAN_ELEMENTS; n++) {
        if ((buffers & (1u << can->tx_put)) == 0u) {
            break;
        }
        buffers &= ~(1u << can->tx_put);
        can->tx_put = (can->tx_put + 1u) % FDCAN_ELEMENTS;
        can->tx_fill++;
    }
    if (buffers != 0u) {
        cpu_fail(can->chip->cpu, "FDCAN1_TXBAR: buffers 0x%x are not next in the transmit FIFO",
                 (unsigned)buffers);
    }
    *board_register(&can->regs, TXBAR) = 0u;
    arbitrate(can, cpu_now(can->chip->cpu));
}

static void acknowledge(fdcan_t *can, uint32_t index)
{
    unsigned steps = (index + FDCAN_ELEMENTS - can->rx_get) % FDCAN_ELEMENTS + 1u;
    if (index >= FDCAN_ELEMENTS || steps > can->rx_fill) {
        cpu_fail(can->chip->cpu, "FDCAN1_RXF0A: element %u is not waiting", (unsigned)index);
        return;
    }
    can->rx_get = (can->rx_get + steps) % FDCAN_ELEMENTS;
    can->rx_fill -= steps;
}

static bool fdcan_read(void *self, uint32_t offset, uint32_t *value)
{
    fdcan_t *can = self;
    uint32_t lost = (can->regs.value[IR / 4] & RF0L) != 0u ? 1u << 25 : 0u;
    uint32_t full = can->rx_fill == FDCAN_ELEMENTS ? 1u << 24 : 0u;
    *board_register(&can->regs, RXF0S) =
        can->rx_fill | can->rx_get << 8 | (can->rx_get + can->rx_fill) % FDCAN_ELEMENTS << 16 | full | lost;
    *board_register(&can->regs, TXFQS) = (FDCAN_ELEMENTS - can->tx_fill) | can->tx_get << 8 |
                                         can->tx_put << 16 | (can->tx_fill == FDCAN_ELEMENTS ? 1u << 21 : 0u);
    return board_registers_read(&can->regs, offset, value);
}

static bool fdcan_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    fdcan_t *can = self;
    uint32_t before = offset / 4 < BOARD_REGISTERS_MOST ? can->regs.value[offset / 4] : 0u;
    bool open = (can->regs.value[CCCR / 4] & (INIT | CCE)) == (INIT | CCE);
    if (!board_registers_write(&can->regs, offset, value, mask)) {
        return false;
    }
    if ((offset == NBTP || offset == RXGFC) && !open) {
        cpu_fail(can->chip->cpu, "FDCAN1: configuration while CCCR.INIT and CCE are not both set");
    }
    switch (offset) {
    case CCCR:
        write_cccr(can, before);
        break;
    case RXGFC:
        if (board_field(value, 4, 2) == 1u) {
            cpu_fail(can->chip->cpu, "FDCAN1_RXGFC: FIFO 1 is not modelled");
        }
        break;
    case IR:
        *board_register(&can->regs, IR) = before & ~(value & mask);
        break;
    case RXF0A:
        acknowledge(can, can->regs.value[RXF0A / 4]);
        break;
    case TXBAR:
        request(can, value & mask);
        break;
    default:
        break;
    }
    signal_state(can);
    return true;
}

static bool ram_read(void *self, uint32_t offset, uint32_t *value)
{
    fdcan_t *can = self;
    *value = can->ram[offset / 4];
    return true;
}

static bool ram_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    fdcan_t *can = self;
    can->ram[offset / 4] = (can->ram[offset / 4] & ~mask) | (value & mask);
    return true;
}

cpu_device_t fdcan_device(fdcan_t *can)
{
    return (cpu_device_t){"FDCAN1", 0x40006400u, 0x400u, can, fdcan_read, fdcan_write};
}

cpu_device_t fdcan_ram_device(fdcan_t *can)
{
    return (cpu_device_t){"FDCAN memory", 0x4000A400u, 4u * FDCAN_RAM_WORDS, can, ram_read, ram_write};
}
