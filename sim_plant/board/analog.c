#include "sim_plant/board/analog.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <stddef.h>

enum { OPAMP1 = 0x00, OPAMP2 = 0x04, OPAMP3 = 0x08 };
enum { COMP1 = 0x00, COMP2 = 0x04, COMP4 = 0x0C };
enum { DAC_CR = 0x00, DHR12R1 = 0x08, DHR12R2 = 0x14, DAC_MCR = 0x3C };

#define OPAEN        0x1u
#define OPAMP_FIELDS 0x0007C1EDu /* OPAEN, VP_SEL, VM_SEL, OPAHSM, OPAINTOEN, PGA_GAIN */
#define VM_PGA       2u
#define GAIN_16_BIAS 11u
#define COMP_EN      0x1u
#define COMP_FIELDS  0x00070171u /* EN, INMSEL, INPSEL, HYST */
#define INM_DAC3     4u
#define DAC_EN1      0x1u
#define DAC_EN2      0x10000u
#define DAC_CODES    4096.0
#define DAC_HZ       80000000u
#define DAC_START_S  8e-6 /* DS12589 5.3.21: wake-up to 1 LSB, buffer off, at most */

static const board_register_t opamp_list[] = {
    {OPAMP1, "1_CSR", 0, OPAMP_FIELDS, 0},
    {OPAMP2, "2_CSR", 0, OPAMP_FIELDS, 0},
    {OPAMP3, "3_CSR", 0, OPAMP_FIELDS, 0},
};
static const board_register_t comp_list[] = {
    {COMP1, "1_CSR", 0, COMP_FIELDS, 0x40000000u},
    {COMP2, "2_CSR", 0, COMP_FIELDS, 0x40000000u},
    {COMP4, "4_CSR", 0, COMP_FIELDS, 0x40000000u},
};
static const board_register_t dac_list[] = {
    {DAC_CR, "CR", 0, DAC_EN1 | DAC_EN2, 0},
    {DHR12R1, "DHR12R1", 0, 0xFFFu, 0},
    {DHR12R2, "DHR12R2", 0, 0xFFFu, 0},
    {DAC_MCR, "MCR", 0, 0x0007C007u, 0},
};

/* Of each leg: output, input and bias pin of the amplifier; the comparator shares the input. */
static const struct {
    uint16_t opamp, comp;
    int reference; /* channel of the DAC */
    gpio_pin_t pin[3];
} chain[BOARD_LEGS] = {
    {OPAMP1, COMP1, 0, {{PORT_A, 2, 0}, {PORT_A, 1, 0}, {PORT_A, 3, 0}}},
    {OPAMP2, COMP2, 1, {{PORT_A, 6, 0}, {PORT_A, 7, 0}, {PORT_A, 5, 0}}},
    {OPAMP3, COMP4, 1, {{PORT_B, 1, 0}, {PORT_B, 0, 0}, {PORT_B, 2, 0}}},
};

void analog_init(analog_t *analog, board_chip_t *chip)
{
    *analog = (analog_t){.chip = chip};
    board_registers_init(&analog->opamp, chip->cpu, "OPAMP", opamp_list, 3);
    board_registers_init(&analog->comp, chip->cpu, "COMP", comp_list, 3);
    board_registers_init(&analog->dac, chip->cpu, "DAC3", dac_list, 4);
}

void analog_reset(analog_t *analog)
{
    board_registers_reset(&analog->opamp);
    board_registers_reset(&analog->comp);
    board_registers_reset(&analog->dac);
    analog->dac_ready_s[0] = analog->dac_ready_s[1] = (double)INFINITY;
}

const char *analog_fault(const analog_t *analog, int leg)
{
    uint32_t csr = analog->opamp.value[chain[leg].opamp / 4];
    for (int n = 0; n < 3; n++) {
        if (!gpio_analog(&analog->chip->gpio, chain[leg].pin[n].port, chain[leg].pin[n].number)) {
            return "a pin of the amplifier is not in analog mode";
        }
    }
    if ((csr & OPAEN) == 0u) {
        return "the amplifier is off";
    }
    if (board_field(csr, 2, 2) != 0u) {
        return "the amplifier's input is not VINP0";
    }
    if (board_field(csr, 8, 1) != 0u) {
        return "the amplifier's output is not at its pin";
    }
    bool right = board_field(csr, 5, 2) == VM_PGA && board_field(csr, 14, 5) == GAIN_16_BIAS;
    return right ? NULL : "the amplifier does not amplify sixteenfold with the bias at VINM0";
}

