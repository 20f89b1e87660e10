#include "sim_plant/board/rcc.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>

#define HSI_HZ      16000000u
#define HSE_HZ      8000000u /* crystal of the board */
#define HSI_START_S 1e-6     /* DS12589 5.3: typical */
#define HSE_START_S 2e-3
#define PLL_LOCK_S  40e-6
#define LSI_START_S 130e-6
#define STEP_HZ     80000000u /* a larger step goes through half the frequency */
#define STEP_S      1e-6
#define BOOST_HZ    150000000u
#define MOST_HZ     170000000u

enum {
    CR = 0x00,
    CFGR = 0x08,
    PLLCFGR = 0x0C,
    CIER = 0x18,
    CIFR = 0x1C,
    CICR = 0x20,
    CCIPR = 0x88,
    CSR = 0x94
};
enum { PWR_CR1 = 0x00, PWR_CR2 = 0x04, PWR_CR5 = 0x80 };

#define HSION  0x00000100u
#define HSIRDY 0x00000400u
#define HSEON  0x00010000u
#define HSERDY 0x00020000u
#define CSSON  0x00080000u
#define PLLON  0x01000000u
#define PLLRDY 0x02000000u
#define CSSF   0x00000100u
#define LSION  0x00000001u
#define LSIRDY 0x00000002u
#define RMVF   0x00800000u
#define CAUSES 0xFE000000u

static const board_register_t list[] = {
    {CR, "CR", 0x00000500u, HSION | HSEON | CSSON | PLLON, HSIRDY | HSERDY | PLLRDY},
    {CFGR, "CFGR", 0x00000005u, 0x000000F3u, 0x0000000Cu},
    {PLLCFGR, "PLLCFGR", 0x00001000u, 0x07007FF3u, 0},
    {CIER, "CIER", 0, 0, 0},
    {CIFR, "CIFR", 0, 0, CSSF},
    {CICR, "CICR", 0, CSSF, 0},
    {RCC_AHB1ENR, "AHB1ENR", 0x00000100u, 0, 0},
    {RCC_AHB2ENR, "AHB2ENR", 0, 0x00042007u, 0},             /* GPIOA to C, ADC12, DAC3 */
    {RCC_APB1ENR1, "APB1ENR1", 0x00000400u, 0x12020007u, 0}, /* PWR, FDCAN, USART2, TIM4 to TIM2 */
    {RCC_APB2ENR, "APB2ENR", 0, 0x00000801u, 0},             /* TIM1, SYSCFG */
    {CCIPR, "CCIPR", 0, 0x33000000u, 0},
    {CSR, "CSR", 0, LSION | RMVF, LSIRDY | CAUSES},
};

static const board_register_t power_list[] = {
    {PWR_CR1, "CR1", 0x00000200u, 0, 0},
    {PWR_CR2, "CR2", 0, 0x0000000Fu, 0}, /* PVDE, PLS */
    {PWR_CR5, "CR5", 0x00000100u, 0x00000100u, 0},
};

bool rcc_enabled(const rcc_t *rcc, uint32_t enable_register, uint32_t bit)
{
    return (rcc->regs.value[enable_register / 4] & bit) != 0u;
}

double rcc_seconds(const rcc_t *rcc)
{
    return rcc->since_s + (double)(cpu_now(rcc->chip->cpu) - rcc->since_cycle) / rcc->clock_Hz;
}

uint64_t rcc_cycles(const rcc_t *rcc, double seconds)
{
    return (uint64_t)ceil(seconds * rcc->clock_Hz);
}

bool rcc_boost(const rcc_t *rcc)
{
    return (rcc->pwr.value[PWR_CR5 / 4] & 0x100u) == 0u;
}

bool rcc_fdcan_on_pclk(const rcc_t *rcc)
{
    return board_field(rcc->regs.value[CCIPR / 4], 24, 2) == 2u;
}

bool rcc_failed(const rcc_t *rcc)
{
    return (rcc->regs.value[CIFR / 4] & CSSF) != 0u;
}

bool rcc_supply_low(const rcc_t *rcc)
{
    /* falling, DS12589 5.3.4, typical */
    static const double threshold_V[] = {2.05, 2.20, 2.36, 2.52, 2.64, 2.81, 2.90, 0.0};
    uint32_t cr2 = rcc->pwr.value[PWR_CR2 / 4];
    return (cr2 & 1u) != 0u && rcc->chip->wiring.supply_V < threshold_V[board_field(cr2, 1, 3)];
}

