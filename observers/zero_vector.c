#include "observers/zero_vector.h"

#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)

#define IN_FLIGHT 2U /* a bit for each of the two periods from asking for a sample to having it: 10b, 1b, 0 */

#define MISSED_MOST 20U /* pairs: 4 ms at 10 kHz */

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

static void place(zero_vector_t *self, const zero_vector_config_t *config, int32_t x)
{
    const int32_t counts = config->counts;
    self->x = (uint16_t)pm_clamp(x, counts / 16, counts / 2 - (int32_t)config->guard);
    self->foreign = IN_FLIGHT;
}

/* Samples of another distance are on their way, so it moves rarely. By the largest voltage of the last millisecond: a
 * carrier has two. */
static void follow(zero_vector_t *self, const zero_vector_config_t *config)
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
    self->square = 0;
}

/* What the distance and L_dq make of the set point. */
static void adjust(zero_vector_t *self, const zero_vector_config_t *config, const emf_machine_t *machine,
                   const obs_in_t *in)
{
    emf_t *emf = &self->emf;
    const pm_gain_t ratio = pm_div((int32_t)config->counts, pm_shl((int32_t)self->x, 2)); /* T / 2x, Q26 */
    emf->inductance = pm_narrow_sat(pm_gain(machine->L, ratio));
    if (config->lambda != 0) {
        const pm_q_t omega = pm_max(pm_abs(in->omega), config->emf.omega_min);
        const pm_q_t drop = pm_mul_sat(emf->R, in->omega < 0 ? -in->i_dq.q : in->i_dq.q);
        const pm_q_t fall = pm_add_sat(config->saliency, pm_div(drop, pm_mul_sat(omega, emf->psi_ref)));
        const pm_q_t tangent = pm_mul_sat(pm_mul_sat(config->lambda, in->i_dq.q), fall);
        emf->turn = pm_sub_sat(emf->turn, pm_shl(pm_sat(tangent, PM_Q_BITS), 2));
    }
}

void zero_vector_reset(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in)
{
    const emf_machine_t machine = machine_of(config, in);
    emf_reset(&self->emf, &config->emf, &machine, in);
    self->before = in->i;
    const pm_q_t psi = pm_mul_sat(self->emf.psi_ref, config->saliency);
    const pm_q_t emf = pm_mul_sat(pm_abs(in->omega), psi);
    const pm_q_t v_q = pm_add_sat(emf, pm_abs(pm_mul_sat(self->emf.R, in->i_dq.q)));
    const pm_q_t v_d = pm_mul_sat(in->omega, pm_mul_sat(config->emf.model.L_q, in->i_dq.q));
    self->square = pm_add_sat(pm_mulh(v_q, v_q), pm_mulh(v_d, v_d)) | 1;
    self->v_dc = config->v_dc;
    self->x = 0;
    self->behind = false;
    self->held = false;
    self->missed = 0;
    follow(self, config);
    adjust(self, config, &machine, in);
}

/* 2 T e, Q28, with the current at t_k-1 and what it has changed by about there. */
static inline pm_ab_t pair_of(const emf_t *emf, pm_ab_t before, pm_ab_t behind)
{
    pm_ab_t e;
    e.alpha = -pm_mulh(pm_shl(emf->i.alpha, 2), emf->drop);
    e.beta = -pm_mulh(pm_shl(emf->i.beta, 2), emf->drop);
    e.alpha = pm_mulh_sub(e.alpha, pm_small(2 * (behind.alpha - before.alpha)), emf->inductance);
    e.beta = pm_mulh_sub(e.beta, pm_small(2 * (behind.beta - before.beta)), emf->inductance);
    return e;
}

/* No error signal until there is a pair again; and nothing that the position agrees with when that takes long. */
PM_RARE static void coast(zero_vector_t *self, obs_out_t *out)
{
    self->missed++;
    self->emf.e.d = 0;
    if (self->missed > MISSED_MOST) {
        self->missed = MISSED_MOST;
        self->emf.e.q = 0;
    }
    emf_describe(&self->emf, self->emf.e, out);
}

void zero_vector_step(zero_vector_t *self, const zero_vector_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    emf_t *emf = &self->emf;
    const obs_more_t *more = in->more;
    const pm_q_t square = pm_mulh_add(pm_mulh(in->v.alpha, in->v.alpha), in->v.beta, in->v.beta);
    self->square = pm_max(self->square, square | 1);
    self->v_dc = more->v_dc;
    const bool valid = pm_sampled(more->codes, 0) && self->foreign == 0U && square <= self->most;
    self->foreign = (uint8_t)(self->foreign / 2U);
    if (!self->behind) {
        self->before = more->i_sample[0];
        self->held = valid;
        emf_describe(emf, emf->e, out);
    } else if (valid && self->held) {
        self->missed = 0;
        emf_frame_follow(emf, &config->emf, in, pair_of(emf, self->before, more->i_sample[0]), out);
    } else {
        coast(self, out);
    }
    self->behind = !self->behind;
    emf->i = in->i;
}

/* emf.h takes no more than one for the amplitude, so that noise would make the reference too small, by 13 % where
 * the current changes by four steps of the converter. */
static pm_q_t amplitude(const zero_vector_t *self, const zero_vector_config_t *config, pm_dq_t i)
{
    const emf_t *emf = &self->emf;
    const pm_q_t relative = pm_shl(pm_sat(pm_mulh(emf->e.q, emf->inverse), 17), PM_Q_BITS - 16);
    const pm_q_t lack = pm_mul(PM_ONE - relative, emf->psi_ref);
    return observer_amplitude(&config->emf.model, i, emf->psi_ref, lack);
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
