#include "firmware/drive/procedures/zero_inductance.h"

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(zero_inductance)

#define VALUES      32U
#define RISE_MS     256
#define ACROSS      PM_TURN(0.25)
#define ACROSS_MS   512U /* slowly, or the rotor swings for longer than the next turn takes */
#define TURN_MS     800U /* with the current: the rotor comes to rest */
#define FREE_MS     200U /* without */
#define LATEST_MS   5000U
#define SHARE       64   /* of S: a difference that is none */
#define LEAST       4000 /* of the machine's inductance */
#define LEAST_SHARE 256  /* of i_max: an answer in the currents */

/* Along phase A, and across it. */
enum { TURN, WITH, FREE, WITHOUT, TURN_ON, WITH_ON, FREE_ON, WITHOUT_ON, PARTS };

static pm_q_t current(const drive_t *drive)
{
    return pm_min(commissioning_current(drive), drive->config.zero_inductance.i_most);
}

static void enter(drive_t *drive, uint8_t part)
{
    zero_inductance_t *self = &drive->procedure.zero_inductance;
    self->part = part;
    self->ms = 0;
    self->hold.still = 0;
    self->values = 0;
    if (part == (uint8_t)WITHOUT || part == (uint8_t)WITHOUT_ON) { /* not of those with the current */
        self->at[part / (uint8_t)TURN_ON] = (zero_means_t){.a = {0, 0}, .b = {0, 0}, .y = {0, 0}};
    }
    drive->commissioning_report.progress = (uint8_t)(100U * part / (uint8_t)PARTS);
}

void procedure_zero_inductance_begin(drive_t *drive)
{
    drive->commissioning_report.routines = (uint8_t)COMMISSIONING_NEUTRAL;
    procedure_report(drive, COMMISSIONING_RUNNING, COMMISSIONING_NO_REASON);
    drive->zero_inductance = (zero_inductance_result_t){0};
    sine_reset(&drive->procedure.zero_inductance.sine, &drive->config.zero_inductance.sine, (pm_dq_t){0, 0});
    enter(drive, TURN);
}

PM_APART pm_procedure_t procedure_zero_inductance_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    zero_inductance_t *self = &drive->procedure.zero_inductance;
    const zero_inductance_config_t *c = &drive->config.zero_inductance;
    const pm_dq_t i = {.d = drive->i_ab.alpha, .q = drive->i_ab.beta};
    const pm_dq_t zero = {.d = neutral_signal(&drive->neutral, &drive->config.neutral, in->more.v_neutral)};
    const uint16_t at = self->sine.phase.at;
    const pm_angle_t phi = sine_step(&self->sine, &c->sine, i);
    window_step(&self->neutral, at, pm_dir(phi - c->sine.lag), zero);
    const pm_ab_t carrier = carrier_along(c->sine.v_h, pm_dir(phi));
    const pm_ab_t v = {.alpha = self->hold.v.alpha + carrier.alpha, .beta = self->hold.v.beta + carrier.beta};
    drive->status.i = i;
    drive->status.theta = 0;
    drive->v_next = v;
    commissioning_write_legs(drive, self->rest, pm_clarke_inverse(v), out);
    return PM_RUNNING; /* its slow part knows the end */
}

/* The current is there. */
static bool holds(drive_t *drive)
{
    zero_inductance_t *self = &drive->procedure.zero_inductance;
    const zero_inductance_config_t *c = &drive->config.zero_inductance;
    const bool with = self->part % (uint8_t)TURN_ON <= (uint8_t)WITH;
    const pm_q_t i = current(drive);
    const pm_q_t wanted = with ? i : 0;
    self->i = pm_approach(self->i, wanted, i / RISE_MS + 1);
    const bool turns = self->part == (uint8_t)TURN_ON && self->along != ACROSS;
    if (turns && self->i == wanted) {
        self->along += ACROSS / ACROSS_MS;
    }
    const pm_dir_t along = pm_dir(self->along);
    const pm_ab_t hold = {.alpha = pm_unit(self->i, along.cos), .beta = pm_unit(self->i, along.sin)};
    commissioning_hold(drive, &self->hold, hold, sine_mean(&self->sine, &c->sine), c->omega);
    if (self->i != wanted || turns) { /* what lags behind a ramp is even, too */
        self->hold.still = 0;
    }
    return self->hold.still >= (with ? TURN_MS : FREE_MS);
}

