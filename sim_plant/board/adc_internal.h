/* Of the converters: registers and inputs. Only adc*.c use it. */
#ifndef BOARD_ADC_INTERNAL_H
#define BOARD_ADC_INTERNAL_H

#include "sim_plant/board/adc.h"

enum {
    ADC_ISR = 0x00,
    ADC_IER = 0x04,
    ADC_CR = 0x08,
    ADC_CFGR = 0x0C,
    ADC_SMPR1 = 0x14,
    ADC_SMPR2 = 0x18,
    ADC_SQR1 = 0x30,
    ADC_DR = 0x40,
    ADC_JSQR = 0x4C,
    ADC_JDR1 = 0x80
};

#define ADC_ADRDY    0x01u
#define ADC_EOC      0x04u
#define ADC_EOS      0x08u
#define ADC_JEOC     0x20u
#define ADC_JEOS     0x40u
#define ADC_ADEN     0x01u
#define ADC_ADSTART  0x04u
#define ADC_JADSTART 0x08u
#define ADC_ADVREGEN 0x10000000u
#define ADC_DEEPPWD  0x20000000u
#define ADC_ADCAL    0x80000000u

/* Cycles of the processor per clock of the converters; 0 after an error: no clock is chosen. */
uint32_t adc_divider(const adc_t *adc);

/* Of an input, in cycles of the processor. */
uint64_t adc_sampling(const adc_converter_t *c, uint32_t channel);

/* The code of an input now, which the plant was seen at. An input that leads nowhere ends the run. */
uint32_t adc_input(const adc_converter_t *c, uint32_t channel, const plant_adc_t *seen);

/* Interrupt line of both. */
void adc_signal(adc_t *adc);

bool adc_regular_runs(const adc_converter_t *c);
void adc_start_regular(adc_converter_t *c, uint64_t cycle);

#endif
