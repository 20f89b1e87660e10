#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/processor.h"
#include "hal/stm32g431/registers/analog.h"
#include "hal/stm32g431/registers/clock.h"
#include "hal/stm32g431/registers/tim.h"

enum {
    COUNTS_LEAST = PM_CARRIES(NEEDS_NEUTRAL) ? 2833 : 2125, /* 30 and 40 kHz: f_pwm_most of board.c */
    COUNTS_SAFE = 4250, /* in place of a refused value: everything else is timed by this clock */
    DEAD_TIME_LEAST_ns = 300,
    COMMUTATE_LEAST = 510, /* 3 us: by then the control interrupt has written the states to come */
    /* Of further samples. The converters are started ahead of the instant, since the currents come first; */
    SAMPLE_AHEAD = 200,
    SAMPLE_FIRST = 510 + SAMPLE_AHEAD, /* not before those of the zero vector have been read, */
    SAMPLE_BEFORE_END = 300,           /* nor so late that they could not be read before the next */
    SAMPLE_NONE = 85,                  /* the converters are busy then */
    BREAK_FILTER = 12,                 /* of BKF: 8 samples at 1/16 of the clock, 0.75 us */
    BREAK_LEVEL_MOST = 0x7FFF,
    DETECTOR_2_9_V = 6, /* of PLS: below it the converters' reference is wrong, too */
};

/* Both switches of a leg; the legs follow each other by four bits, as the states in drive_out_t. */
#define LEG    (TIM_CCER_CC1E | TIM_CCER_CC1NE)
#define BREAKS (TIM_SR_BIF | TIM_SR_SBIF)

/* DTG counts in four ranges, of 1, 2, 8 and 16 clocks; the ranges begin at 0, 64, 32 and 32 of their unit. */
static bool dead_time_code(uint32_t dead_time_ns, uint32_t *code)
{
    static const struct {
        uint32_t unit, least, count, prefix;
    } range[] = {{1, 0, 128, 0x00}, {2, 64, 64, 0x80}, {8, 32, 32, 0xC0}, {16, 32, 32, 0xE0}};
    const uint32_t clocks = (dead_time_ns * 17U + 99U) / 100U; /* of 170 MHz */
    for (uint32_t n = 0; n < sizeof range / sizeof range[0]; ++n) {
        const uint32_t units = (clocks + range[n].unit - 1U) / range[n].unit;
        const uint32_t least = units > range[n].least ? units : range[n].least;
        if (least < range[n].least + range[n].count) {
            *code = range[n].prefix + least - range[n].least;
            return dead_time_ns >= DEAD_TIME_LEAST_ns;
        }
    }
    *code = 0xFFU;
    return false;
}

static uint32_t modes_12(uint32_t first, uint32_t second)
{
    return reg_field(TIM_CCMR1_OC1M, first) | TIM_CCMR1_OC1PE | reg_field(TIM_CCMR1_OC2M, second) |
           TIM_CCMR1_OC2PE;
}

/* The fourth starts the converters. */
static uint32_t modes_34(uint32_t third)
{
    return reg_field(TIM_CCMR2_OC3M, third) | TIM_CCMR2_OC3PE | reg_field(TIM_CCMR2_OC4M, TIM_OCM_PWM2) |
           TIM_CCMR2_OC4PE;
}

#if PM_CARRIES(NEEDS_COMMUTATE | NEEDS_SECOND_SAMPLE)
/* Counts from each update event of TIM1 on. Its channel is the trigger output. */
static void start_counting(tim_t *timer, uint32_t mode)
{
    timer->CR2 = reg_field(TIM_CR2_MMS, TIM_MMS_OC1REF);
    timer->SMCR = reg_field(TIM_SMCR_SMS, TIM_SMS_RESET) | reg_field(TIM_SMCR_TS, TIM_TS_TIM1);
    timer->CCMR1 = reg_field(TIM_CCMR1_OC1M, mode) | TIM_CCMR1_OC1PE;
    timer->ARR = UINT16_MAX;
    timer->CCR1 = 0U;
    timer->EGR = TIM_EGR_UG;
    TIM1.CR2 |= reg_field(TIM_CR2_MMS, TIM_MMS_UPDATE);
}
#endif

