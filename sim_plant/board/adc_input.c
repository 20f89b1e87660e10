#include "sim_plant/board/adc_internal.h"
#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <stddef.h>

/* NTC at PB14: 10 kohm at 25 degC, beta 3380 K, to 3.3 V; 4.7 kohm to ground */
#define NTC_OHM    10e3
#define NTC_BETA_K 3380.0
#define NTC_LOW    4.7e3
#define KELVIN     273.15
#define TOP_CODE   4095u

/* Internal reference; it takes 4 us of sampling: DS12589 5.3.4 */
#define REFERENCE_CHANNEL 18u
#define REFERENCE_S       4e-6
#define CCR_VREFEN        0x00400000u

typedef enum { LEG_U, LEG_V, LEG_W, LINK_VOLTAGE, TEMPERATURE, DIAL, PB11, TERMINAL_U, TERMINAL_V } source_t;

static const struct {
    int converter, channel;
    source_t source;
    gpio_port_t port;
    int pin;
} inputs[] = {
    {0, 3, LEG_U, PORT_A, 2},        {1, 3, LEG_V, PORT_A, 6},        {0, 12, LEG_W, PORT_B, 1},
    {1, 1, LINK_VOLTAGE, PORT_A, 0}, {0, 1, LINK_VOLTAGE, PORT_A, 0}, {0, 5, TEMPERATURE, PORT_B, 14},
    {0, 11, DIAL, PORT_B, 12},       {0, 14, PB11, PORT_B, 11},       {1, 14, PB11, PORT_B, 11},
    {1, 17, TERMINAL_U, PORT_A, 4},  {1, 5, TERMINAL_V, PORT_C, 4},
};

static uint32_t share_code(double share)
{
    double code = floor(share * (TOP_CODE + 1.0));
    return code >= TOP_CODE ? TOP_CODE : code > 0.0 ? (uint32_t)code : 0u;
}

static uint32_t temperature_code(const board_wiring_t *wiring)
{
    double T_K = wiring->temperature_degC + KELVIN;
    double R_ohm = NTC_OHM * exp(NTC_BETA_K * (1.0 / T_K - 1.0 / (25.0 + KELVIN)));
    return share_code(NTC_LOW / (NTC_LOW + R_ohm));
}

/* The supply is the converters' reference. */
static double per_supply(const adc_converter_t *c)
{
    return BOARD_SUPPLY_V / c->chip->wiring.supply_V;
}

static uint32_t reference_code(const adc_converter_t *c)
{
    if ((c->chip->adc.common.value[2] & CCR_VREFEN) == 0u) {
        cpu_fail(c->chip->cpu, "ADC12_CCR: the internal reference is off (VREFEN)");
    }
    double clock_Hz = (double)c->chip->rcc.clock_Hz;
    if ((double)adc_sampling(c, REFERENCE_CHANNEL) < REFERENCE_S * clock_Hz) {
        cpu_fail(c->chip->cpu, "ADC%d: the internal reference takes 4 us of sampling", c->which + 1);
    }
    return share_code(BOARD_REFERENCE_V / c->chip->wiring.supply_V);
}

/* A current into the motor comes up through the shunt: the code falls from the middle, which the supply makes. */
static uint32_t current_code(const adc_converter_t *c, int leg, const plant_adc_t *seen)
{
    const char *fault = analog_fault(&c->chip->analog, leg);
    if (fault) {
        cpu_fail(c->chip->cpu, "ADC%d: current of leg %d: %s", c->which + 1, leg + 1, fault);
    }
    if (c->chip->wiring.supply_V != BOARD_SUPPLY_V) {
        return share_code(0.5 - (seen->i_leg[leg] / 65536.0 - 0.5) * per_supply(c));
    }
    uint32_t code = (0x10000u - seen->i_leg[leg]) / 16u;
    return code > TOP_CODE ? TOP_CODE : code;
}

