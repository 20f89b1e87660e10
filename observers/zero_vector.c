#include "observers/zero_vector.h"

#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/pair.h"
#include "firmware/math/root.h"

#if PM_HAS(zero_vector)

#define MISSED_MOST 20U /* pairs: 4 ms at 10 kHz */

#define CODE_BITS  (PM_Q_BITS - 15) /* a code of full scale is one */
#define SQRT_3     PM_Q(1.7320508)
#define PER_SQRT_3 PM_Q(0.57735027)
#define V_DC_LEAST PM_Q(0.0625)

static emf_machine_t machine_of(const zero_vector_config_t *config, const obs_in_t *in)
{
    return emf_salient(&config->emf, in, PM_GAIN(1.0));
}

/* Of half a period: half the zero vector at that voltage, without what is not to be used of it. */
static int32_t room_at(const zero_vector_config_t *config, pm_q_t v, pm_q_t v_dc)
{
    const pm_q_t used = pm_div(pm_mul_sat(v, SQRT_3), v_dc);
    const pm_q_t left = pm_half(PM_ONE - pm_min(used, PM_ONE));
    return 2 * pm_mulh(pm_shl(left, 3), config->counts) - (int32_t)config->guard;
}

/* What has been asked for with another distance arrives in the two steps that follow. */
static void place(zero_vector_t *self, const zero_vector_config_t *config, int32_t x)
{
    const int32_t counts = config->counts;
    self->x = (uint16_t)pm_clamp(x, counts / 16, counts / 2 - (int32_t)config->guard);
    self->at_begin = (uint16_t)(self->x + config->later);
    self->at_end = (uint16_t)(2 * counts - self->x + config->later);
    self->foreign = self->behind ? 2U : 1U;
}

/* Samples of another distance are on their way, so it moves rarely. By the largest voltage of the last millisecond: a
 * carrier has two. */
PM_APART static void follow(zero_vector_t *self, const zero_vector_config_t *config)
{
    if (self->square == 0) {
        return;
    }
    const int32_t spare = config->counts / 128;
    const pm_q_t v_dc = pm_max(self->v_dc, V_DC_LEAST);
    const pm_q_t v = pm_sqrt(pm_shl(pm_min(self->square, PM_ONE / 4), 4));
    const int32_t room = room_at(config, v, v_dc);
    const int32_t x = self->x;
    if (x > room || x < room - 2 * spare) {
        place(self, config, room - spare);
    }
    const int32_t whole = 2 * ((int32_t)self->x + (int32_t)config->guard);
    const pm_q_t share = PM_ONE - pm_div(whole, config->counts);
    const pm_q_t v_most = pm_mul(pm_mul_sat(share, PER_SQRT_3), v_dc);
    self->most = pm_mulh(v_most, v_most);
    self->most = self->foreign == 0U ? self->most : ~self->most;
    self->square = 0;
}

/* What the distance and L_dq make of the set point. */
PM_APART static void adjust(zero_vector_t *self, const zero_vector_config_t *config,
                            const emf_machine_t *machine, const obs_in_t *in)
{
    emf_t *emf = &self->emf;
    const pm_gain_t ratio = pm_div((int32_t)config->counts, pm_shl((int32_t)self->x, 2)); /* T / 2x, Q26 */
    const pm_q_t inductance = pm_narrow_sat(pm_gain(machine->L, ratio));
    self->k_alpha = -pm_frac(inductance, PM_FRAC(1.0 / 3));
    self->k_beta = -pm_mul(inductance, PER_SQRT_3);
    emf->drop = pm_mulh(emf->drop, PM_ONE);
    emf->cross = pm_mulh(emf->cross, PM_ONE);
    self->k_filter = config->emf.k_filter;
    emf->turn = 0;
    if (config->lambda != 0) {
        const pm_q_t omega = pm_max(pm_abs(in->omega), config->emf.omega_min);
        const pm_q_t drop = pm_mul_sat(emf->R, in->omega < 0 ? -in->i_dq.q : in->i_dq.q);
        const pm_q_t fall = pm_add_sat(config->saliency, pm_div(drop, pm_mul_sat(omega, emf->psi_ref)));
        const pm_q_t tangent = pm_mul_sat(pm_mul_sat(config->lambda, in->i_dq.q), fall);
        emf->turn = -pm_shl(pm_sat(tangent, PM_Q_BITS), 2);
    }
}

