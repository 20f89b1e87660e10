#include "firmware/drive/rest.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/params/maker.h"

#if PM_HAS(carrier_rest)

/* The EMF through 10 ms, the current through 100, at 1 kHz. */
#define K_EMF     PM_FRAC(0.1)
#define K_CURRENT PM_FRAC(0.01)

static bool nothing_wanted(const drive_t *drive)
{
    const bool torque = drive->command.mode == DRIVE_MODE_TORQUE;
    const bool zero =
        torque ? drive->torque_target == 0 : drive->omega_target == 0 && drive->speed.reference == 0;
    return zero && drive->state == DRIVE_RUNNING;
}

static bool moves(rest_t *self, const rest_config_t *c, const drive_t *drive)
{
    const pm_q_t d = pm_lp1(&self->mean.d, pm_narrow(drive->voltage.v.d), K_EMF);
    const pm_q_t q = pm_lp1(&self->mean.q, pm_narrow(drive->voltage.v.q), K_EMF);
    return pm_max(pm_abs(d), pm_abs(q)) > c->emf;
}

PM_RARE void rest_slow(drive_t *drive)
{
    const rest_config_t *c = &drive->config.rest;
    rest_t *self = &drive->rest;
    position_t *position = &drive->position;
    const bool idle = nothing_wanted(drive);
    if (position->rests) {
        self->ms++;
        drive->i_ref = (pm_dq_t){0, 0};
        if (!idle || moves(self, c, drive) || self->ms > REST_LOOK_MS) {
            position->rests = false;
            self->mean.q = 0;
            self->ms = (uint16_t)pm_max(0, (int32_t)c->after_ms - REST_AWAKE_MS);
        }
        return;
    }
    const pm_q_t i_q = pm_lp1(&self->mean.q, drive->i_ref.q, K_CURRENT);
    const bool quiet =
        idle && position->inject && pm_abs(position->pll.omega) < c->omega && pm_abs(i_q) < c->i_q;
    self->ms = quiet ? (uint16_t)(self->ms + 1U) : 0U;
    if (self->ms > c->after_ms) {
        self->ms = 0;
        self->mean = (pm_dq_t){0, 0};
        position_rest(position);
        speed_control_reset(&drive->speed, 0, 0);
        drive->i_ref = (pm_dq_t){0, 0};
    }
}

void make_rest(maker_t *m, rest_config_t *c)
{
    const pm_num_t omega = pm_num(REST_OMEGA);
    const pm_num_t emf = pm_num_mul(si(m, DRIVE_PARAM_psi_m), omega);
    c->after_ms = (uint16_t)m->params->injection_rest;
    c->emf = fixed(m, pm_num_div(emf, m->base.v), Q_BITS, DRIVE_PARAM_psi_m);
    c->omega = fixed(m, pm_num_div(omega, m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
    c->i_q = fixed(m, pm_num_div(si(m, DRIVE_PARAM_i_rated), pm_num_mul(pm_num(32), m->base.i)), Q_BITS,
                   DRIVE_PARAM_i_rated);
}

#endif
