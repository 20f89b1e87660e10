#include "firmware/drive/procedures/injected.h"
#include "firmware/math/compiler.h"
#include "firmware/math/root.h"

#if PM_HAS(secondary_voltage)

#define LOCK_MS  30U
#define VALUES   8U
#define VALUE_MS 24U

void procedure_secondary_voltage_begin(drive_t *drive)
{
    const bool goes_on = drive->stage == STAGE_VECTOR;
    drive->beside.secondary_voltage = (secondary_voltage_t){.ms = goes_on ? (uint16_t)LOCK_MS : 0U};
    if (!goes_on) {
        start_injection(drive, drive->sequence.theta);
    }
    drive->beside.secondary_voltage.theta = drive->position.pll.theta;
}

static void add_value(drive_t *drive)
{
    secondary_voltage_t *self = &drive->beside.secondary_voltage;
    const zero_second_config_t *config = &drive->config.zero_second;
    const pm_angle_t theta = drive->position.pll.theta;
    const pm_ab_t odd = zero_second_of_pole(config, theta);
    const pm_ab_t even = zero_second_of_either(config, theta);
    const int32_t count = self->count;
    const pm_ab_t w = {self->sum.alpha / count - even.alpha, self->sum.beta / count - even.beta};
    self->r = pm_hypot(odd.alpha, odd.beta);
    const pm_ab_t along = {pm_div(odd.alpha, self->r), pm_div(odd.beta, self->r)};
    polarity_add(&self->x, pm_mul(w.alpha, along.alpha) + pm_mul(w.beta, along.beta));
    polarity_add(&self->y, pm_mul(w.beta, along.alpha) - pm_mul(w.alpha, along.beta));
    self->sum = (pm_ab_t){0, 0};
    self->count = 0;
}

static pm_procedure_t judge(drive_t *drive, uint32_t count)
{
    const secondary_voltage_t *self = &drive->beside.secondary_voltage;
    const polarity_config_t *c = &drive->config.polarity;
    if (zero_rotating_along(&drive->position.injection.zero_rotating,
                            &drive->config.position.injection.zero_rotating,
                            drive->position.pll.theta) < c->h_d / 4) {
        return PM_FAILED_NO_CURRENT;
    }
    if (!inject_stays(drive, self->theta)) {
        return PM_FAILED_SALIENCY;
    }
    pm_sigma_t margin;
    bool north;
    const pm_q_t allowance = pm_max(self->r / 2, pm_abs(polarity_mean(&self->y)));
    const pm_q_t noise = pm_max(polarity_noise(&self->x), polarity_rest(c->noise, VALUES * count));
    const pm_procedure_t result =
        polarity_judge(c, polarity_mean(&self->x), allowance, noise, &margin, &north);
    if (result == PM_DONE) {
        leave_polarity(drive, margin, north);
    }
    return result;
}

PM_APART pm_procedure_t procedure_secondary_voltage_slow(drive_t *drive)
{
    secondary_voltage_t *self = &drive->beside.secondary_voltage;
    const uint16_t block_ms = drive->config.polarity.block_ms;
    if (drive->config.position.injection.id != INJECTION_zero_rotating || block_ms == 0U) {
        return PM_FAILED_POLARITY;
    }
    self->ms++;
    if (self->ms <= LOCK_MS) {
        self->theta = drive->position.pll.theta;
        return PM_RUNNING;
    }
    if ((self->ms - LOCK_MS) % block_ms != 0U) {
        return PM_RUNNING;
    }
    const pm_ab_t z = zero_rotating_second(&drive->position.injection.zero_rotating,
                                           &drive->config.position.injection.zero_rotating);
    self->sum.alpha += z.alpha;
    self->sum.beta += z.beta;
    self->count++;
    const uint32_t count = self->count;
    if (count * block_ms < VALUE_MS) {
        return PM_RUNNING;
    }
    add_value(drive);
    return self->x.count < VALUES ? PM_RUNNING : judge(drive, count);
}

void procedure_secondary_voltage_abort(drive_t *drive)
{
    (void)drive;
}

#endif