static bool ready(const rcc_t *rcc, double ready_s)
{
    return rcc_seconds(rcc) >= ready_s;
}

/* What the PLL gives; 0 after an error. */
static double pll_Hz(rcc_t *rcc)
{
    uint32_t set = rcc->regs.value[PLLCFGR / 4];
    uint32_t source = board_field(set, 0, 2);
    double in_Hz = (source == 3u ? HSE_HZ : HSI_HZ) / (board_field(set, 4, 4) + 1.0);
    double vco_Hz = in_Hz * board_field(set, 8, 7);
    if (source < 2u || in_Hz < 2.66e6 || in_Hz > 16e6 || vco_Hz < 96e6 || vco_Hz > 344e6 ||
        board_field(set, 8, 7) < 8u || (set & 0x01000000u) == 0u) {
        cpu_fail(rcc->chip->cpu,
                 "RCC_PLLCFGR 0x%08x: input %.2f MHz, VCO %.2f MHz or output R outside their ranges",
                 (unsigned)set, 1e-6 * in_Hz, 1e-6 * vco_Hz);
        return 0.0;
    }
    return vco_Hz / (2.0 * (board_field(set, 25, 2) + 1.0));
}

/* Of AHB, with the source of SWS and the prescaler. */
static double ahb_Hz(rcc_t *rcc)
{
    uint32_t set = rcc->regs.value[CFGR / 4];
    uint32_t source = board_field(set, 2, 2);
    double Hz = source == 1u ? HSI_HZ : (source == 2u ? HSE_HZ : pll_Hz(rcc));
    uint32_t prescaler = board_field(set, 4, 4);
    static const double divider[] = {2.0, 4.0, 8.0, 16.0, 64.0, 128.0, 256.0, 512.0};
    return prescaler < 8u ? Hz : Hz / divider[prescaler - 8u];
}

static void set_clock(rcc_t *rcc)
{
    double Hz = ahb_Hz(rcc);
    if (Hz <= 0.0) {
        return;
    }
    if (Hz > (rcc_boost(rcc) ? MOST_HZ : BOOST_HZ)) {
        cpu_fail(rcc->chip->cpu, "RCC: %.1f MHz is too fast for this voltage range", 1e-6 * Hz);
    }
    rcc->since_s = rcc_seconds(rcc);
    rcc->since_cycle = cpu_now(rcc->chip->cpu);
    rcc->clock_Hz = (uint32_t)lround(Hz);
    flash_check_clock(&rcc->chip->flash);
    iwdg_clock_changed(&rcc->chip->iwdg);
}

void rcc_init(rcc_t *rcc, board_chip_t *chip)
{
    *rcc = (rcc_t){.chip = chip, .clock_Hz = HSI_HZ};
    board_registers_init(&rcc->regs, chip->cpu, "RCC", list, sizeof list / sizeof *list);
    board_registers_init(&rcc->pwr, chip->cpu, "PWR", power_list, sizeof power_list / sizeof *power_list);
}

void rcc_reset(rcc_t *rcc, uint32_t cause)
{
    uint32_t causes = (rcc->regs.value[CSR / 4] & CAUSES) | cause | RCC_PIN_RESET;
    double now_s = rcc_seconds(rcc);
    rcc->since_s = now_s;
    rcc->since_cycle = cpu_now(rcc->chip->cpu);
    rcc->clock_Hz = HSI_HZ;
    board_registers_reset(&rcc->regs);
    board_registers_reset(&rcc->pwr);
    rcc->regs.value[CSR / 4] = cause == RCC_POWER_RESET ? cause | RCC_PIN_RESET : causes;
    rcc->hsi_ready_s = now_s;
    rcc->hse_ready_s = rcc->pll_ready_s = rcc->lsi_ready_s = (double)INFINITY;
    rcc->switched_s = now_s;
    cpu_irq(rcc->chip->cpu, CPU_NMI, false);
}

void rcc_start_lsi(rcc_t *rcc)
{
    if (!isfinite(rcc->lsi_ready_s)) {
        rcc->lsi_ready_s = rcc_seconds(rcc) + LSI_START_S;
    }
}

static void hse_start(rcc_t *rcc)
{
    rcc->hse_ready_s =
        rcc->chip->wiring.oscillator_stopped ? (double)INFINITY : rcc_seconds(rcc) + HSE_START_S;
}