/* An amplifier at phase W's input of the dividers, which it replaces: the star point against the mean of the terminals,
 * about the middle. The plant's channel sees the opposite; without one nothing is connected, and it rests. */
static uint32_t neutral_code(const adc_converter_t *c, const plant_adc_t *seen)
{
    return share_code(0.5 - (seen->v_zero[0] / 65536.0 - 0.5) * per_supply(c));
}

/* A divider, whose lower end PB5 takes to ground; the code stops at the supply. */
static uint32_t terminal_code(const adc_converter_t *c, int leg, const plant_adc_t *seen)
{
    if (gpio_drives_high(&c->chip->gpio, PORT_B, 5)) {
        cpu_fail(c->chip->cpu, "ADC%d: the dividers of the terminals are off (PB5 is high)", c->which + 1);
    }
    return share_code(seen->v_leg[leg] / 65536.0 * per_supply(c));
}

/* Phase W's divider where the plant has channels of the terminals, else the neutral's amplifier. */
static uint32_t pb11_code(const adc_converter_t *c, const plant_adc_t *seen)
{
    const bool divider = plant_sensor(c->chip->plant)->v_leg_full_scale_V > 0.0;
    return divider ? terminal_code(c, 2, seen) : neutral_code(c, seen);
}

uint32_t adc_input(const adc_converter_t *c, uint32_t channel, const plant_adc_t *seen)
{
    if (c->which == 0 && channel == REFERENCE_CHANNEL) {
        return reference_code(c);
    }
    for (size_t n = 0; n < sizeof inputs / sizeof *inputs; n++) {
        if (inputs[n].converter != c->which || inputs[n].channel != (int)channel) {
            continue;
        }
        if (!gpio_analog(&c->chip->gpio, inputs[n].port, inputs[n].pin)) {
            cpu_fail(c->chip->cpu, "ADC%d: the pin of input %u is not in analog mode", c->which + 1,
                     (unsigned)channel);
        }
        switch (inputs[n].source) {
        case LINK_VOLTAGE:
            return share_code(seen->v_dc / 65536.0 * per_supply(c));
        case TEMPERATURE:
            return temperature_code(&c->chip->wiring);
        case PB11:
            return pb11_code(c, seen);
        case TERMINAL_U:
            return terminal_code(c, 0, seen);
        case TERMINAL_V:
            return terminal_code(c, 1, seen);
        case DIAL:
            return share_code(c->chip->wiring.dial);
        case LEG_U:
        case LEG_V:
        case LEG_W:
            return current_code(c, (int)inputs[n].source, seen);
        }
    }
    cpu_fail(c->chip->cpu, "ADC%d: the board has nothing at input %u", c->which + 1, (unsigned)channel);
    return 0u;
}

uint32_t adc_divider(const adc_t *adc)
{
    static const uint32_t divider[] = {0u, 1u, 2u, 4u};
    uint32_t by = divider[board_field(adc->common.value[2], 16, 2)];
    if (by == 0u) {
        cpu_fail(adc->chip->cpu, "ADC12_CCR: an asynchronous clock (CKMODE 0) is not modelled");
    } else if (adc->chip->rcc.clock_Hz / by > 60000000u) {
        cpu_fail(adc->chip->cpu, "ADC12_CCR: %.1f MHz are too fast for the converters",
                 1e-6 * adc->chip->rcc.clock_Hz / by);
    }
    return by;
}

uint64_t adc_sampling(const adc_converter_t *c, uint32_t channel)
{
    static const double clocks[] = {2.5, 6.5, 12.5, 24.5, 47.5, 92.5, 247.5, 640.5};
    uint32_t smpr = c->regs.value[(channel < 10u ? ADC_SMPR1 : ADC_SMPR2) / 4];
    double length = clocks[board_field(smpr, 3 * (int)(channel % 10u), 3)];
    return (uint64_t)ceil(length * adc_divider(&c->chip->adc));
}
