#include "observers/third_crossings.h"

#define LEAST PM_Q(0.5) /* between two crossings, of 1.05 rad: noise makes none */
#define MOST  PM_Q(1.0 / 3)
#define NONE  PM_Q_MAX /* no crossing yet */

/* The compensated flux is above zero. */
static bool is_above(const third_crossings_t *self, const obs_in_t *in)
{
    const pm_half_dir_t dir = third_dir(in->dir);
    const pm_dq_t z = self->flux.third.last;
    return pm_mulh_sub(pm_mulh(z.d, dir.cos), z.q, dir.sin) >= 0;
}

/* From the present position and speed on. */
static void follow(third_crossings_t *self, const third_crossings_config_t *config, const obs_in_t *in)
{
    self->ahead = 0;
    self->turn = pm_frac(in->omega, config->third.t_s);
    self->error = NONE;
}

void third_crossings_reset(third_crossings_t *self, const third_crossings_config_t *config,
                           const obs_in_t *in)
{
    third_integration_reset(&self->flux, config, in);
    self->dir.cos = in->dir.cos;
    self->dir.sin = in->dir.sin;
    self->travelled = 0;
    self->periods = 0;
    self->above = is_above(self, in);
    follow(self, config, in);
}

static void take(third_crossings_t *self, pm_q_t error)
{
    if (self->error != NONE) {
        self->turn = (self->travelled + error - self->error) / self->periods;
    }
    self->ahead = error;
    self->error = error;
    self->travelled = 0;
    self->periods = 0;
}

void third_crossings_step(third_crossings_t *self, const third_crossings_config_t *config, const obs_in_t *in,
                          obs_out_t *out)
{
    third_integration_step(&self->flux, config, in, out);
    const pm_dir_t past = self->dir;
    const pm_q_t turned = pm_mulh_sub(pm_mulh(in->dir.sin, past.cos), in->dir.cos, past.sin) / 4; /* Q30 */
    self->dir.cos = in->dir.cos;
    self->dir.sin = in->dir.sin;
    self->ahead += self->turn - turned;
    self->travelled = pm_clamp(self->travelled + turned, -PM_ONE * 4, PM_ONE * 4);
    self->periods++;
    const bool above = is_above(self, in);
    if (above != self->above && pm_abs(self->travelled + self->ahead) >= LEAST) {
        self->above = above;
        take(self, third_last(&self->flux.third).eps);
    }
    self->ahead = pm_clamp(self->ahead, -MOST, MOST);
    out->eps = self->ahead;
}

obs_out_t third_crossings_last(const third_crossings_t *self)
{
    obs_out_t out = third_last(&self->flux.third);
    out.eps = self->ahead;
    return out;
}

void third_crossings_tie(third_crossings_t *self, const third_crossings_config_t *config)
{
    (void)config;
    self->ahead = 0;
}

void third_crossings_slow(third_crossings_t *self, const third_crossings_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight)
{
    third_integration_slow(&self->flux, config, in, out, weight);
    if (weight == 0) {
        follow(self, config, in);
    }
}