void rcc_oscillator(rcc_t *rcc, bool stopped)
{
    uint32_t *cr = board_register(&rcc->regs, CR);
    uint32_t *cfgr = board_register(&rcc->regs, CFGR);
    bool was_ready = ready(rcc, rcc->hse_ready_s);
    if (!stopped) {
        if ((*cr & HSEON) != 0u && !was_ready) {
            hse_start(rcc);
        }
        return;
    }
    rcc->hse_ready_s = (double)INFINITY;
    bool pll_on_hse = board_field(rcc->regs.value[PLLCFGR / 4], 0, 2) == 3u && (*cr & PLLON) != 0u;
    uint32_t source = board_field(*cfgr, 2, 2);
    bool used = source == 2u || (source == 3u && pll_on_hse);
    if (!was_ready) {
        return;
    }
    if ((*cr & CSSON) == 0u) {
        if (used) {
            cpu_fail(rcc->chip->cpu,
                     "RCC: the oscillator that clocks the processor has stopped, and no CSS is on");
        }
        return;
    }
    *cr &= ~(HSEON | CSSON);
    *board_register(&rcc->regs, CIFR) |= CSSF;
    if (used) {
        *cfgr = (*cfgr & ~0xFu) | 0x5u;
        *cr = (*cr & ~(pll_on_hse ? PLLON : 0u)) | HSION;
        rcc->hsi_ready_s = rcc_seconds(rcc);
        rcc->pll_ready_s = pll_on_hse ? (double)INFINITY : rcc->pll_ready_s;
        set_clock(rcc);
    }
    tim1_system_break(&rcc->chip->tim1);
    cpu_irq(rcc->chip->cpu, CPU_NMI, true);
}

static void write_cr(rcc_t *rcc, uint32_t before)
{
    uint32_t now = rcc->regs.value[CR / 4];
    uint32_t on = now & ~before;
    uint32_t off = before & ~now;
    uint32_t source = board_field(rcc->regs.value[CFGR / 4], 2, 2);
    if ((off & HSION && source == 1u) || (off & HSEON && source == 2u) || (off & PLLON && source == 3u)) {
        cpu_fail(rcc->chip->cpu, "RCC_CR: the source of the system clock is switched off");
    }
    if (on & HSION) {
        rcc->hsi_ready_s = rcc_seconds(rcc) + HSI_START_S;
    }
    if (on & HSEON) {
        hse_start(rcc);
    }
    if (on & PLLON) {
        bool hse = board_field(rcc->regs.value[PLLCFGR / 4], 0, 2) == 3u;
        if (!ready(rcc, hse ? rcc->hse_ready_s : rcc->hsi_ready_s)) {
            cpu_fail(rcc->chip->cpu, "RCC_CR: PLL on before its source is ready");
        }
        bool locks = pll_Hz(rcc) > 0.0 && !rcc->chip->wiring.pll_fails;
        rcc->pll_ready_s = locks ? rcc_seconds(rcc) + PLL_LOCK_S : (double)INFINITY;
    }
    rcc->hsi_ready_s = off & HSION ? (double)INFINITY : rcc->hsi_ready_s;
    rcc->hse_ready_s = off & HSEON ? (double)INFINITY : rcc->hse_ready_s;
    rcc->pll_ready_s = off & PLLON ? (double)INFINITY : rcc->pll_ready_s;
    if (off & CSSON) {
        *board_register(&rcc->regs, CR) |= CSSON; /* only a reset or a failure takes it off */
    }
}

