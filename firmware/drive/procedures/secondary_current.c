#include "firmware/drive/procedures/injected.h"
#include "firmware/math/compiler.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(secondary_current)

#define LOCK_MS 30U
#define MOST    256U /* values, */
#define MOST_MS 512U /* and what they take */
#define SHARE   1024

void procedure_secondary_current_begin(drive_t *drive)
{
    const bool goes_on = drive->stage == STAGE_VECTOR;
    drive->beside.secondary_current = (secondary_current_t){.ms = goes_on ? (uint16_t)LOCK_MS : 0U,
                                                            .wanted = drive->config.polarity.values};
    if (!goes_on) {
        start_injection(drive, drive->sequence.theta);
    }
    drive->beside.secondary_current.theta = drive->position.pll.theta;
}

/* In phase with saturation, and a quarter of its period before. A period may come between two of the samples and renew
 * one: it is of the same phase. */
static pm_dq_t second_harmonic_of(const pulsating_sine_t *source, const sine_config_t *c)
{
    int64_t cosine = 0, sine = 0;
    for (uint32_t at = 0; at < c->n; at++) {
        const pm_dir_t twice = pm_dir(2U * ((pm_angle_t)at * c->step - c->lag));
        const int32_t x = source->sine.window.x[at].d;
        cosine += (int64_t)x * twice.cos;
        sine += (int64_t)x * twice.sin;
    }
    const pm_dir_t phase = pm_dir(2U * pm_atan2(source->phase.sin, source->phase.cos));
    const pm_ab_t x = {window_amplitude(cosine, c->per_n), window_amplitude(sine, c->per_n)};
    const pm_dq_t half = pm_park(x, phase);
    return (pm_dq_t){2 * half.d, 2 * half.q};
}

static pm_q_t alike(pm_q_t y, pm_q_t x)
{
    return pm_max(x > 0 ? y : -y, 0);
}

/* Of what is beside, that which saturation does not make: all with the sign of x, else beyond half of x. */
static pm_q_t strange(pm_q_t y, pm_q_t x)
{
    return pm_max(alike(y, x), pm_abs(y) - pm_abs(x) / 2);
}

/* What the inverter may have made of it. */
static pm_q_t allowance(const drive_t *drive)
{
    const secondary_current_t *self = &drive->beside.secondary_current;
    const pm_q_t x = polarity_mean(&self->x);
    const pm_q_t h_d = drive->config.polarity.h_d;
    const pm_q_t v_h = drive->config.position.injection.pulsating_sine.sine.v_h;
    const pm_q_t v = alike(polarity_mean(&self->v), x);
    return strange(polarity_mean(&self->beside), x) + pm_mul(pm_div(v + v / 2, v_h), h_d) + h_d / SHARE;
}

static pm_procedure_t judge(drive_t *drive)
{
    secondary_current_t *self = &drive->beside.secondary_current;
    const polarity_config_t *c = &drive->config.polarity;
    const obs_out_t last = injection_last(&drive->position.injection, &drive->config.position.injection);
    if (last.vector.d < c->h_d / 4) {
        return PM_FAILED_NO_CURRENT;
    }
    if (!inject_stays(drive, self->theta)) {
        return PM_FAILED_SALIENCY;
    }
    pm_sigma_t margin;
    bool north;
    const pm_q_t noise = pm_max(polarity_noise(&self->x), polarity_rest(c->noise, self->x.count));
    const pm_procedure_t result =
        polarity_judge(c, polarity_mean(&self->x), allowance(drive), noise, &margin, &north);
    if (result == PM_DONE) {
        leave_polarity(drive, margin, north);
    } else if (self->wanted < MOST && 2U * self->wanted * c->block_ms <= MOST_MS) {
        self->wanted = (uint16_t)(2U * self->wanted);
        return PM_RUNNING;
    } else {
        /* the machine saturates too little for this carrier */
    }
    return result;
}

PM_APART pm_procedure_t procedure_secondary_current_slow(drive_t *drive)
{
    secondary_current_t *self = &drive->beside.secondary_current;
    const injection_config_t *injection = &drive->config.position.injection;
    if (injection->id != INJECTION_pulsating_sine || drive->config.polarity.block_ms == 0U) {
        return PM_FAILED_POLARITY;
    }
    self->ms++;
    if (self->ms <= LOCK_MS) {
        self->theta = drive->position.pll.theta;
        return PM_RUNNING;
    }
    if (self->x.count >= self->wanted) {
        return judge(
            drive); /* a millisecond behind the last block: with that it does not fit in a period of 20 kHz */
    }
    if ((self->ms - LOCK_MS) % drive->config.polarity.block_ms != 0U) {
        return PM_RUNNING;
    }
    const pm_dq_t second =
        second_harmonic_of(&drive->position.injection.pulsating_sine, &injection->pulsating_sine.sine);
    polarity_add(&self->x, second.d);
    polarity_add(&self->beside, second.q);
    polarity_add(&self->v, pm_narrow(drive->voltage.v.d));
    return PM_RUNNING;
}

void procedure_secondary_current_abort(drive_t *drive)
{
    (void)drive;
}

#endif
