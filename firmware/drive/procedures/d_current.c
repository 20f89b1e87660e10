#include "firmware/drive/procedures/injected.h"
#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/root.h"

#if PM_HAS(d_current)

#define LOCK_MS  30U /* of a position that another has found */
#define RAMP_MS  8U
#define DWELL_MS 8U
#define SHARE    128 /* of the answer: a difference that is none */

enum { PART_LOCK, PART_NORTH, PART_SOUTH, PART_BACK };

void procedure_d_current_begin(drive_t *drive)
{
    const bool goes_on = drive->stage == STAGE_VECTOR;
    drive->beside.d_current = (d_current_t){.part = goes_on ? PART_NORTH : PART_LOCK, .result = PM_RUNNING};
    if (!goes_on) {
        start_injection(drive, drive->sequence.theta);
    }
    drive->beside.d_current.theta = drive->position.pll.theta;
}

static pm_q_t answer(const drive_t *drive)
{
#if PM_HAS(zero_rotating)
    if (drive->config.position.injection.id == INJECTION_zero_rotating) {
        return zero_rotating_along(&drive->position.injection.zero_rotating,
                                   &drive->config.position.injection.zero_rotating,
                                   drive->position.pll.theta);
    }
#endif
    const obs_out_t last = injection_last(&drive->position.injection, &drive->config.position.injection);
    return last.vector.d;
}

static pm_procedure_t judge(drive_t *drive)
{
    d_current_t *self = &drive->beside.d_current;
    const polarity_config_t *c = &drive->config.polarity;
    if (self->first < c->h_d / 4) {
        return PM_FAILED_NO_CURRENT;
    }
    const pm_q_t noise = pm_hypot(polarity_noise(&self->h[0]), polarity_noise(&self->h[1]));
    const pm_q_t difference = polarity_mean(&self->h[0]) - polarity_mean(&self->h[1]);
    bool north;
    const pm_procedure_t result =
        polarity_judge(c, difference, self->first / SHARE,
                       pm_max(noise, polarity_rest(c->noise, self->h[0].count)), &self->margin, &north);
    if (result == PM_DONE) {
        self->margin = north ? self->margin : -self->margin;
    }
    return result;
}

/* One direction; true when it has been measured. */
static bool measure_at(drive_t *drive, uint32_t part)
{
    d_current_t *self = &drive->beside.d_current;
    const polarity_config_t *c = &drive->config.polarity;
    const pm_q_t wanted = part == (uint32_t)PART_NORTH ? c->i_d : -c->i_d;
    const pm_q_t step = (c->i_d / (int32_t)RAMP_MS) + 1;
    drive->i_ref.d = pm_approach(drive->i_ref.d, wanted, step);
    const uint32_t settled = (part == (uint32_t)PART_NORTH ? RAMP_MS : 2U * RAMP_MS) + DWELL_MS;
    if (self->ms < settled || (self->ms - settled) % c->block_ms != 0U) {
        return false;
    }
    polarity_mean_t *h = &self->h[part == (uint32_t)PART_NORTH ? 0 : 1];
    const pm_q_t x = answer(drive);
    if (part == (uint32_t)PART_NORTH && h->count == 0U) {
        self->first = x;
    }
    polarity_add(h, x - self->first);
    return h->count >= c->values / 2U;
}

static pm_procedure_t conclude(drive_t *drive)
{
    d_current_t *self = &drive->beside.d_current;
    const pm_q_t step = (drive->config.polarity.i_d / (int32_t)RAMP_MS) + 1;
    drive->i_ref.d += pm_clamp(-drive->i_ref.d, -step, step);
    if (self->ms < RAMP_MS + DWELL_MS) {
        return PM_RUNNING;
    }
    if (self->result == (uint8_t)PM_DONE) {
        leave_polarity(drive, pm_abs(self->margin), self->margin > 0);
    }
    return (pm_procedure_t)self->result;
}

PM_APART pm_procedure_t procedure_d_current_slow(drive_t *drive)
{
    d_current_t *self = &drive->beside.d_current;
    if (drive->config.polarity.block_ms == 0U) {
        return PM_FAILED_POLARITY; /* not what the configuration is for */
    }
    self->ms++;
    bool next = false;
    switch (self->part) {
    case PART_LOCK:
        next = self->ms >= LOCK_MS;
        break;
    case PART_NORTH:
    case PART_SOUTH:
        next = measure_at(drive, self->part);
        break;
    default:
        return conclude(drive);
    }
    if (self->part == PART_LOCK) {
        self->theta = drive->position.pll.theta;
    } else if (!inject_stays(drive, self->theta)) {
        return PM_FAILED_SALIENCY; /* there is none with this current */
    } else {
        /* the frame stays on its axis */
    }
    if (next) {
        self->result = (uint8_t)(self->part == PART_SOUTH ? judge(drive) : PM_RUNNING);
        self->part++;
        self->ms = 0;
    }
    return PM_RUNNING;
}

void procedure_d_current_abort(drive_t *drive)
{
    (void)drive;
}

#endif