static void write_cfgr(rcc_t *rcc, uint32_t before)
{
    uint32_t *cfgr = board_register(&rcc->regs, CFGR);
    uint32_t source = board_field(*cfgr, 0, 2);
    const double ready_s[] = {(double)INFINITY, rcc->hsi_ready_s, rcc->hse_ready_s, rcc->pll_ready_s};
    bool switches = source != board_field(before, 2, 2);
    bool scales = ((*cfgr ^ before) & 0xF0u) != 0u;
    if (!ready(rcc, ready_s[source])) {
        cpu_fail(rcc->chip->cpu, "RCC_CFGR: switch to source %u, which is not ready", (unsigned)source);
        return;
    }
    if ((switches || scales) && tim1_counting(&rcc->chip->tim1)) {
        cpu_fail(rcc->chip->cpu, "RCC_CFGR: the clock changes while TIM1 counts");
        return;
    }
    uint32_t from_Hz = rcc->clock_Hz;
    *cfgr = (*cfgr & ~0xCu) | source * 4u;
    if (scales && !switches && rcc_seconds(rcc) - rcc->switched_s < STEP_S) {
        cpu_fail(rcc->chip->cpu, "RCC_CFGR: the prescaler changes less than 1 us after the source");
    }
    set_clock(rcc);
    if (switches) {
        rcc->switched_s = rcc_seconds(rcc);
        if ((from_Hz <= STEP_HZ && rcc->clock_Hz > STEP_HZ + STEP_HZ / 8u) ||
            (from_Hz > STEP_HZ + STEP_HZ / 8u && rcc->clock_Hz <= STEP_HZ)) {
            cpu_fail(rcc->chip->cpu, "RCC_CFGR: from %.1f to %.1f MHz without an AHB prescaler of 2 between",
                     1e-6 * from_Hz, 1e-6 * rcc->clock_Hz);
        }
    }
}

static bool rcc_read(void *self, uint32_t offset, uint32_t *value)
{
    rcc_t *rcc = self;
    uint32_t *cr = board_register(&rcc->regs, CR);
    uint32_t *csr = board_register(&rcc->regs, CSR);
    *cr = (*cr & ~(HSIRDY | HSERDY | PLLRDY)) | (ready(rcc, rcc->hsi_ready_s) ? HSIRDY : 0u) |
          (ready(rcc, rcc->hse_ready_s) ? HSERDY : 0u) | (ready(rcc, rcc->pll_ready_s) ? PLLRDY : 0u);
    *csr = (*csr & ~LSIRDY) | (ready(rcc, rcc->lsi_ready_s) ? LSIRDY : 0u);
    return board_registers_read(&rcc->regs, offset, value);
}

static bool rcc_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    rcc_t *rcc = self;
    uint32_t before = offset / 4 < BOARD_REGISTERS_MOST ? rcc->regs.value[offset / 4] : 0u;
    if (!board_registers_write(&rcc->regs, offset, value, mask)) {
        return false;
    }
    uint32_t now = rcc->regs.value[offset / 4];
    switch (offset) {
    case CR:
        write_cr(rcc, before);
        break;
    case CFGR:
        write_cfgr(rcc, before);
        break;
    case PLLCFGR:
        if (now != before && (rcc->regs.value[CR / 4] & PLLON) != 0u) {
            cpu_fail(rcc->chip->cpu, "RCC_PLLCFGR: write while the PLL is on");
        }
        break;
    case CICR:
        if (now & CSSF) {
            *board_register(&rcc->regs, CIFR) &= ~CSSF;
            cpu_irq(rcc->chip->cpu, CPU_NMI, false);
        }
        *board_register(&rcc->regs, CICR) = 0u;
        break;
    case CSR:
        if (now & RMVF) {
            *board_register(&rcc->regs, CSR) &= ~(CAUSES | RMVF);
        }
        if ((now & LSION) != 0u) {
            rcc_start_lsi(rcc);
        }
        break;
    default:
        break;
    }
    return true;
}

static bool power_read(void *self, uint32_t offset, uint32_t *value)
{
    rcc_t *rcc = self;
    return board_registers_read(&rcc->pwr, offset, value);
}

static bool power_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    rcc_t *rcc = self;
    uint32_t detector = rcc->pwr.value[PWR_CR2 / 4];
    if (!board_registers_write(&rcc->pwr, offset, value, mask)) {
        return false;
    }
    if (board_misc_locks_detector(&rcc->chip->misc)) {
        *board_register(&rcc->pwr, PWR_CR2) = detector;
    }
    if (board_field(rcc->pwr.value[PWR_CR2 / 4], 1, 3) == 7u) {
        cpu_fail(rcc->chip->cpu, "PWR_CR2: the input PVD_IN is not modelled");
    }
    tim1_check_break(&rcc->chip->tim1);
    return true;
}

cpu_device_t rcc_device(rcc_t *rcc)
{
    return (cpu_device_t){"RCC", 0x40021000u, 0x400u, rcc, rcc_read, rcc_write};
}

cpu_device_t rcc_power_device(rcc_t *rcc)
{
    return (cpu_device_t){"PWR", 0x40007000u, 0x400u, rcc, power_read, power_write};
}
