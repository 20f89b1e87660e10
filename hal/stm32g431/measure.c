#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/ntc.h"
#include "hal/stm32g431/registers/analog.h"
#include "hal/stm32g431/registers/tim.h"

/* inputs of the converters */
enum {
    ADC1_PHASE_U = 3,
    ADC1_PHASE_W = 12,
    ADC1_TEMPERATURE = 5,
    ADC1_DIAL = 11,
    ADC1_NEUTRAL = 14,
    ADC1_V_BUS = 1,
    ADC1_TERMINAL_W = 14,
    ADC1_REFERENCE = 18,
    ADC2_PHASE_V = 3,
    ADC2_V_BUS = 1,
    ADC2_TERMINAL_U = 17,
    ADC2_TERMINAL_V = 5,
};

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
#define TRIGGERS                                                                                             \
    (reg_field(ADC_JSQR_JEXTSEL, ADC_JEXTSEL_TIM4_TRGO) | reg_field(ADC_JSQR_JEXTEN, ADC_JEXTEN_BOTH))
#define STARTED_WITHIN 800U /* 4.7 us: the first sequence has ended for 2 us, and no other before */
#else
#define TRIGGERS                                                                                             \
    (reg_field(ADC_JSQR_JEXTSEL, ADC_JEXTSEL_TIM1_TRGO2) | reg_field(ADC_JSQR_JEXTEN, ADC_JEXTEN_RISING))
#endif

#define BREAKS (TIM_SR_BIF | TIM_SR_SBIF)

/* Regular conversions take turns, one per ms. */
static const uint8_t TURN[PORT_TURNS] = {
    [PORT_TEMPERATURE] = ADC1_TEMPERATURE, [PORT_DIAL] = ADC1_DIAL, [PORT_REFERENCE] = ADC1_REFERENCE};

static void start_converter(adc_t *adc)
{
    adc->CR = 0U; /* out of deep power-down */
    adc->CR = ADC_CR_ADVREGEN;
    clock_delay(20U);
    adc->CR = ADC_CR_ADVREGEN | ADC_CR_ADCAL;
    (void)clock_await(&adc->CR, ADC_CR_ADCAL, 0U, 1000U);
    clock_delay(1U); /* four cycles of the converter */
    adc->CR = ADC_CR_ADVREGEN | ADC_CR_ADEN;
    (void)clock_await(&adc->ISR, ADC_ISR_ADRDY, ADC_ISR_ADRDY, 1000U);
    adc->CFGR = ADC_CFGR_JQDIS | ADC_CFGR_OVRMOD;
}

static uint32_t sequence_of(uint32_t first, uint32_t second)
{
    return reg_field(ADC_JSQR_JL, 1U) | TRIGGERS | reg_field(ADC_JSQR_JSQ1, first) |
           reg_field(ADC_JSQR_JSQ2, second);
}

static void start_amplifier(opamp_t *opamp)
{
    /* Sixteenfold with the board's bias network at VINM0, input VINP0. */
    opamp->CSR = OPAMP_CSR_OPAEN | OPAMP_CSR_OPAHSM | reg_field(OPAMP_CSR_VM_SEL, OPAMP_VM_PGA) |
                 reg_field(OPAMP_CSR_PGA_GAIN, OPAMP_GAIN_16_BIAS_VINM0);
}

#if PORT_AT_PB11 == NEEDS_TERMINALS
/* Behind the currents. The DC link comes last and by the converter whose end starts the control interrupt: the other one,
 * which alone has two of the terminals, is through by then. The dividers are some 2 kohm: longer sampling. */
