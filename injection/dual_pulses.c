#include "injection/dual_pulses.h"

#define QUIET  3U
#define PAUSE  20U /* periods before each order, in which what is left from before decays */
#define BEFORE 4   /* samples before the first pulse of an order */
#define CURVE  64  /* of four peaks: a 256th of each */

/* Voltage along d in period k, counted from 1, of an order that begins after period `first`. */
static int32_t sign_at(uint32_t k, uint32_t first, uint32_t n)
{
    if (k <= first || k > first + 4U * n) {
        return 0;
    }
    return k <= first + n || k > first + 3U * n ? 1 : -1;
}

static void apply(pm_q_t v, pm_dir_t d, pulses_out_t *out)
{
    const pm_abc_t legs = pm_clarke_inverse((pm_ab_t){.alpha = pm_unit(v, d.cos), .beta = pm_unit(v, d.sin)});
    out->duty[0] = PM_ONE / 2 + legs.a;
    out->duty[1] = PM_ONE / 2 + legs.b;
    out->duty[2] = PM_ONE / 2 + legs.c;
    out->driven = true;
}

/* What is commanded in step k acts between the samples k + 1 and k + 2. */
static void keep(dual_pulses_order_t *self, uint32_t k, uint32_t first, uint32_t n, pm_q_t i_d)
{
    if (k + 1U >= first && k <= first + 2U) {
        self->before += i_d / BEFORE;
    } else if (k == first + n + 2U) {
        self->peak[0] = i_d;
    } else if (k == first + 3U * n + 2U) {
        self->peak[1] = i_d;
    } else {
        /* on the way */
    }
}

static pm_procedure_t wait(dual_pulses_t *self, const dual_pulses_config_t *config, pm_ab_t i)
{
    self->timer++;
    const bool zero = pm_abs(i.alpha) < config->i_zero && pm_abs(i.beta) < config->i_zero;
    self->quiet = zero ? (uint16_t)(self->quiet + 1U) : 0U;
    if (self->quiet >= QUIET) {
        self->driven = true;
        self->timer = 0;
    }
    return self->timer > config->timeout ? PM_FAILED_TIMEOUT : PM_RUNNING;
}

pm_procedure_t dual_pulses_step(dual_pulses_t *self, const dual_pulses_config_t *config, pm_ab_t i,
                                pm_dir_t d, pulses_out_t *out)
{
    *out = (pulses_out_t){.driven = false};
    if (!self->driven) {
        return wait(self, config, i);
    }
    const uint32_t n = config->periods;
    const uint32_t second = PAUSE + 4U * n + PAUSE;
    self->timer++;
    const uint32_t k = self->timer;
    const pm_q_t i_d = pm_park(i, d).d;
    keep(&self->order[0], k, PAUSE, n, i_d);
    keep(&self->order[1], k, second, n, i_d);
    apply((sign_at(k, PAUSE, n) - sign_at(k, second, n)) * config->amplitude, d, out);
    return k < second + 4U * n + 3U ? PM_RUNNING : PM_DONE;
}

pm_procedure_t dual_pulses_find(dual_pulses_t *self, const dual_pulses_config_t *config)
{
    const dual_pulses_order_t *a = &self->order[0], *b = &self->order[1];
    const pm_q_t mean = (a->peak[0] - a->peak[1]) / 4 + (b->peak[1] - b->peak[0]) / 4;
    if (mean < config->i_least) {
        return PM_FAILED_NO_CURRENT;
    }
    const pm_q_t D =
        a->peak[0] + a->peak[1] + b->peak[0] + b->peak[1] - 2 * pm_unit(a->before + b->before, config->decay);
    self->margin = pulses_polarity(D, config->ringing + mean / CURVE, config->noise);
    self->north = (D > 0) != config->reversed;
    return self->margin < PULSES_SURE ? PM_FAILED_POLARITY : PM_DONE;
}
