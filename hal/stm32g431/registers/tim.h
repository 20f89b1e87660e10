/* Timers: RM0440 28 (TIM1) and 29 (TIM2 to TIM4). */
#ifndef REGISTERS_TIM_H
#define REGISTERS_TIM_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t CR1;
    reg_t CR2;
    reg_t SMCR;
    reg_t DIER;
    reg_t SR;
    reg_t EGR;
    reg_t CCMR1;
    reg_t CCMR2;
    reg_t CCER;
    reg_t CNT;
    reg_t PSC;
    reg_t ARR;
    reg_t RCR;
    reg_t CCR1;
    reg_t CCR2;
    reg_t CCR3;
    reg_t CCR4;
    reg_t BDTR;
    uint32_t reserved_48[6];
    reg_t AF1;
} tim_t;

#define TIM_CR1_CEN     (1U << 0)
#define TIM_CR1_CMS     (3U << 5)
#define TIM_CR1_ARPE    (1U << 7)
#define TIM_CR2_CCPC    (1U << 0)
#define TIM_CR2_CCUS    (1U << 2)
#define TIM_CR2_MMS     (7U << 4)
#define TIM_SMCR_SMS    (7U << 0) /* the lower three of four bits */
#define TIM_SMCR_TS     (7U << 4) /* the lower three of five bits */
#define TIM_CR2_MMS2    (0xFU << 20)
#define TIM_SR_BIF      (1U << 7)
#define TIM_SR_SBIF     (1U << 13)
#define TIM_EGR_UG      (1U << 0)
#define TIM_EGR_COMG    (1U << 5)
#define TIM_EGR_BG      (1U << 7)
#define TIM_CCMR1_OC1PE (1U << 3)
#define TIM_CCMR1_OC1M  (7U << 4) /* the lower three of four bits */
#define TIM_CCMR1_OC2PE (1U << 11)
#define TIM_CCMR1_OC2M  (7U << 12)
#define TIM_CCMR2_OC3PE (1U << 3)
#define TIM_CCMR2_OC3M  (7U << 4)
#define TIM_CCMR2_OC4PE (1U << 11)
#define TIM_CCMR2_OC4M  (7U << 12)
#define TIM_CCER_CC1E   (1U << 0)
#define TIM_CCER_CC1NE  (1U << 2)
#define TIM_CCER_CC2E   (1U << 4)
#define TIM_CCER_CC2NE  (1U << 6)
#define TIM_CCER_CC3E   (1U << 8)
#define TIM_CCER_CC3NE  (1U << 10)
#define TIM_BDTR_DTG    (0xFFU << 0)
#define TIM_BDTR_LOCK   (3U << 8)
#define TIM_BDTR_OSSI   (1U << 10)
#define TIM_BDTR_OSSR   (1U << 11)
#define TIM_BDTR_BKE    (1U << 12)
#define TIM_BDTR_BKP    (1U << 13)
#define TIM_BDTR_MOE    (1U << 15)
#define TIM_BDTR_BKF    (0xFU << 16)
#define TIM_AF1_BKINE   (1U << 0)
#define TIM_AF1_BKCMP1E (1U << 1)
#define TIM_AF1_BKCMP2E (1U << 2)
#define TIM_AF1_BKCMP4E (1U << 4)

/* values of OCxM, CMS, MMS2 */
enum {
    TIM_OCM_LOW = 4,
    TIM_OCM_HIGH = 5,
    TIM_OCM_PWM1 = 6,
    TIM_OCM_PWM2 = 7,
    TIM_CMS_CENTRE = 1,
    TIM_MMS2_OC4REF = 7
};

/* of MMS, SMS and TS */
enum { TIM_MMS_UPDATE = 2, TIM_MMS_OC1REF = 4, TIM_SMS_RESET = 4, TIM_TS_TIM1 = 0, TIM_TS_TIM3 = 2 };

extern tim_t TIM1, TIM2, TIM3, TIM4;

#endif
