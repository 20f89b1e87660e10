#include "firmware/drive/follow.h"

#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define K_MEAN PM_FRAC(0.05) /* 20 ms */

void follow_reset(follow_t *self, const pm_machine_t *machine)
{
    *self = (follow_t){.R = machine->R_s, .R_doubt = machine->R_s / 4, .least = FOLLOW_STANDS};
}

void follow_again(follow_t *self, int32_t least)
{
    *self = (follow_t){.R = self->R, .R_doubt = self->R_doubt, .least = least};
}

void follow_resume(follow_t *self)
{
    follow_again(self, FOLLOW_TURN);
    self->follows = true;
}

void follow_rest(follow_t *self, pm_q_t v_d)
{
    if (self->ms == 0U) {
        self->along = v_d;
    }
    self->ms++;
    (void)pm_lp1(&self->along, v_d, K_MEAN);
}

void follow_rested(follow_t *self, const pm_machine_t *machine, pm_q_t i, pm_q_t v_dc)
{
    const uint16_t ms = self->ms;
    const pm_q_t v_d = self->along;
    follow_reset(self, machine);
    if (ms >= FOLLOW_REST_MS && i > 0) {
        const pm_q_t drop = pm_mul(machine->R_s, i);
        const pm_q_t band = pm_half(drop) + v_dc / 64;
        self->R = pm_div(pm_clamp(v_d, drop - band, drop + band), i);
        self->R_doubt = machine->R_s / 32;
    }
}

static bool is_seen(const follow_t *self, pm_q_t omega)
{
    const pm_q_t half = pm_half(self->emf);
    const pm_q_t across = omega < 0 ? -self->across : self->across;
    return across > half || pm_abs(self->along) > half;
}

bool follow_slow(follow_t *self, const pm_machine_t *machine, const follow_in_t *in)
{
    const pm_machine_t *m = machine;
    const pm_q_t reactance = pm_mul(in->omega, pm_half(m->L_d) + pm_half(m->L_q));
    (void)pm_lp1(&self->along, in->v.d - pm_mul(self->R, in->i), K_MEAN);
    (void)pm_lp1(&self->across, in->v.q - pm_mul(reactance, in->i), K_MEAN);
    const bool back = in->omega < 0;
    self->lag = pm_atan2(back ? -self->along : self->along, back ? -self->across : self->across);
    const pm_q_t psi = m->psi_m - pm_mul(m->L_q - m->L_d, in->i) / 2;
    self->emf = pm_mul(pm_abs(in->omega), pm_max(psi, pm_half(m->psi_m)));
    self->turned = pm_min(self->turned + in->turn, self->least);
    if (pm_half(self->emf) <= pm_mul(self->R_doubt, in->i) + in->v_dc / 512) {
        self->emf = 0;
        self->ms = 0;
        self->follows_ms = 0;
        self->follows = false;
        return false;
    }
    if (!is_seen(self, in->omega)) {
        self->follows_ms = 0;
        self->ms = (uint16_t)pm_min(self->ms + 1, FOLLOW_STANDS_MS);
        return self->ms == FOLLOW_STANDS_MS && self->turned >= self->least;
    }
    self->ms = (uint16_t)pm_max(self->ms - 2, 0);
    self->turned = self->ms != 0U ? self->turned : 0;
    self->follows_ms = (uint8_t)pm_min(self->follows_ms + 1, FOLLOW_FOLLOWS_MS);
    self->follows = self->follows || self->follows_ms == FOLLOW_FOLLOWS_MS;
    return false;
}

int32_t follow_load(const follow_t *self)
{
    const pm_q_t along = pm_abs(self->along);
    if (self->follows_ms == 0U || !self->follows) { /* stands, or is not seen */
        return 0;
    }
    if (along > pm_mul(self->emf, PM_Q(0.65))) {
        return 1;
    }
    return along < pm_mul(self->emf, PM_Q(0.4)) ? -1 : 0;
}