static void add_terminals(void)
{
    ADC1.SMPR1 |= reg_field(ADC_SMPR1_SMP1, ADC_SMP_6_5);
    ADC1.SMPR2 |= reg_field(ADC_SMPR2_SMP14, ADC_SMP_12_5);
    ADC2.SMPR1 |= reg_field(ADC_SMPR1_SMP5, ADC_SMP_12_5);
    ADC2.SMPR2 = reg_field(ADC_SMPR2_SMP17, ADC_SMP_12_5);
    ADC1.JSQR = sequence_of(ADC1_PHASE_U, ADC1_PHASE_W) + reg_field(ADC_JSQR_JL, 2U) +
                reg_field(ADC_JSQR_JSQ3, ADC1_TERMINAL_W) + reg_field(ADC_JSQR_JSQ4, ADC1_V_BUS);
    ADC2.JSQR = sequence_of(ADC2_PHASE_V, ADC2_TERMINAL_U) + reg_field(ADC_JSQR_JL, 1U) +
                reg_field(ADC_JSQR_JSQ3, ADC2_TERMINAL_V);
}
#endif

void measure_start(void)
{
    start_amplifier(&OPAMP1);
    start_amplifier(&OPAMP2);
    start_amplifier(&OPAMP3);
    ADC12_COMMON.CCR = reg_field(ADC_CCR_CKMODE, ADC_CKMODE_DIV_4) | ADC_CCR_VREFEN; /* 42.5 MHz */
    start_converter(&ADC1);
    start_converter(&ADC2);
    ADC1.SMPR1 = reg_field(ADC_SMPR1_SMP3, ADC_SMP_6_5) | reg_field(ADC_SMPR1_SMP5, ADC_SMP_247_5);
    ADC1.SMPR2 = reg_field(ADC_SMPR2_SMP11, ADC_SMP_247_5) | reg_field(ADC_SMPR2_SMP12, ADC_SMP_6_5) |
                 reg_field(ADC_SMPR2_SMP18, ADC_SMP_247_5);
    ADC2.SMPR1 = reg_field(ADC_SMPR1_SMP1, ADC_SMP_6_5) | reg_field(ADC_SMPR1_SMP3, ADC_SMP_6_5);
    ADC1.JSQR = sequence_of(ADC1_PHASE_U, ADC1_PHASE_W);
    ADC2.JSQR = sequence_of(ADC2_PHASE_V, ADC2_V_BUS);
#if PM_CARRIES(NEEDS_NEUTRAL)
    /* behind the currents, by the converter whose end starts the control interrupt */
    ADC1.SMPR2 |= reg_field(ADC_SMPR2_SMP14, ADC_SMP_6_5);
    ADC1.JSQR = sequence_of(ADC1_PHASE_U, ADC1_PHASE_W) + reg_field(ADC_JSQR_JL, 1U) +
                reg_field(ADC_JSQR_JSQ3, ADC1_NEUTRAL);
#endif
#if PORT_AT_PB11 == NEEDS_TERMINALS
    add_terminals();
#endif
}

void measure_run(hal_t *hal)
{
    /* the internal reference at 3.3 V, by its value at 3.0 */
    hal->code[PORT_REFERENCE] = (uint16_t)(VREFINT.CAL * 10U / 11U);
    ADC1.ISR = ADC_ISR_JEOS;
    ADC1.IER = ADC_IER_JEOSIE;
    ADC2.CR = ADC_CR_ADVREGEN | ADC_CR_JADSTART;
    ADC1.CR = ADC_CR_ADVREGEN | ADC_CR_JADSTART;
    ADC1.SQR1 = reg_field(ADC_SQR1_SQ1, ADC1_TEMPERATURE);
    ADC1.CR = ADC_CR_ADVREGEN | ADC_CR_ADSTART;
}

uint32_t hal_channels(const hal_t *hal)
{
    (void)hal;
    return PORT_CHANNELS | PM_BOOTSTRAP;
}

/* A code has 16 bits, which the compiler cannot know of a conversion. */
static uint16_t code_of(uint32_t x)
{
    uint32_t code = x;
    __asm__("" : "+r"(code)); /* else it sees the two steps, and makes sure */
    if (code > UINT16_MAX) {
        __builtin_unreachable();
    }
    return (uint16_t)code;
}