#if PM_CARRIES(NEEDS_COMMUTATE)
/* Its channel rises at CCR1, which is a COM event; with 0 it is always high. */
static void configure_commutation(void)
{
    RCC.APB1ENR1 |= RCC_APB1ENR1_TIM3EN;
    start_counting(&TIM3, TIM_OCM_PWM2);
    TIM3.CR1 = TIM_CR1_CEN;
    TIM1.SMCR = reg_field(TIM_SMCR_TS, TIM_TS_TIM3);
    TIM1.CR2 |= TIM_CR2_CCUS;
}
#endif

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
/* Its channel rises at the update event and falls at CCR1: both edges start the converters. It is low until the first one. */
static void configure_samples(uint32_t counts)
{
    RCC.APB1ENR1 |= RCC_APB1ENR1_TIM4EN;
    start_counting(&TIM4, TIM_OCM_PWM1);
    TIM4.CCR1 = SAMPLE_NONE;
    port_hal.instants = 2U * counts - (uint32_t)SAMPLE_BEFORE_END - (uint32_t)SAMPLE_FIRST;
    port_hal.taken = 0U;
}

/* In the period after the coming update event. */
static void write_instants(const pm_instants_t *instants)
{
    const uint32_t at = instants->sample_at[0];
    TIM4.CCR1 = at - (uint32_t)SAMPLE_FIRST <= port_hal.instants ? at - (uint32_t)SAMPLE_AHEAD
                                                                 : (uint32_t)SAMPLE_NONE;
}
#endif

static void configure_timer(uint32_t counts)
{
    TIM1.CR1 = reg_field(TIM_CR1_CMS, TIM_CMS_CENTRE) | TIM_CR1_ARPE;
    TIM1.CR2 = reg_field(TIM_CR2_MMS2, TIM_MMS2_OC4REF);
    TIM1.ARR = counts;
    TIM1.CCMR1 = modes_12(TIM_OCM_PWM1, TIM_OCM_PWM1);
    TIM1.CCMR2 = modes_34(TIM_OCM_PWM1);
    TIM1.CCR1 = 0U;
    TIM1.CCR2 = 0U;
    TIM1.CCR3 = 0U;
    TIM1.CCR4 = counts - 1U; /* the converters start at the centre of the zero vector */
    TIM1.CCER = 0U;
#if PORT_BY_COM
    TIM1.CR2 |= TIM_CR2_CCPC; /* from now on states of legs wait for a COM event */
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    configure_commutation();
#endif
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    configure_samples(counts);
#endif
    TIM1.AF1 = TIM_AF1_BKINE | TIM_AF1_BKCMP1E | TIM_AF1_BKCMP2E | TIM_AF1_BKCMP4E;
    TIM1.RCR = 0U;
    TIM1.EGR = TIM_EGR_UG;
    PWR.CR2 = PWR_CR2_PVDE | reg_field(PWR_CR2_PLS, DETECTOR_2_9_V);
    SYSCFG.CFGR2 = SYSCFG_CFGR2_CLL | SYSCFG_CFGR2_SPL | SYSCFG_CFGR2_PVDL | SYSCFG_CFGR2_ECCL;
    DBGMCU.APB2FZR |= DBGMCU_APB2FZR_TIM1; /* a halted processor must not leave a voltage applied */
}

