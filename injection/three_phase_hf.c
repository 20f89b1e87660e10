#include "injection/three_phase_hf.h"

#include "firmware/math/num.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define GAIN_MAX PM_Q(0.125)
/* Of I_p / 2: a second harmonic that dead time makes of a linear machine. */
#define SHARE 128

static void apply(three_phase_hf_t *self, const three_phase_hf_config_t *config, pm_angle_t phi,
                  pulses_out_t *out)
{
    self->share = pm_min(self->share + config->rise, config->share);
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        out->duty[x] = PM_ONE / 2 + pm_unit(self->share, pm_dir(phi - pulses_axis[x]).cos);
    }
    out->driven = true;
}

static void add(three_phase_hf_t *self, pm_abc_t i, pm_angle_t phase)
{
    const pm_dir_t once = pm_dir(phase);
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        const pm_q_t i_x = pulses_leg(&i, x);
        self->cosine[x] += pm_mulh(i_x, once.cos);
        self->sine[x] += pm_mulh(i_x, once.sin);
    }
    const pm_dq_t second = pm_park_half(pm_clarke(i), pm_dir(2U * phase));
    self->block.alpha += second.d / 64; /* a block of 2^9 periods with full current */
    self->block.beta += second.q / 64;
}

pm_procedure_t three_phase_hf_step(three_phase_hf_t *self, const three_phase_hf_config_t *config, pm_abc_t i,
                                   pulses_out_t *out)
{
    *out = (pulses_out_t){.driven = false};
    if (self->values >= config->wanted) {
        return PM_DONE; /* at once where the configuration is for another way: then there is no current */
    }
    const pm_angle_t phi = carrier_angle(&self->phase, config->sine.step);
    carrier_advance(&self->phase, config->sine.n);
    apply(self, config, phi, out);
    self->timer++;
    if (!self->settled) {
        self->settled = self->timer >= config->settled;
        self->timer = self->settled ? 0U : self->timer;
        return PM_RUNNING;
    }
    add(self, i, phi - config->sine.lag);
    if (self->timer >= config->block) {
        self->timer = 0;
        self->values++;
        self->z = self->block;
        self->block = (pm_ab_t){0, 0};
        self->fresh = true;
    }
    return PM_RUNNING;
}

void three_phase_hf_slow(three_phase_hf_t *self)
{
    if (self->fresh) {
        self->fresh = false;
        polarity_add(&self->along, self->z.alpha);
        polarity_add(&self->across, self->z.beta);
    }
}

typedef struct {
    pm_q_t re, im;
} complex_t;

static complex_t minus(complex_t a, complex_t b)
{
    return (complex_t){a.re - b.re, a.im - b.im};
}

static pm_q_t cross(complex_t a, complex_t b)
{
    return pm_mul(a.re, b.im) - pm_mul(a.im, b.re);
}

/* I_x / I_p, of which the sum is zero; false: not by any gains. */
static bool balance(complex_t q[PULSES_AXES])
{
    const complex_t sum = {q[0].re + q[1].re + q[2].re, q[0].im + q[1].im + q[2].im};
    const complex_t u = minus(q[0], q[2]), w = minus(q[1], q[2]);
    const pm_q_t area = cross(u, w);
    if (pm_abs(area) < PM_ONE) { /* 2.6 of three equal phases */
        return false;
    }
    const pm_q_t size = pm_abs(area), sign = area < 0 ? -1 : 1;
    pm_q_t g[PULSES_AXES];
    g[0] = pm_div(sign * cross(sum, w), size);
    g[1] = pm_div(sign * cross(u, sum), size);
    g[2] = -g[0] - g[1];
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        if (pm_abs(g[x]) > GAIN_MAX) {
            return false;
        }
        q[x].re -= pm_mul(g[x], q[x].re);
        q[x].im -= pm_mul(g[x], q[x].im);
    }
    return true;
}

static uint16_t sector_of(pm_abc_t square)
{
    const bool ab = square.a > square.b, bc = square.b > square.c, ca = square.c > square.a;
    if (!bc) { /* C above B: 0 to 90 degrees */
        return ab ? (ca ? 1U : 0U) : 2U;
    }
    return ab ? 5U : (ca ? 3U : 4U);
}

