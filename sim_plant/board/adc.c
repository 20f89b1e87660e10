#include "sim_plant/board/adc.h"

#include "sim_plant/board/adc_internal.h"
#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <string.h>

#define IRQ           18
#define REGULATOR_S   20e-6 /* DS12589 5.3.20 */
#define READY_S       1e-6
#define CALIBRATION   116.0 /* clocks of the converter */
#define AFTER_CAL     4.0
#define CONVERSION    12.5
#define LATENCY       2.125 /* from trigger to sampling */
#define LATENCY_ABORT 3.125 /* breaking off a regular conversion */
#define RISING        1u    /* of JEXTEN */
#define FALLING       2u
#define JQDIS         0x80000000u
#define FLAGS         (ADC_ADRDY | ADC_EOC | ADC_EOS | ADC_JEOC | ADC_JEOS)
#define CCR           0x08u

static const board_register_t list[] = {
    {ADC_ISR, "ISR", 0, 0x7FFu, 0},
    {ADC_IER, "IER", 0, ADC_EOC | ADC_JEOC | ADC_JEOS, 0},
    {ADC_CR, "CR", ADC_DEEPPWD,
     ADC_ADEN | ADC_ADSTART | ADC_JADSTART | ADC_ADVREGEN | ADC_DEEPPWD | ADC_ADCAL, 0},
    {ADC_CFGR, "CFGR", JQDIS, 0x00001000u, 0},
    {ADC_SMPR1, "SMPR1", 0, 0x3FFFFFFFu, 0},
    {ADC_SMPR2, "SMPR2", 0, 0x07FFFFFFu, 0},
    {ADC_SQR1, "SQR1", 0, 0x7C0u, 0},
    {ADC_DR, "DR", 0, 0, 0xFFFFu},
    {ADC_JSQR, "JSQR", 0, 0xFBEFBFFFu, 0},
    {ADC_JDR1, "JDR1", 0, 0, 0xFFFFu},
    {ADC_JDR1 + 4, "JDR2", 0, 0, 0xFFFFu},
    {ADC_JDR1 + 8, "JDR3", 0, 0, 0xFFFFu},
    {ADC_JDR1 + 12, "JDR4", 0, 0, 0xFFFFu},
};
static const board_register_t common_list[] = {{CCR, "CCR", 0, 0x00430000u, 0}};

static void due(void *owner, uint64_t cycle);

void adc_init(adc_t *adc, board_chip_t *chip)
{
    *adc = (adc_t){.chip = chip};
    board_registers_init(&adc->common, chip->cpu, "ADC12", common_list, 1);
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        adc->converter[n] = (adc_converter_t){.chip = chip, .which = n};
        board_registers_init(&adc->converter[n].regs, chip->cpu, n == 0 ? "ADC1" : "ADC2", list,
                             sizeof list / sizeof *list);
    }
}

void adc_reset(adc_t *adc)
{
    board_registers_reset(&adc->common);
    adc->seen_at = UINT64_MAX;
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        adc_converter_t *c = &adc->converter[n];
        board_registers_reset(&c->regs);
        c->regulator_s = (double)INFINITY;
        c->calibrated = c->ready = c->regular_hold = c->regular_end = UINT64_MAX;
        c->rank = c->ranks = c->converted = 0;
    }
    cpu_alarm(adc->chip->cpu, adc, UINT64_MAX, due);
    cpu_irq(adc->chip->cpu, IRQ, false);
}

static uint64_t clocks(const adc_converter_t *c, double number)
{
    return (uint64_t)ceil(number * adc_divider(&c->chip->adc));
}

static bool on(const adc_converter_t *c, uint64_t cycle)
{
    return (c->regs.value[ADC_CR / 4] & ADC_ADEN) != 0u && cycle >= c->ready;
}

bool adc_regular_runs(const adc_converter_t *c)
{
    return c->regular_end != UINT64_MAX;
}

static uint64_t injected_end(const adc_converter_t *c)
{
    return c->converted < c->ranks ? c->end[c->ranks - 1] : 0u;
}