/* The amplifier makes 16 times the voltage that the comparator sees; its 16 bits are 12 of the reference. */
static void configure_comparators(uint32_t level)
{
    const uint32_t code = (0x8000U + level) / (16U * 16U);
    const uint32_t comparator =
        reg_field(COMP_CSR_INMSEL, COMP_INM_DAC3) | reg_field(COMP_CSR_HYST, COMP_HYST_10_MV) | COMP_CSR_EN;
    DAC3.MCR = reg_field(DAC_MCR_MODE1, DAC_MODE_INTERNAL) | reg_field(DAC_MCR_MODE2, DAC_MODE_INTERNAL) |
               reg_field(DAC_MCR_HFSEL, DAC_HFSEL_160_MHZ);
    DAC3.DHR12R1 = code;
    DAC3.DHR12R2 = code;
    DAC3.CR = DAC_CR_EN1 | DAC_CR_EN2;
    clock_delay(20U); /* until the references have settled */
    COMP1.CSR = comparator;
    COMP2.CSR = comparator;
    COMP4.CSR = comparator;
    clock_delay(20U);
}

hal_status_t bridge_start(hal_t *hal, const hal_config_t *config)
{
    hal_status_t status = HAL_OK;
    uint32_t dead_time = 0;
    if (!dead_time_code(config->dead_time_ns, &dead_time)) {
        status = HAL_DEAD_TIME;
    }
    uint32_t level = config->break_level;
    if (level > BREAK_LEVEL_MOST) {
        status = HAL_BREAK_LEVEL;
    }
    if (level == 0U || level > BREAK_LEVEL_MOST) {
        level = BREAK_LEVEL_MOST;
    }
    uint32_t counts = config->timer_counts;
    if (counts < COUNTS_LEAST) {
        status = HAL_TIMER_COUNTS;
        counts = COUNTS_SAFE;
    }
    configure_comparators(level);
    configure_timer(counts);
    hal->legs = 0U;
#if PORT_BY_COM
    hal->written = PM_LEGS_OFF;
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    hal->then = PM_LEGS_OFF;
#endif
    hal->bridge = reg_field(TIM_BDTR_DTG, dead_time) | TIM_BDTR_OSSI | TIM_BDTR_OSSR | TIM_BDTR_BKE |
                  TIM_BDTR_BKP | reg_field(TIM_BDTR_BKF, BREAK_FILTER);
    /* After this only the main output enable can change, until the next reset. */
    TIM1.BDTR = hal->bridge | (status == HAL_OK ? reg_field(TIM_BDTR_LOCK, 2U) : 0U);
    return status;
}

/* RM0440: the odd repetition count decides between overflow and underflow by being written before or after
 * the counter is started. After: the update event is at the overflow, the centre of the zero vector. */
void bridge_run(void)
{
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    TIM4.CR1 = TIM_CR1_CEN;
#endif
    TIM1.CR1 |= TIM_CR1_CEN;
    TIM1.RCR = 1U;
}

#if PORT_BY_COM
/* Outputs and mode of a channel by the state of its leg. Two outputs are complementary, with dead time; one alone follows
 * the channel, the lower switch's too: in mode 2 it is on where the upper one would be off. */
static const struct {
    uint8_t outputs, mode;
} OF_STATE[PM_LEG_LOWER_INVERTED + 1] = {
    [PM_LEG_OFF] = {0, TIM_OCM_PWM1},
    [PM_LEG_PWM] = {LEG, TIM_OCM_PWM1},
    [PM_LEG_UPPER] = {TIM_CCER_CC1E, TIM_OCM_PWM1},
    [PM_LEG_LOWER] = {TIM_CCER_CC1NE, TIM_OCM_PWM2},
    [PM_LEG_HIGH] = {LEG, TIM_OCM_HIGH},
    [PM_LEG_LOW] = {LEG, TIM_OCM_LOW},
    [PM_LEG_INVERTED] = {LEG, TIM_OCM_PWM2},
    [PM_LEG_LOWER_INVERTED] = {TIM_CCER_CC1NE, TIM_OCM_PWM1},
};

