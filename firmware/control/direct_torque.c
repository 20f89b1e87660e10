#include "firmware/control/direct_torque.h"

#include "firmware/control/switch_states.h"

#if REGULATION_HOLDS

/* Of the square of the flux: 1 and 2 % of the flux. */
#define FLUX_BAND PM_FRAC(0.02)
#define FLUX_WIDE PM_FRAC(0.04)

void direct_torque_reset(direct_torque_t *self, const direct_torque_config_t *config, pm_dq_t v, pm_dq_t i,
                         pm_q_t omega)
{
    (void)omega;
    self->psi = winding_flux(&config->model, i);
    self->v = v;
    self->legs = PM_LEGS_ALL(PM_LEG_LOW);
    self->torque = 0;
    self->flux = 1;
}

static inline pm_q_t torque_of(pm_dq_t psi, pm_dq_t i)
{
    return pm_sub_sat(pm_mul_sat(psi.d, i.q), pm_mul_sat(psi.q, i.d));
}

static inline pm_q_t square_of(pm_dq_t psi)
{
    return pm_add_sat(pm_mul_sat(psi.d, psi.d), pm_mul_sat(psi.q, psi.q));
}

/* The flux at the end of the period. */
static inline pm_dq_t flux_after(const direct_torque_t *self, const direct_torque_config_t *c,
                                 const regulator_in_t *in)
{
    const pm_dq_t seen = winding_flux(&c->model, in->i);
    const pm_dq_t psi = {.d = pm_frac_add(self->psi.d, pm_sub_sat(seen.d, self->psi.d), c->k_drift),
                         .q = pm_frac_add(self->psi.q, pm_sub_sat(seen.q, self->psi.q), c->k_drift)};
    const pm_q_t drop_d = pm_mul_sat(c->model.R, in->i.d);
    const pm_q_t drop_q = pm_mul_sat(c->model.R, in->i.q);
    const pm_q_t moves_d = pm_mul_sat(c->per_period, pm_sub_sat(self->v.d, drop_d));
    const pm_q_t moves_q = pm_mul_sat(c->per_period, pm_sub_sat(self->v.q, drop_q));
    const pm_q_t turn = pm_mul_sat(c->per_period, in->omega);
    const pm_dq_t half = {
        .d = pm_add_sat(psi.d, pm_half(pm_add_sat(moves_d, pm_mul_sat(turn, psi.q)))),
        .q = pm_add_sat(psi.q, pm_half(pm_sub_sat(moves_q, pm_mul_sat(turn, psi.d)))),
    };
    return (pm_dq_t){.d = pm_add_sat(psi.d, pm_add_sat(moves_d, pm_mul_sat(turn, half.q))),
                     .q = pm_add_sat(psi.q, pm_sub_sat(moves_q, pm_mul_sat(turn, half.d)))};
}

/* Up or down beyond the band, until the reference is passed. */
static inline int8_t three_levels(int8_t level, pm_q_t error, pm_q_t band)
{
    if (error > band) {
        return 1;
    }
    if (error < -band) {
        return -1;
    }
    const bool passed = (level > 0 && error < 0) || (level < 0 && error > 0);
    return passed ? 0 : level;
}

static inline int8_t two_levels(int8_t level, pm_q_t error, pm_q_t band)
{
    if (error > band) {
        return 1;
    }
    return error < -band ? -1 : level;
}

/* From the sector of the flux to that of the state; SWITCH_SECTORS: a zero state. */
static inline uint32_t sectors_on(const direct_torque_t *self, bool far)
{
    if (self->torque == 0) {
        const uint32_t along = self->flux > 0 ? 0U : 3U;
        return far ? along : SWITCH_SECTORS;
    }
    if (self->flux > 0) {
        return self->torque > 0 ? 1U : 5U;
    }
    return self->torque > 0 ? 2U : 4U;
}

static void give(direct_torque_t *self, uint32_t on, const regulator_in_t *in, regulator_out_t *out)
{
    if (on == SWITCH_SECTORS) {
        self->v = (pm_dq_t){.d = 0, .q = 0};
        self->legs = switch_zero(self->legs);
    } else {
        const uint32_t sum = switch_nearest(pm_park_inverse_quarter(self->psi, in->ahead)).sector + on;
        const uint32_t sector = sum < SWITCH_SECTORS ? sum : sum - SWITCH_SECTORS;
        self->v = switch_voltage(sector, in->v_dc, in->ahead);
        self->legs = switch_legs[sector];
    }
    out->v = (pm_dq_t){.d = pm_widen(self->v.d), .q = pm_widen(self->v.q)};
    out->legs = self->legs;
}

void direct_torque_step(direct_torque_t *self, const direct_torque_config_t *config, const regulator_in_t *in,
                        regulator_out_t *out)
{
    const direct_torque_config_t *c = config;
    const pm_dq_t i = winding_after(&c->model, self->v, in->i, in->omega);
    self->psi = flux_after(self, c, in);
    const pm_dq_t wanted = winding_flux(&c->model, in->i_ref);
    const pm_q_t torque_error = pm_sub_sat(torque_of(wanted, in->i_ref), torque_of(self->psi, i));
    const pm_q_t top = square_of(wanted);
    const pm_q_t flux_error = pm_sub_sat(top, square_of(self->psi));
    self->torque = three_levels(self->torque, torque_error, c->torque_band);
    self->flux = two_levels(self->flux, flux_error, pm_frac(top, FLUX_BAND));
    give(self, sectors_on(self, pm_abs(flux_error) > pm_frac(top, FLUX_WIDE)), in, out);
    const pm_dq_t e = {.d = pm_sub_sat(in->i_ref.d, i.d), .q = pm_sub_sat(in->i_ref.q, i.q)};
    out->limited = out->limited || winding_beyond(&c->model, e, in->v_dc);
}

void direct_torque_slow_down(direct_torque_config_t *config, pm_unit_t share)
{
    (void)config;
    (void)share;
}

#endif
