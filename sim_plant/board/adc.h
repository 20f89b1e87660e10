/* ADC1 and ADC2: injected sequences by TIM1_TRGO2 or TIM4_TRGO, one regular conversion by software. RM0440 21.
 *
 * An input is sampled at the end of its sampling time: there the plant is looked at. An injected trigger
 * breaks off a regular conversion, which starts anew behind the sequence. Every input that the board does not
 * wire to the right pin, in its mode, is an error when converted. Only single-ended, right-aligned 12 bits.
 * Tests: adc_test.cpp. */
#ifndef BOARD_ADC_H
#define BOARD_ADC_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

#define ADC_CONVERTERS 2
#define ADC_RANKS      4

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    int which;
    double regulator_s;         /* when it is up; INFINITY: off */
    uint64_t calibrated, ready; /* cycles at which ADCAL falls, ADRDY rises; UINT64_MAX: not asked for */
    int rank, ranks;            /* of the injected sequence under way: next to sample */
    int converted;              /* ranks that have ended */
    uint64_t hold[ADC_RANKS], end[ADC_RANKS];
    uint32_t code[ADC_RANKS];
    uint64_t regular_hold, regular_end; /* UINT64_MAX: none */
    uint32_t regular_code;
    bool regular_held;
} adc_converter_t;

typedef struct {
    board_chip_t *chip;
    board_registers_t common;
    adc_converter_t converter[ADC_CONVERTERS];
    plant_adc_t seen; /* the plant at cycle seen_at */
    uint64_t seen_at;
} adc_t;

void adc_init(adc_t *adc, board_chip_t *chip);
void adc_reset(adc_t *adc);
cpu_device_t adc_device(adc_t *adc); /* both, and what they share */

/* A trigger output has risen or fallen: TIM1_TRGO2, TIM4_TRGO. */
typedef enum { ADC_BY_TIM4 = 5, ADC_BY_TIM1 = 8 } adc_source_t; /* JEXTSEL */
void adc_trigger(adc_t *adc, uint64_t cycle, adc_source_t source, bool rises);

/* Everything that is sampled and converted up to that cycle. */
void adc_sync(adc_t *adc, uint64_t cycle);

/* The converters are stuck, or no longer. */
void adc_release(adc_t *adc);

/* Samples due up to that cycle, in order of time: before the plant moves on. */
void adc_sample_until(adc_t *adc, uint64_t cycle);

#endif
