/* Converters, amplifiers, comparators, reference converter: RM0440 21, 22, 24, 25. */
#ifndef REGISTERS_ANALOG_H
#define REGISTERS_ANALOG_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t ISR;
    reg_t IER;
    reg_t CR;
    reg_t CFGR;
    reg_t CFGR2;
    reg_t SMPR1;
    reg_t SMPR2;
    uint32_t reserved_1c[5];
    reg_t SQR1;
    uint32_t reserved_34[3];
    reg_t DR;
    uint32_t reserved_44[2];
    reg_t JSQR;
    uint32_t reserved_50[12];
    reg_t JDR1;
    reg_t JDR2;
    reg_t JDR3;
    reg_t JDR4;
} adc_t;

#define ADC_ISR_ADRDY    (1U << 0)
#define ADC_ISR_EOC      (1U << 2)
#define ADC_ISR_JEOS     (1U << 6)
#define ADC_IER_JEOSIE   (1U << 6)
#define ADC_CR_ADEN      (1U << 0)
#define ADC_CR_ADSTART   (1U << 2)
#define ADC_CR_JADSTART  (1U << 3)
#define ADC_CR_ADVREGEN  (1U << 28)
#define ADC_CR_ADCAL     (1U << 31)
#define ADC_CFGR_OVRMOD  (1U << 12)
#define ADC_CFGR_JQDIS   (1U << 31)
#define ADC_SMPR1_SMP1   (7U << 3)
#define ADC_SMPR1_SMP3   (7U << 9)
#define ADC_SMPR1_SMP5   (7U << 15)
#define ADC_SMPR2_SMP11  (7U << 3)
#define ADC_SMPR2_SMP12  (7U << 6)
#define ADC_SMPR2_SMP14  (7U << 12)
#define ADC_SMPR2_SMP17  (7U << 21)
#define ADC_SMPR2_SMP18  (7U << 24)
#define ADC_SQR1_SQ1     (0x1FU << 6)
#define ADC_JSQR_JL      (3U << 0)
#define ADC_JSQR_JEXTSEL (0x1FU << 2)
#define ADC_JSQR_JEXTEN  (3U << 7)
#define ADC_JSQR_JSQ1    (0x1FU << 9)
#define ADC_JSQR_JSQ2    (0x1FU << 15)
#define ADC_JSQR_JSQ3    (0x1FU << 21)
#define ADC_JSQR_JSQ4    (0x1FU << 27)

/* values of SMPx, in cycles of the converter's clock, of JEXTSEL and of JEXTEN */
enum {
    ADC_SMP_6_5 = 1,
    ADC_SMP_12_5 = 2,
    ADC_SMP_247_5 = 6,
    ADC_JEXTSEL_TIM4_TRGO = 5,
    ADC_JEXTSEL_TIM1_TRGO2 = 8,
    ADC_JEXTEN_RISING = 1,
    ADC_JEXTEN_BOTH = 3
};

typedef struct {
    reg_t CSR;
    uint32_t reserved_4;
    reg_t CCR;
} adc_common_t;

#define ADC_CCR_CKMODE (3U << 16)
#define ADC_CCR_VREFEN (1U << 22)

enum { ADC_CKMODE_DIV_4 = 3 }; /* of the processor's clock */

/* What the converter made of the internal reference at 3.0 V: DS12589 3.18.2. */
typedef struct {
    volatile uint16_t CAL;
} vrefint_t;

typedef struct {
    reg_t CSR;
} opamp_t;

#define OPAMP_CSR_OPAEN    (1U << 0)
#define OPAMP_CSR_VP_SEL   (3U << 2)
#define OPAMP_CSR_VM_SEL   (3U << 5)
#define OPAMP_CSR_OPAHSM   (1U << 7)
#define OPAMP_CSR_PGA_GAIN (0x1FU << 14)

enum { OPAMP_VM_PGA = 2, OPAMP_GAIN_16_BIAS_VINM0 = 11 };

typedef struct {
    reg_t CSR;
} comp_t;

#define COMP_CSR_EN     (1U << 0)
#define COMP_CSR_INMSEL (7U << 4)
#define COMP_CSR_INPSEL (1U << 8)
#define COMP_CSR_HYST   (7U << 16)

enum { COMP_INM_DAC3 = 4, COMP_HYST_10_MV = 1 };

typedef struct {
    reg_t CR;
    reg_t SWTRIGR;
    reg_t DHR12R1;
    uint32_t reserved_c[2];
    reg_t DHR12R2;
    uint32_t reserved_18[9];
    reg_t MCR;
} dac_t;

#define DAC_CR_EN1    (1U << 0)
#define DAC_CR_EN2    (1U << 16)
#define DAC_MCR_MODE1 (7U << 0)
#define DAC_MCR_MODE2 (7U << 16)
#define DAC_MCR_HFSEL (3U << 14)

enum { DAC_MODE_INTERNAL = 3, DAC_HFSEL_160_MHZ = 2 };

extern adc_t ADC1, ADC2;
extern adc_common_t ADC12_COMMON;
extern vrefint_t VREFINT;
extern opamp_t OPAMP1, OPAMP2, OPAMP3;
extern comp_t COMP1, COMP2, COMP4;
extern dac_t DAC3;

#endif