bool analog_level(const analog_t *analog, int leg, double *share)
{
    uint32_t csr = analog->comp.value[chain[leg].comp / 4];
    if ((csr & COMP_EN) == 0u) {
        return false;
    }
    int channel = chain[leg].reference;
    uint32_t code = analog->dac.value[(channel == 0 ? DHR12R1 : DHR12R2) / 4];
    bool on = (analog->dac.value[DAC_CR / 4] & (channel == 0 ? DAC_EN1 : DAC_EN2)) != 0u;
    double pin_V = on ? code / DAC_CODES * BOARD_SUPPLY_V : 0.0;
    *share = (pin_V * BOARD_INNER_GAIN - 0.5 * BOARD_SUPPLY_V) / (0.5 * BOARD_SUPPLY_V);
    return true;
}

static bool opamp_read(void *self, uint32_t offset, uint32_t *value)
{
    analog_t *analog = self;
    return board_registers_read(&analog->opamp, offset, value);
}

static bool opamp_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    analog_t *analog = self;
    return board_registers_write(&analog->opamp, offset, value, mask);
}

static bool comp_read(void *self, uint32_t offset, uint32_t *value)
{
    analog_t *analog = self;
    return board_registers_read(&analog->comp, offset, value);
}

static bool comp_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    analog_t *analog = self;
    if (!board_registers_write(&analog->comp, offset, value, mask)) {
        return false;
    }
    uint32_t csr = analog->comp.value[offset / 4];
    bool on = (csr & COMP_EN) != 0u;
    if (on && (board_field(csr, 4, 3) != INM_DAC3 || board_field(csr, 8, 1) != 0u)) {
        cpu_fail(analog->chip->cpu, "COMP: inputs other than DAC3 and the shunt's pin (INMSEL 4, INPSEL 0)");
    }
    int channel = offset == COMP1 ? 0 : 1;
    if (on && rcc_seconds(&analog->chip->rcc) < analog->dac_ready_s[channel]) {
        cpu_fail(analog->chip->cpu, "COMP: on before the reference of DAC3 has settled");
    }
    board_set_comparators(analog->chip);
    return true;
}

static bool dac_read(void *self, uint32_t offset, uint32_t *value)
{
    analog_t *analog = self;
    return board_registers_read(&analog->dac, offset, value);
}

static void dac_start(analog_t *analog, int channel)
{
    uint32_t mcr = analog->dac.value[DAC_MCR / 4];
    if (board_field(mcr, 16 * channel, 3) != 3u) {
        cpu_fail(analog->chip->cpu, "DAC3_MCR: channel %d on in a mode that does not feed the comparators",
                 channel + 1);
    }
    uint32_t interface = board_field(mcr, 14, 2);
    if (analog->chip->rcc.clock_Hz > DAC_HZ * (interface < 2u ? interface + 1u : 3u)) {
        cpu_fail(analog->chip->cpu, "DAC3_MCR: HFSEL %u is too slow for the bus", (unsigned)interface);
    }
    analog->dac_ready_s[channel] = rcc_seconds(&analog->chip->rcc) + DAC_START_S;
}

static bool dac_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    analog_t *analog = self;
    uint32_t before = analog->dac.value[DAC_CR / 4];
    uint32_t mode = analog->dac.value[DAC_MCR / 4];
    if (!board_registers_write(&analog->dac, offset, value, mask)) {
        return false;
    }
    uint32_t on = analog->dac.value[DAC_CR / 4] & ~before;
    if (offset == DAC_MCR && before != 0u && analog->dac.value[DAC_MCR / 4] != mode) {
        cpu_fail(analog->chip->cpu, "DAC3_MCR: write while a channel is on");
    }
    if (on & DAC_EN1) {
        dac_start(analog, 0);
    }
    if (on & DAC_EN2) {
        dac_start(analog, 1);
    }
    board_set_comparators(analog->chip);
    return true;
}

cpu_device_t analog_opamp_device(analog_t *analog)
{
    return (cpu_device_t){"OPAMP", 0x40010300u, 0x100u, analog, opamp_read, opamp_write};
}

cpu_device_t analog_comp_device(analog_t *analog)
{
    return (cpu_device_t){"COMP", 0x40010200u, 0x100u, analog, comp_read, comp_write};
}

cpu_device_t analog_dac_device(analog_t *analog)
{
    return (cpu_device_t){"DAC3", 0x50001000u, 0x400u, analog, dac_read, dac_write};
}