void zero_vector_reset(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in)
{
    const emf_machine_t machine = machine_of(config, in);
    emf_reset(&self->emf, &config->emf, &machine, in);
    self->eps = 0;
    self->dir = in->dir;
    self->i_dq = in->i_dq;
    self->ahead = 0;
    const pm_q_t psi = pm_mul_sat(self->emf.psi_ref, config->saliency);
    const pm_q_t emf = pm_mul_sat(pm_abs(in->omega), psi);
    const pm_q_t v_q = pm_add_sat(emf, pm_abs(pm_mul_sat(self->emf.R, in->i_dq.q)));
    const pm_q_t v_d = pm_mul_sat(in->omega, pm_mul_sat(config->emf.model.L_q, in->i_dq.q));
    self->square = pm_add_sat(pm_mulh(v_q, v_q), pm_mulh(v_d, v_d)) | 1;
    self->x = UINT16_MAX; /* beyond any room: it is placed */
    self->behind = false;
    self->held = 0;
    self->missed = 0;
    self->v_dc = config->v_dc;
    follow(self, config);
    adjust(self, config, &machine, in);
}

/* The pair is not one of this distance, or not whole, or not within zero vectors. No error signal until there is one again; and
 * nothing that the position agrees with when that takes long. */
PM_RARE static pm_q_t coast(zero_vector_t *self)
{
    if (self->foreign != 0U) {
        self->foreign--;
        self->most = self->foreign == 0U ? ~self->most : self->most;
    }
    self->missed++;
    self->emf.e.d = 0;
    if (self->missed > MISSED_MOST) {
        self->missed = MISSED_MOST;
        self->emf.e.q = 0;
    }
    return 0;
}

/* T e of t_k in the frame of t_k, Q23. */
static inline pm_dq_t emf_of(const zero_vector_t *self, const pm_measure_t *codes)
{
    const pm_ab_t now = zero_vector_codes(codes);
    const pm_ab_t before = pm_pair_ab(&self->emf.i);
    const pm_pair_t k = pm_pair(&self->k_alpha, &self->k_beta);
    const pm_ab_t change = {.alpha = pm_mulh(pm_shl(now.alpha - before.alpha, CODE_BITS), k.first),
                            .beta = pm_mulh(pm_shl(now.beta - before.beta, CODE_BITS), k.second)};
    const pm_dq_t i = pm_pair_dq(&self->i_dq);
    const pm_pair_t r = {self->emf.drop, self->emf.cross};
    pm_dq_t e = pm_park_half(change, pm_pair_dir(&self->dir));
    e.d = pm_mulh_add(pm_mulh_sub(e.d, i.d, r.first), i.q, r.second);
    e.q = pm_mulh_sub(pm_mulh_sub(e.q, i.q, r.first), i.d, r.second);
    return e;
}

pm_q_t zero_vector_pair(zero_vector_t *self, const pm_measure_t *codes, pm_q_t square)
{
    emf_t *emf = &self->emf;
    const pm_q_t larger = pm_max(self->ahead, square);
    self->square = pm_max(self->square, larger);
    if (pm_rarely((self->held & codes->sampled & 1U) == 0U || larger > self->most)) {
        return coast(self);
    }
    self->missed = 0;
    pm_dq_t e = emf_of(self, codes);
    e.d -= pm_shl(pm_mulh(e.q, emf->turn), 2);
    const pm_dq_t past = pm_pair_dq(&emf->e);
    const pm_frac_t k = self->k_filter;
    e.d = pm_mulh_add(past.d, pm_shl(pm_sat(e.d, 21), 8) - past.d, k);
    e.q = pm_mulh_add(past.q, pm_shl(pm_sat(e.q, 21), 8) - past.q, k);
    emf->e = e;
    return -emf_relative(emf, e.d);
}

/* emf.h takes no more than one for the amplitude, so that noise would make the reference too small, by 13 % where
 * the current changes by four steps of the converter. */
static pm_q_t amplitude(const zero_vector_t *self, const zero_vector_config_t *config, pm_dq_t i)
{
    const emf_t *emf = &self->emf;
    const pm_q_t relative = pm_shl(pm_sat(pm_mulh(emf->e.q, emf->inverse), 17), PM_Q_BITS - 16);
    const pm_q_t lack = pm_mul(PM_ONE - relative, emf->psi_ref);
    pm_q_t psi_a = emf->psi_a;
    return observer_amplitude(&config->emf.model, i, emf->psi_ref, lack, &psi_a);
}

void zero_vector_slow(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    const emf_machine_t machine = machine_of(config, in);
    const pm_q_t psi = amplitude(self, config, in->i_dq);
    emf_slow(&self->emf, &config->emf, &machine, in, weight);
    self->emf.psi_ref = weight == 0 ? self->emf.psi_ref : psi;
    follow(self, config);
    adjust(self, config, &machine, in);
}

#endif