/* The shunt is between leg and ground: a current into the motor makes the code fall. One below the exact
 * complement, so that the smallest fits; the calibration takes that as an offset. */
static uint16_t current_code(uint32_t converted)
{
    return code_of(0xFFFFU - converted * 16U);
}

/* Once reported; they are set again while the cause lasts. */
__attribute__((noinline, cold)) static void clear_breaks(uint32_t breaks)
{
    TIM1.SR = ~breaks;
}

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
bool measure_is_within(void)
{
    return TIM4.CNT > STARTED_WITHIN;
}

/* Before the sequence at the end of the period has a result. */
void measure_take_sample(void)
{
    pm_measure_t *more = port_hal.more;
    ADC1.ISR = ADC_ISR_JEOS;
    if (more == NULL) { /* the trigger's first edge, before the first period has ended */
        return;
    }
    port_hal.taken = 1U;
#if PM_SAMPLES_CURRENTS
    more->i_sample[0][0] = current_code(ADC1.JDR1);
    more->i_sample[0][1] = current_code(ADC2.JDR1);
    more->i_sample[0][2] = current_code(ADC1.JDR2);
#endif
#if PORT_AT_PB11 == NEEDS_TERMINALS
    more->v_sample[0][0] = code_of(ADC2.JDR2 * 16U);
    more->v_sample[0][1] = code_of(ADC2.JDR3 * 16U);
    more->v_sample[0][2] = code_of(ADC1.JDR3 * 16U);
    more->v_dc_sample[0] = code_of(ADC1.JDR4 * 16U);
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    more->v_neutral_sample[0] = code_of(ADC1.JDR3 * 16U);
#endif
}

static void give_sample(pm_measure_t *more)
{
    port_hal.more = more;
    more->sampled = port_hal.taken;
    port_hal.taken = 0U;
}
#endif

void hal_measure(hal_t *hal, drive_in_t *in)
{
    (void)hal;
    in->i_leg[0] = current_code(ADC1.JDR1);
    in->i_leg[1] = current_code(ADC2.JDR1);
    in->i_leg[2] = current_code(ADC1.JDR2);
#if PORT_AT_PB11 == NEEDS_TERMINALS
    in->more.v_terminal[0] = code_of(ADC2.JDR2 * 16U);
    in->more.v_terminal[1] = code_of(ADC2.JDR3 * 16U);
    in->more.v_terminal[2] = code_of(ADC1.JDR3 * 16U);
    in->v_dc = code_of(ADC1.JDR4 * 16U);
#else
    in->v_dc = code_of(ADC2.JDR2 * 16U);
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    in->more.v_neutral = code_of(ADC1.JDR3 * 16U);
#endif
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    give_sample(&in->more);
#endif
    in->hw_fault = false;
    const uint32_t breaks = TIM1.SR & BREAKS;
    if (breaks != 0U) {
        in->hw_fault = true;
        clear_breaks(breaks);
    }
}

/* One regular conversion per call; the injected ones interrupt it. */
void hal_measure_slow(hal_t *hal, hal_slow_t *slow)
{
    if ((ADC1.ISR & ADC_ISR_EOC) != 0U) {
        hal->code[hal->turn] = (uint16_t)ADC1.DR; /* clears the flag */
        hal->turn = (uint8_t)(hal->turn + 1U < PORT_TURNS ? hal->turn + 1U : 0U);
        ADC1.SQR1 = reg_field(ADC_SQR1_SQ1, TURN[hal->turn]);
        ADC1.CR = ADC_CR_ADVREGEN | ADC_CR_ADSTART;
    }
    slow->temperature_missing = !ntc_temperature(hal->code[PORT_TEMPERATURE], &slow->temperature_dC);
    slow->dial = (uint16_t)(hal->code[PORT_DIAL] * 16U);
    slow->button = pins_button();
    const uint32_t cal = VREFINT.CAL; /* within 5 % of 20/22 of it */
    slow->reference_off = hal->code[PORT_REFERENCE] * 22U - cal * 19U > cal * 2U;
}
