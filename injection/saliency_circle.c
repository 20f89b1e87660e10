#include "injection/saliency_circle.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define SHARE PM_FRAC(1.0 / SALIENCY_CIRCLE_AXES)
/* Less than this of a current is none. */
#define LEAST PM_Q(1.0 / 256)

/* [d, x; x, q] */
typedef struct {
    pm_q_t d, q, x;
} symmetric_t;

void saliency_circle_reset(saliency_circle_t *self)
{
    *self = (saliency_circle_t){.p = {0, 0}};
}

static void add(pm_dq_t *sum, pm_q_t d, pm_q_t q)
{
    sum->d = pm_frac_add(sum->d, d, SHARE);
    sum->q = pm_frac_add(sum->q, q, SHARE);
}

static void add_part(pm_dq_t *p, pm_dq_t *n, pm_dir_t axis, pm_dq_t c)
{
    const pm_ab_t vector = {c.d, c.q};
    const pm_dq_t back = pm_park(vector, axis);
    const pm_ab_t on = pm_park_inverse(c, axis);
    add(p, back.d, back.q);
    add(n, on.alpha, on.beta);
}

void saliency_circle_add(saliency_circle_t *self, pm_dir_t axis, pm_dq_t lagging, pm_dq_t in_phase)
{
    add_part(&self->p, &self->n, axis, lagging);
    add_part(&self->g_p, &self->g_n, axis, in_phase);
}

/* Of I_p and I_n in the frame of theta, over the centre. */
static symmetric_t admittance(pm_q_t p, pm_dq_t n, pm_angle_t theta, pm_q_t centre)
{
    const pm_ab_t vector = {n.d, n.q};
    const pm_dq_t r = pm_park(vector, pm_dir(2U * theta));
    const symmetric_t y = {pm_div(p + r.d, centre), pm_div(p - r.d, centre), pm_div(r.q, centre)};
    return y;
}

static symmetric_t inverse(symmetric_t a)
{
    const pm_q_t det = pm_mul(a.d, a.q) - pm_mul(a.x, a.x);
    const symmetric_t r = {pm_div(a.q, det), pm_div(a.d, det), pm_div(-a.x, det)};
    return r;
}

/* b a b */
static symmetric_t between(symmetric_t b, symmetric_t a)
{
    const pm_q_t dd = pm_mul(b.d, a.d) + pm_mul(b.x, a.x);
    const pm_q_t dq = pm_mul(b.d, a.x) + pm_mul(b.x, a.q);
    const pm_q_t qd = pm_mul(b.x, a.d) + pm_mul(b.q, a.x);
    const pm_q_t qq = pm_mul(b.x, a.x) + pm_mul(b.q, a.q);
    const symmetric_t r = {pm_mul(dd, b.d) + pm_mul(dq, b.x), pm_mul(qd, b.x) + pm_mul(qq, b.q),
                           pm_mul(dd, b.x) + pm_mul(dq, b.q)};
    return r;
}

/* B + G B^-1 G over I_p / 2; false: out of range. */
static bool admittance_without_resistance(const saliency_circle_t *self, pm_angle_t theta, symmetric_t *y)
{
    const pm_q_t p = self->p.d;
    const pm_q_t n = pm_hypot(self->n.d, self->n.q);
    const pm_q_t g = pm_abs(self->g_p.d) + pm_hypot(self->g_n.d, self->g_n.q);
    if (p < LEAST / 2 || n >= p || g >= p) {
        return false;
    }
    const symmetric_t b = admittance(p, self->n, theta, p);
    const symmetric_t more = between(admittance(self->g_p.d, self->g_n, theta, p), inverse(b));
    *y = (symmetric_t){b.d + more.d, b.q + more.q, b.x + more.x};
    return true;
}

saliency_fit_t saliency_circle_fit(const saliency_circle_t *self)
{
    symmetric_t y;
    if (!admittance_without_resistance(self, 0U, &y)) {
        return (saliency_fit_t){0, 0, 0};
    }
    const pm_q_t across = pm_half(y.d - y.q);
    return (saliency_fit_t){.centre = pm_mul(self->p.d, y.d + y.q),
                            .radius = 2 * pm_mul(self->p.d, pm_hypot(across, y.x)),
                            .angle = pm_atan2(y.x, across) / 2U};
}

saliency_point_t saliency_circle_inductances(const saliency_circle_t *self, pm_angle_t theta, pm_q_t flux)
{
    symmetric_t y;
    if (!admittance_without_resistance(self, theta, &y)) {
        return (saliency_point_t){0, 0, 0};
    }
    const symmetric_t reactance = inverse(y);
    const pm_q_t L = pm_div(flux, 2 * self->p.d);
    return (saliency_point_t){pm_mul_sat(L, reactance.d), pm_mul_sat(L, reactance.q),
                              pm_mul_sat(L, reactance.x)};
}