__attribute__((noinline)) static void change_states(uint32_t legs)
{
    const uint32_t a = legs & 7U, b = legs >> 4U & 7U, c = legs >> 8U & 7U;
    TIM1.CCER =
        OF_STATE[a].outputs | (uint32_t)OF_STATE[b].outputs << 4U | (uint32_t)OF_STATE[c].outputs << 8U;
    TIM1.CCMR1 = modes_12(OF_STATE[a].mode, OF_STATE[b].mode);
    TIM1.CCMR2 = modes_34(OF_STATE[c].mode);
    port_hal.written = legs;
}

/* For the next COM event. */
static inline void write_states(uint32_t legs)
{
    if (legs != port_hal.written) {
        change_states(legs);
    }
}

/* The states of this period take effect now; those behind its commutation wait for TIM3. */
void bridge_begin_period(void)
{
    write_states(port_hal.legs);
    TIM1.EGR = TIM_EGR_COMG;
#if PM_CARRIES(NEEDS_COMMUTATE)
    write_states(port_hal.then);
#endif
}

void hal_bridge_write(hal_t *hal, const drive_out_t *out)
{
    (void)hal;
    TIM1.CCR1 = out->compare[0][0];
    TIM1.CCR2 = out->compare[1][0];
    TIM1.CCR3 = out->compare[2][0];
    port_hal.legs = out->legs;
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    write_instants(&out->instants);
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    const uint32_t at = out->instants.commutate_at;
    TIM3.CCR1 = at != 0U && at < COMMUTATE_LEAST ? COMMUTATE_LEAST : at;
    port_hal.then = at != 0U ? out->instants.then : out->legs;
#endif
    if (out->trip != 0U) {
        TIM1.BDTR = port_hal.bridge;
        port_hal.legs = PM_LEGS_OFF;
#if PM_CARRIES(NEEDS_COMMUTATE)
        port_hal.then = PM_LEGS_OFF;
#endif
        write_states(PM_LEGS_OFF); /* for a commutation of this period */
    }
}
#else
#if PM_CARRIES(NEEDS_HELD)
/* A leg that is held follows a compare value that the counter never passes, or never falls below. */
static uint32_t on_time(const drive_out_t *out, uint32_t leg)
{
    const pm_leg_t state = pm_leg(out->legs, leg);
    if (state == PM_LEG_HIGH) {
        return UINT16_MAX;
    }
    return state == PM_LEG_LOW ? 0U : out->compare[leg][0];
}

static uint32_t enables_of(uint32_t legs)
{
    const uint32_t any = legs | legs >> 1U | legs >> 2U;
    return (any & PM_LEGS_PWM) * LEG;
}
#else
static uint32_t on_time(const drive_out_t *out, uint32_t leg)
{
    return out->compare[leg][0];
}

/* Each PM_LEG_OFF or PM_LEG_PWM. */
static uint32_t enables_of(uint32_t legs)
{
    return legs * LEG;
}
#endif

void hal_bridge_write(hal_t *hal, const drive_out_t *out)
{
    (void)hal; /* the address of the only instance costs less than a stored pointer */
    TIM1.CCR1 = on_time(out, 0);
    TIM1.CCR2 = on_time(out, 1);
    TIM1.CCR3 = on_time(out, 2);
    port_hal.legs = enables_of(out->legs);
    if (out->trip != 0U) {
        TIM1.BDTR = port_hal.bridge;
        port_hal.legs = 0U;
    }
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    /* last: with little ahead of it, the compiler takes the branch out of the usual path */
    write_instants(&out->instants);
#endif
}
#endif

bool hal_bridge_arm(hal_t *hal)
{
    if (hal->refused) {
        return false;
    }
    processor_lock(); /* a trip does not fall between the two */
    if ((TIM1.SR & BREAKS) == 0U) {
        TIM1.BDTR = hal->bridge | TIM_BDTR_MOE;
    }
    processor_unlock();
    return hal_bridge_armed(hal);
}

void hal_bridge_off(hal_t *hal)
{
    TIM1.BDTR = hal->bridge;
}

bool hal_bridge_armed(const hal_t *hal)
{
    (void)hal;
    return (TIM1.BDTR & TIM_BDTR_MOE) != 0U;
}