static void add(pm_dq_t *mean, pm_q_t cosine, pm_q_t sine)
{
    mean->d += cosine / (int32_t)VALUES;
    mean->q -= sine / (int32_t)VALUES;
}

/* S: |Y| of as much current as there would be without resistance and dead time. */
static pm_q_t size_of(pm_q_t y, pm_dq_t i_cos, pm_dq_t i_sin)
{
    return pm_mul(y, pm_div(pm_hypot(i_cos.d, i_sin.d), i_cos.d));
}

/* Whether these were all. */
static bool add_value(drive_t *drive)
{
    zero_inductance_t *self = &drive->procedure.zero_inductance;
    const pm_frac_t per_n = drive->config.zero_inductance.sine.per_n;
    const pm_dq_t i_cos = window_cosine(&self->sine.window, per_n);
    const pm_dq_t i_sin = window_sine(&self->sine.window, per_n);
    const pm_q_t y_cos = window_cosine(&self->neutral, per_n).d;
    const pm_q_t y_sin = window_sine(&self->neutral, per_n).d;
    const uint32_t at = self->part / (uint8_t)TURN_ON;
    const bool with = self->part % (uint8_t)TURN_ON == (uint8_t)WITH;
    const pm_q_t size = size_of(pm_hypot(y_cos, y_sin), i_cos, i_sin);
    add(&self->at[at].a, i_cos.d, i_sin.d);
    add(&self->at[at].b, i_cos.q, i_sin.q);
    add(&self->at[at].y, y_cos, y_sin);
    if (with && self->values == 0U) {
        self->first = size;
        self->size[0] = (polarity_mean_t){.sum = 0};
        self->size[1] = (polarity_mean_t){.sum = 0};
    }
    polarity_add(&self->size[with ? 0 : 1], size - self->first);
    self->values++;
    return self->values >= VALUES;
}

/* Im(a* b) */
static int64_t cross(pm_dq_t a, pm_dq_t b)
{
    return (int64_t)a.d * b.q - (int64_t)a.q * b.d;
}

/* x / y, which are of the same format: Q28. */
static pm_q_t share(int64_t x, int64_t y)
{
    const int64_t one = y / PM_ONE;
    return one == 0 ? 0 : (pm_q_t)pm_quotient(x, (int32_t)one);
}

/* Which way, if it is sure. Across phase A it may take that back; where nothing is seen there, the start's own margin refuses. */
static void find_fall(drive_t *drive, bool across)
{
    const zero_inductance_t *self = &drive->procedure.zero_inductance;
    zero_inductance_result_t *r = &drive->zero_inductance;
    const polarity_config_t none = {.reversed = false};
    const pm_q_t noise = pm_hypot(polarity_noise(&self->size[0]), polarity_noise(&self->size[1]));
    const pm_q_t rise = polarity_mean(&self->size[0]) - polarity_mean(&self->size[1]);
    pm_sigma_t margin;
    bool rises;
    const bool sure = polarity_judge(&none, rise, self->first / SHARE, noise, &margin, &rises) == PM_DONE;
    if (!across) {
        r->margin = sure ? margin : 0;
        r->falls = !rises;
    } else {
        r->margin = sure && r->falls == rises ? 0 : r->margin;
    }
}

static pm_dq_t sum_of(pm_dq_t x, pm_dq_t y)
{
    return (pm_dq_t){x.d + y.d, x.q + y.q};
}

static pm_dq_t difference_of(pm_dq_t x, pm_dq_t y)
{
    return (pm_dq_t){x.d - y.d, x.q - y.q};
}

/* W = -K Y */
static pm_dq_t linkage(const drive_t *drive, pm_dq_t y)
{
    const pm_dq_t k = drive->config.zero_inductance.k;
    return (pm_dq_t){pm_mul(y.q, k.q) - pm_mul(y.d, k.d), -pm_mul(y.d, k.q) - pm_mul(y.q, k.d)};
}