static pm_q_t square_of(complex_t q)
{
    return pm_mul(q.re, q.re) + pm_mul(q.im, q.im);
}

/* The sums to phasors, half of I_x each, and their positive sequence. */
static complex_t phasors(const three_phase_hf_t *self, const three_phase_hf_config_t *config,
                         complex_t q[PULSES_AXES])
{
    pm_ab_t positive = {0, 0};
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        const int32_t count = (int32_t)config->block * config->wanted;
        q[x].re = (pm_q_t)pm_quotient(2 * self->cosine[x], count); /* Q27 to Q28 */
        q[x].im = (pm_q_t)pm_quotient(-2 * self->sine[x], count);
        const pm_ab_t turned = pm_park_inverse((pm_dq_t){q[x].re / 3, q[x].im / 3}, pm_dir(pulses_axis[x]));
        positive.alpha += turned.alpha;
        positive.beta += turned.beta;
    }
    return (complex_t){positive.alpha, positive.beta};
}

/* Which end of the axis; rho: phase of the positive sequence. */
static pm_procedure_t find_pole(three_phase_hf_t *self, const three_phase_hf_config_t *config, pm_q_t rho,
                                pm_q_t i_p)
{
    const pm_ab_t z = {polarity_mean(&self->along), polarity_mean(&self->across)};
    const pm_angle_t turn = (pm_angle_t)pm_rad_to_angle(2 * rho) - self->found.theta;
    const pm_dq_t seen = pm_park(z, pm_dir(turn)); /* q: none of saturation */
    const pm_q_t along = seen.d;
    const pm_q_t spread = pm_max(polarity_noise(&self->along), polarity_noise(&self->across));
    /* of a block's sum over 128 */
    const int32_t scale = (int32_t)config->block;
    const pm_q_t floor = config->noise / 128 * scale;
    const pm_q_t allowance = pm_abs(seen.q) + i_p / SHARE / 128 * scale;
    const pm_sigma_t polarity = pulses_polarity(along, allowance, pm_max(pm_max(spread, floor), 1));
    self->found.theta += ((along > 0) != config->reversed) ? 0U : PM_TURN(0.5);
    self->found.margin = pm_min(self->found.margin, polarity);
    return polarity < PULSES_SURE ? PM_FAILED_POLARITY : PM_DONE;
}

pm_procedure_t three_phase_hf_find(three_phase_hf_t *self, const three_phase_hf_config_t *config)
{
    complex_t q[PULSES_AXES];
    const complex_t positive = phasors(self, config, q);
    const pm_q_t i_p = pm_hypot(positive.re, positive.im);
    if (i_p < config->i_least || i_p == 0) {
        return PM_FAILED_NO_CURRENT;
    }
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        q[x] = (complex_t){pm_div(q[x].re, i_p), pm_div(q[x].im, i_p)};
    }
    if (!balance(q)) {
        return PM_FAILED_UNEVEN;
    }
    const pm_abc_t squares = {square_of(q[0]), square_of(q[1]), square_of(q[2])};
    const pm_ab_t y = pm_clarke(squares); /* 2 kappa e^{-j 2 theta} */
    const pm_q_t length = pm_hypot(y.alpha, y.beta);
    self->found.margin = pulses_margin(length, pm_max(3 * pm_min(pm_div(config->noise, i_p), PM_ONE), 1));
    if (length < config->kappa / 2 || self->found.margin < PULSES_SURE) {
        return PM_FAILED_SALIENCY;
    }
    const pm_q_t rho = pm_angle_to_rad((int32_t)pm_atan2(positive.im, positive.re));
    const pm_q_t rho_e = config->rho_R + pm_mul(config->inverter, rho - config->rho_0);
    const pm_dq_t right = pm_park(y, pm_dir((pm_angle_t)pm_rad_to_angle(rho_e)));
    self->sector = sector_of(pm_clarke_inverse((pm_ab_t){.alpha = right.d, .beta = right.q}));
    self->found.theta = pm_atan2(-right.q, right.d) / 2U;
    return find_pole(self, config, rho, i_p);
}