void adc_start_regular(adc_converter_t *c, uint64_t cycle)
{
    uint32_t channel = board_field(c->regs.value[ADC_SQR1 / 4], 6, 5);
    c->regular_held = false;
    c->regular_hold = cycle + adc_sampling(c, channel);
    c->regular_end = c->regular_hold + clocks(c, CONVERSION);
}

void adc_signal(adc_t *adc)
{
    bool level = false;
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        const uint32_t *value = adc->converter[n].regs.value;
        level = level || (value[ADC_ISR / 4] & value[ADC_IER / 4]) != 0u;
    }
    cpu_irq(adc->chip->cpu, IRQ, level);
}

/* One alarm at the next end that an interrupt waits for; everything else is looked up when it is asked for.
 */
static void plan(adc_t *adc)
{
    uint64_t next = UINT64_MAX;
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        const adc_converter_t *c = &adc->converter[n];
        uint32_t enabled = c->regs.value[ADC_IER / 4];
        if (c->converted < c->ranks && (enabled & (ADC_JEOC | ADC_JEOS)) != 0u) {
            int rank = (enabled & ADC_JEOC) != 0u ? c->converted : c->ranks - 1;
            next = c->end[rank] < next ? c->end[rank] : next;
        }
        if ((enabled & ADC_EOC) != 0u && c->regular_end < next) {
            next = c->regular_end;
        }
    }
    cpu_alarm(adc->chip->cpu, adc, next, due);
}

static void trigger_one(adc_converter_t *c, uint64_t cycle, adc_source_t source, bool rises)
{
    uint32_t jsqr = c->regs.value[ADC_JSQR / 4];
    bool armed = (c->regs.value[ADC_CR / 4] & ADC_JADSTART) != 0u;
    if (!armed || !on(c, cycle) || board_field(jsqr, 2, 5) != source ||
        (board_field(jsqr, 7, 2) & (rises ? RISING : FALLING)) == 0u) {
        return;
    }
    if (c->converted < c->ranks) {
        return; /* a trigger during the sequence is ignored: RM0440 21.4.18 */
    }
    bool aborts = adc_regular_runs(c);
    uint64_t at = cycle + clocks(c, aborts ? LATENCY_ABORT : LATENCY);
    static const int place[ADC_RANKS] = {9, 15, 21, 27};
    c->ranks = (int)board_field(jsqr, 0, 2) + 1;
    c->rank = c->converted = 0;
    for (int n = 0; n < c->ranks; n++) {
        c->hold[n] = at + adc_sampling(c, board_field(jsqr, place[n], 5));
        c->end[n] = at = c->hold[n] + clocks(c, CONVERSION);
    }
    if (c->chip->wiring.converter_stuck) {
        for (int n = 0; n < c->ranks; n++) {
            c->hold[n] = c->end[n] = UINT64_MAX;
        }
    } else if (aborts) {
        adc_start_regular(c, at);
    }
}

void adc_trigger(adc_t *adc, uint64_t cycle, adc_source_t source, bool rises)
{
    adc_sync(adc, cycle);
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        trigger_one(&adc->converter[n], cycle, source, rises);
    }
    plan(adc);
}

static const plant_adc_t *look(adc_t *adc, uint64_t cycle)
{
    if (adc->seen_at != cycle) {
        plant_sample_at(adc->chip->plant, board_within_s(adc->chip, cycle), &adc->seen);
        adc->seen_at = cycle;
    }
    return &adc->seen;
}

static uint64_t next_hold(const adc_converter_t *c)
{
    uint64_t injected = c->rank < c->ranks ? c->hold[c->rank] : UINT64_MAX;
    uint64_t regular = c->regular_held ? UINT64_MAX : c->regular_hold;
    return injected < regular ? injected : regular;
}

static void take(adc_t *adc, adc_converter_t *c)
{
    static const int place[ADC_RANKS] = {9, 15, 21, 27};
    if (c->rank < c->ranks && (c->regular_held || c->hold[c->rank] <= c->regular_hold)) {
        uint32_t channel = board_field(c->regs.value[ADC_JSQR / 4], place[c->rank], 5);
        c->code[c->rank] = adc_input(c, channel, look(adc, c->hold[c->rank]));
        c->rank++;
        return;
    }
    uint32_t channel = board_field(c->regs.value[ADC_SQR1 / 4], 6, 5);
    c->regular_code = adc_input(c, channel, look(adc, c->regular_hold));
    c->regular_held = true;
}

