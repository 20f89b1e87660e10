#include "observers/emf.h"

#include "firmware/math/filter.h"
#include "firmware/math/root.h"

emf_machine_t emf_salient(const emf_config_t *config, const obs_in_t *in, pm_gain_t lag)
{
    const pm_q_t L_d = config->model.L_d;
    return (emf_machine_t){.L = L_d, .saliency = observer_L_q(&config->model, in->i_dq) - L_d, .lag = lag};
}

/* w T psi, Q28 */
static pm_q_t change_of(const emf_config_t *config, pm_q_t omega, pm_q_t psi)
{
    return pm_mulh(pm_small(pm_frac(omega, config->model.t_s)), psi);
}

/* Tangent of the lag of filter and half a period, plus the other half: (lag + 1) tan x / (1 - lag tan^2 x),
 * Q30. */
static int32_t turn_of(pm_q_t x, pm_gain_t lag)
{
    const pm_q_t tangent = x + pm_mul(x, pm_mul(x, x)) / 3;
    const pm_q_t filter = pm_narrow_sat(pm_gain(tangent, lag));
    const pm_q_t turn = pm_div(pm_add_sat(filter, tangent), PM_ONE - pm_mul_sat(filter, tangent));
    return pm_shl(pm_sat(turn, PM_Q_BITS + 1), 2);
}

static void set_point(emf_t *self, const emf_config_t *config, const emf_machine_t *machine, pm_q_t omega,
                      pm_q_t least)
{
    const pm_q_t x = pm_frac(omega, config->model.t_s) / 2;
    self->drop = pm_small(pm_frac(self->R, config->model.t_s) / 2);
    self->inductance = machine->L;
    const pm_q_t x_cross = pm_frac(self->omega_cross, config->model.t_s) / 2;
    self->cross =
        pm_shl(pm_sat(pm_mul_sat(x_cross, machine->saliency), 24), 4); /* real values are far below 1/16 */
    self->turn = turn_of(x, machine->lag);
    const pm_q_t speed = pm_max(pm_abs(omega), least);
    const int32_t inverse = pm_div(PM_ONE / 2048, change_of(config, speed, self->psi_ref)); /* Q17 */
    self->inverse = omega < 0 ? -inverse : inverse;
}

static void set_from_model(emf_t *self, const emf_config_t *config, const obs_in_t *in)
{
    self->psi_a = observer_active_flux(&config->model, in->i_dq);
    self->psi_ref = self->psi_a;
}

void emf_reset(emf_t *self, const emf_config_t *config, const emf_machine_t *machine, const obs_in_t *in)
{
    self->step = config->model.t_s;
    self->rate = config->rate;
    self->R = config->model.R;
    set_from_model(self, config, in);
    self->omega_cross = in->omega;
    set_point(self, config, machine, in->omega, config->omega_min);
    self->i = in->i;
    /* the voltage's part in the last period, half a period back */
    const pm_q_t e = change_of(config, in->omega, self->psi_ref);
    const pm_q_t x = pm_frac(in->omega, config->model.t_s) / 2;
    const pm_dq_t at_k = {.d = -pm_shl(pm_mulh(in->i_dq.q, self->cross), 1),
                          .q = e + pm_shl(pm_mulh(in->i_dq.d, self->cross), 1)};
    const pm_dq_t half_back = {.d = at_k.d + pm_mul(x, at_k.q), .q = at_k.q - pm_mul(x, at_k.d)};
    self->change = pm_park_inverse(half_back, in->dir);
    self->i_q = in->i_dq.q;
    self->omega = in->omega;
    self->e = (pm_dq_t){.d = 0, .q = pm_shl(pm_sat(e, 27), 3)};
}

void emf_frame_step(emf_t *self, const emf_config_t *config, const obs_in_t *in, obs_out_t *out)
{
    pm_ab_t sum;
    const pm_ab_t change = emf_change(self, in, &sum);
    pm_dq_t e = pm_park_half(emf_pair(self, change), in->dir);
    e = emf_turned(self, (pm_dq_t){.d = pm_shl(pm_sat(e.d, 26), 3), .q = pm_shl(pm_sat(e.q, 26), 3)});
    e.d += pm_shl(pm_mulh(in->i_dq.q, self->cross), 4);
    e.q -= pm_shl(pm_mulh(in->i_dq.d, self->cross), 4);
    e.d = pm_mulh_add(self->e.d, pm_sub_sat(e.d, self->e.d), config->k_filter);
    e.q = pm_mulh_add(self->e.q, pm_sub_sat(e.q, self->e.q), config->k_filter);
    self->e = e;
    emf_describe(self, e, out);
}

obs_out_t emf_last(const emf_t *self)
{
    obs_out_t out;
    emf_describe(self, self->e, &out);
    return out;
}

/* Distance of E_q from the extended EMF: the error of R, times i_q. */
static pm_q_t lacking(const emf_t *self, const emf_config_t *config, pm_q_t saliency, pm_q_t E_q,
                      const obs_in_t *in)
{
    const pm_q_t change = pm_narrow_sat(pm_gain(in->i_dq.q - self->i_q, config->slow_rate));
    const pm_wide_t lag = pm_gain(in->omega - self->omega, config->speed_lag);
    const pm_q_t omega = pm_add_sat(in->omega, pm_narrow_sat(lag));
    const pm_q_t E_ex = pm_add_sat(pm_mul_sat(omega, self->psi_ref), pm_mul_sat(change, saliency));
    return pm_sub_sat(E_q, E_ex);
}

void emf_slow(emf_t *self, const emf_config_t *config, const emf_machine_t *machine, const obs_in_t *in,
              pm_q_t weight)
{
    const obs_out_t out = emf_last(self);
    if (weight == 0) {
        set_from_model(self, config, in);
        /* not with the loop's own speed: where it dips below the limit, E_q exceeds its w psi_a */
        self->R = observer_resistance(&config->resistance, &config->model, self->R, self->omega_cross,
                                      lacking(self, config, machine->saliency, out.vector.q, in), in->i_dq.q);
    } else {
        const pm_q_t lack = pm_mul(out.misfit, self->psi_ref);
        self->psi_ref = observer_amplitude(&config->model, in->i_dq, self->psi_ref, lack, &self->psi_a);
    }
    self->i_q = in->i_dq.q;
    self->omega = in->omega;
    const pm_q_t turned = pm_mul_sat(pm_abs(in->omega), config->slow_step); /* rad since the last */
    (void)pm_lp1(&self->omega_cross, in->omega, pm_small(turned));
    set_point(self, config, machine, in->omega, weight == 0 ? config->omega_tied : config->omega_min);
}