/* Of the winding's voltage by its current: (L - j rho) I */
static pm_dq_t flux(pm_q_t L, pm_q_t rho, pm_dq_t i)
{
    return (pm_dq_t){pm_mul(L, i.d) + pm_mul(rho, i.q), pm_mul(L, i.q) - pm_mul(rho, i.d)};
}

static void find_star(drive_t *drive)
{
    const zero_inductance_t *self = &drive->procedure.zero_inductance;
    zero_inductance_result_t *r = &drive->zero_inductance;
    const pm_machine_t *m = &drive->config.machine;
    const pm_q_t rho = pm_mul(m->R_s, drive->config.zero_inductance.rho);
    const zero_means_t *x = self->at;
    const pm_dq_t a = difference_of(x[0].a, x[1].a);
    const pm_dq_t b = difference_of(x[0].b, x[1].b);
    const pm_dq_t both = linkage(drive, sum_of(x[0].y, x[1].y));
    const pm_dq_t w = {both.d - pm_mul(r->dL_0, a.d) - pm_mul(r->L_c0, b.d),
                       both.q - pm_mul(r->dL_0, a.q) - pm_mul(r->L_c0, b.q)};
    const pm_dq_t p = sum_of(flux(m->L_d, rho, x[0].a), flux(m->L_q, rho, x[1].a));
    const pm_dq_t q = sum_of(flux(m->L_q, rho, x[0].b), flux(m->L_d, rho, x[1].b));
    r->star.alpha = -share(cross(w, q), cross(p, q)) / 2;
    r->star.beta = -share(cross(p, w), cross(p, q)) / 2;
}

static pm_procedure_t conclude(drive_t *drive)
{
    const zero_inductance_t *self = &drive->procedure.zero_inductance;
    zero_inductance_result_t *r = &drive->zero_inductance;
    const pm_dq_t a = sum_of(self->at[0].a, self->at[1].a);
    const pm_dq_t b = sum_of(self->at[0].b, self->at[1].b);
    const pm_dq_t w = linkage(drive, difference_of(self->at[0].y, self->at[1].y));
    const int64_t both = cross(a, b);
    if (pm_abs(a.d) + pm_abs(a.q) < drive->config.i_max / LEAST_SHARE) {
        return PM_FAILED_NO_CURRENT;
    }
    r->dL_0 = share(cross(w, b), both);
    r->L_c0 = share(cross(a, w), both);
    if (pm_hypot(r->dL_0, r->L_c0) < drive->config.machine.L_d / LEAST) {
        return PM_FAILED_SALIENCY;
    }
    find_star(drive);
    find_fall(drive, true);
    return PM_DONE;
}

static pm_procedure_t finish(drive_t *drive, pm_procedure_t result)
{
    if (result == PM_DONE) {
        procedure_report(drive, COMMISSIONING_DONE, COMMISSIONING_NO_REASON);
    } else {
        procedure_report(drive, COMMISSIONING_FAILED,
                         result == PM_FAILED_SALIENCY ? COMMISSIONING_ROUND : COMMISSIONING_NO_CURRENT);
        drive->zero_inductance = (zero_inductance_result_t){0};
    }
    return result;
}

pm_procedure_t procedure_zero_inductance_slow(drive_t *drive)
{
    zero_inductance_t *self = &drive->procedure.zero_inductance;
    const uint32_t block =
        (drive->config.zero_inductance.sine.n + drive->config.slow_divider - 1U) / drive->config.slow_divider;
    self->ms++;
    const bool held = holds(drive);
    if (self->ms > LATEST_MS) {
        return finish(drive, PM_FAILED_NO_CURRENT);
    }
    if (self->part % 2U == 0U) { /* waits */
        if (held) {
            enter(drive, (uint8_t)(self->part + 1U));
        }
        return PM_RUNNING;
    }
    if (self->ms % block != 0U || !add_value(drive)) {
        return PM_RUNNING;
    }
    if (self->part == (uint8_t)WITHOUT) {
        find_fall(drive, false);
    }
    if (self->part != (uint8_t)WITHOUT_ON) {
        enter(drive, (uint8_t)(self->part + 1U));
        return PM_RUNNING;
    }
    return finish(drive, conclude(drive));
}

void procedure_zero_inductance_abort(drive_t *drive)
{
    drive->zero_inductance = (zero_inductance_result_t){0};
}

#endif