void adc_sample_until(adc_t *adc, uint64_t cycle)
{
    for (;;) {
        adc_converter_t *first = &adc->converter[0];
        if (next_hold(&adc->converter[1]) < next_hold(first)) {
            first = &adc->converter[1];
        }
        uint64_t hold = next_hold(first);
        if (hold > cycle || hold == UINT64_MAX) {
            return;
        }
        take(adc, first);
    }
}

static void finish(adc_converter_t *c, uint64_t cycle)
{
    uint32_t *isr = board_register(&c->regs, ADC_ISR);
    while (c->converted < c->ranks && c->end[c->converted] <= cycle) {
        *board_register(&c->regs, ADC_JDR1 + 4u * (uint32_t)c->converted) = c->code[c->converted];
        c->converted++;
        *isr |= ADC_JEOC | (c->converted == c->ranks ? ADC_JEOS : 0u);
    }
    if (c->regular_end <= cycle) {
        *board_register(&c->regs, ADC_DR) = c->regular_code;
        *isr |= ADC_EOC | ADC_EOS;
        *board_register(&c->regs, ADC_CR) &= ~ADC_ADSTART;
        c->regular_hold = c->regular_end = UINT64_MAX;
    }
    if (c->calibrated <= cycle) {
        *board_register(&c->regs, ADC_CR) &= ~ADC_ADCAL;
    }
    if (c->ready <= cycle && (c->regs.value[ADC_CR / 4] & ADC_ADEN) != 0u) {
        *isr |= ADC_ADRDY;
    }
}

void adc_sync(adc_t *adc, uint64_t cycle)
{
    adc_sample_until(adc, cycle);
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        finish(&adc->converter[n], cycle);
    }
    adc_signal(adc);
}

static void due(void *owner, uint64_t cycle)
{
    adc_t *adc = owner;
    adc_sync(adc, cycle);
    plan(adc);
}

void adc_release(adc_t *adc)
{
    for (int n = 0; n < ADC_CONVERTERS; n++) {
        adc->converter[n].rank = adc->converter[n].ranks = adc->converter[n].converted = 0;
    }
    plan(adc);
}

static void refuse(const adc_converter_t *c, const char *what)
{
    cpu_fail(c->chip->cpu, "ADC%d_%s", c->which + 1, what);
}

/* Bits that start something: writing zero leaves them. RM0440 21.6.3 */
static void write_cr(adc_converter_t *c, uint32_t before, uint64_t now)
{
    const rcc_t *rcc = &c->chip->rcc;
    const uint32_t set_only = ADC_ADEN | ADC_ADSTART | ADC_JADSTART | ADC_ADCAL;
    uint32_t *cr = board_register(&c->regs, ADC_CR);
    *cr |= before & set_only;
    uint32_t rises = *cr & ~before;
    if ((rises & ADC_ADVREGEN) != 0u) {
        c->regulator_s = rcc_seconds(rcc) + REGULATOR_S;
        if ((*cr & ADC_DEEPPWD) != 0u) {
            refuse(c, "CR: regulator on in deep power-down");
        }
    }
    if ((before & ~*cr & ADC_ADVREGEN) != 0u && (before & ADC_ADEN) != 0u) {
        refuse(c, "CR: regulator off while the converter is on");
    }
    if ((rises & (ADC_ADCAL | ADC_ADEN)) != 0u && rcc_seconds(rcc) < c->regulator_s) {
        refuse(c, "CR: calibration or start before the regulator is up");
    }
    if ((rises & ADC_ADCAL) != 0u) {
        if (((before | *cr) & ADC_ADEN) != 0u) {
            refuse(c, "CR: calibration while the converter is on");
        }
        c->calibrated = now + clocks(c, CALIBRATION);
    }
    if ((rises & ADC_ADEN) != 0u) {
        if (c->calibrated == UINT64_MAX || now < c->calibrated + clocks(c, AFTER_CAL)) {
            refuse(c, "CR: start without calibration, or less than four clocks after it");
        }
        c->ready = now + rcc_cycles(rcc, READY_S);
    }
    if ((rises & (ADC_ADSTART | ADC_JADSTART)) != 0u && !on(c, now)) {
        refuse(c, "CR: conversions asked of a converter that is not ready");
    }
    if ((rises & ADC_JADSTART) != 0u && (board_field(c->regs.value[ADC_JSQR / 4], 7, 2) & RISING) == 0u) {
        refuse(c, "JSQR: injected conversions without a rising trigger are not modelled");
    }
    if ((rises & ADC_ADSTART) != 0u) {
        uint64_t free = injected_end(c);
        adc_start_regular(c, (free > now ? free : now) + clocks(c, LATENCY));
        if (c->chip->wiring.converter_stuck) {
            c->regular_hold = c->regular_end = UINT64_MAX;
        }
    }
}

