#include "bldc/commutation.h"

#include "firmware/math/root.h"

#define FAR PM_FRAC(1.0 / 12) /* half of t_60, of the sum */

static uint32_t until(const commutation_t *self, uint32_t at)
{
    return at - self->crossing;
}

void commutation_reset(commutation_t *self, uint32_t sector, uint32_t at, uint32_t t_60)
{
    *self = (commutation_t){.sum = SECTORS * t_60, .crossing = at, .ahead = at};
    for (uint32_t s = 0; s < SECTORS; s++) {
        self->interval[s] = t_60;
    }
    self->crossed = (uint8_t)sector;
    self->sector = (uint8_t)sector;
}

void commutation_start(commutation_t *self, uint32_t sector, uint32_t now, uint32_t t_30, uint8_t crossings)
{
    const uint32_t t_60 = (uint32_t)pm_frac((int32_t)(2U * t_30), PM_FRAC(0.41421356));
    commutation_reset(self, sector, now + t_30 - t_60 / 2U, t_60);
    self->young = crossings;
}

/* The last interval alone. */
static void forget(commutation_t *self, uint32_t interval)
{
    self->sum = SECTORS * interval;
    for (uint32_t s = 0; s < SECTORS; s++) {
        self->interval[s] = interval;
    }
}

static void take(commutation_t *self, uint32_t interval)
{
    const uint32_t sector = sector_next(self->crossed);
    self->sum += interval - self->interval[sector];
    self->interval[sector] = interval;
    self->crossing += interval;
    self->ahead = self->crossing;
    self->crossed = (uint8_t)sector;
    if (self->young != 0U) {
        forget(self, interval);
    }
}

static void strike(commutation_t *self)
{
    self->strikes = self->strikes == UINT8_MAX ? UINT8_MAX : (uint8_t)(self->strikes + 1U);
    self->whole = 0;
}

void commutation_crossed(commutation_t *self, uint32_t at)
{
    const int32_t t_60 = (int32_t)commutation_t_60(self);
    const int32_t far = pm_frac((int32_t)self->sum, FAR);
    const int32_t off = (int32_t)until(self, at) - t_60;
    if (pm_abs(off) > far) {
        strike(self);
    } else {
        self->strikes = 0;
        self->whole = self->whole < SECTORS ? (uint8_t)(self->whole + 1U) : (uint8_t)SECTORS;
    }
    take(self, (uint32_t)(t_60 + pm_clamp(off, -far, far)));
    if (self->young != 0U && self->whole != 0U) {
        self->young--;
    }
}

void commutation_missed(commutation_t *self)
{
    const uint32_t ahead = until(self, self->ahead), t_60 = commutation_t_60(self);
    strike(self);
    take(self, ahead > t_60 ? ahead : t_60);
}

uint32_t commutation_due(const commutation_t *self, const commutation_config_t *config)
{
    const uint32_t t_60 = commutation_t_60(self);
    const uint32_t sectors = sector_distance(self->crossed, self->sector);
    uint32_t from = self->crossing + sectors * t_60;
    if (sectors == 1U && (int32_t)(self->ahead - from) > 0) {
        const uint32_t most = self->young != 0U ? 4U * t_60 : t_60;
        from = (int32_t)(self->ahead - from) > (int32_t)most ? from + most : self->ahead;
    }
    return from + (uint32_t)pm_frac((int32_t)self->sum, config->half) - config->delay;
}

pm_q_t commutation_speed(const commutation_t *self, const commutation_config_t *config)
{
    return pm_div((pm_q_t)config->turn_base, (pm_q_t)self->sum);
}