static void check_idle(const adc_converter_t *c, uint32_t offset, uint32_t before)
{
    uint32_t busy = c->regs.value[ADC_CR / 4] & (ADC_ADSTART | ADC_JADSTART);
    bool any = offset == ADC_SMPR1 || offset == ADC_SMPR2 || offset == ADC_CFGR;
    uint32_t bars = any ? busy : (offset == ADC_JSQR ? busy & ADC_JADSTART : busy & ADC_ADSTART);
    if (bars != 0u && before != c->regs.value[offset / 4]) {
        refuse(c, "CFGR, SMPR, SQR1 or JSQR: write while conversions run");
    }
}

static bool converter_write(adc_converter_t *c, uint32_t offset, uint32_t value, uint32_t mask)
{
    uint64_t now = cpu_now(c->chip->cpu);
    uint32_t before = c->regs.value[offset / 4];
    if (!board_registers_write(&c->regs, offset, value, mask)) {
        return false;
    }
    if (offset == ADC_ISR) {
        *board_register(&c->regs, ADC_ISR) = before & ~(value & mask & FLAGS);
    } else if (offset == ADC_CR) {
        write_cr(c, before, now);
    } else if (offset != ADC_IER) {
        check_idle(c, offset, before);
    }
    return true;
}

static bool adc_read(void *self, uint32_t offset, uint32_t *value)
{
    adc_t *adc = self;
    adc_sync(adc, cpu_now(adc->chip->cpu));
    if (offset >= 0x300u) {
        return board_registers_read(&adc->common, offset - 0x300u, value);
    }
    adc_converter_t *c = &adc->converter[offset / 0x100u % ADC_CONVERTERS];
    if (offset >= 0x200u || !board_registers_read(&c->regs, offset % 0x100u, value)) {
        return false;
    }
    if (offset % 0x100u == ADC_DR) {
        *board_register(&c->regs, ADC_ISR) &= ~ADC_EOC;
        adc_signal(adc);
    }
    return true;
}

static bool adc_write(void *self, uint32_t offset, uint32_t value, uint32_t mask)
{
    adc_t *adc = self;
    adc_sync(adc, cpu_now(adc->chip->cpu));
    if (offset >= 0x300u) {
        bool busy = ((adc->converter[0].regs.value[ADC_CR / 4] | adc->converter[1].regs.value[ADC_CR / 4]) &
                     (ADC_ADEN | ADC_ADCAL)) != 0u;
        if (busy) {
            cpu_fail(adc->chip->cpu, "ADC12_CCR: write while a converter is on");
        }
        return board_registers_write(&adc->common, offset - 0x300u, value, mask);
    }
    if (offset >= 0x200u ||
        !converter_write(&adc->converter[offset / 0x100u], offset % 0x100u, value, mask)) {
        return false;
    }
    adc_signal(adc);
    plan(adc);
    return true;
}

cpu_device_t adc_device(adc_t *adc)
{
    return (cpu_device_t){"ADC12", 0x50000000u, 0x400u, adc, adc_read, adc_write};
}
