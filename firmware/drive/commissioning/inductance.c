/* Inductances: flux over current of a square wave of voltage along one axis, the rotor standing on phase A.
 *
 *   L = sum s T_s (v - R i - lost) / sum s (i_k - i_k-1), s the sign of v: from -i to i and back, without
 * mean The torque of a wave on q has no mean either, and a half wave is too short to turn the rotor. Half
 * waves get longer until 0.4 v_dc drives the current wanted; the shortest makes R and lost voltage matter
 * least. A small wave gives L at zero current, one at the test current, with the i_d of most torque per
 * ampere, the apparent L_q there and by psi_d = L_d i_d + k i_q^2 / 2:    k = sum (dpsi_d - L_d di_d) x / sum
 * x^2, x = i_q di_q the cross inductance k i_q. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/root.h"

#define SHORTEST    2U
#define SHARE_SMALL PM_Q(0.3)

/* The i_d of most torque per ampere: h - sqrt(h^2 + i^2), h = psi_m / (2 (L_q - L_d)), but so much
 * that its leg's current has a sign; none without saliency. */
static pm_q_t best_i_d(const drive_t *drive, pm_q_t i_q)
{
    const commissioning_result_t *r = &drive->commissioning_report.result;
    const drive_base_t *base = &drive->config.base;
    const int32_t dL_nH = r->L_q_nH - r->L_d_nH;
    if (dL_nH < r->L_q_nH / 20) {
        return 0;
    }
    const pm_num_t psi = r->psi_m_nWb != 0
                             ? pm_num_dec(r->psi_m_nWb, -9)
                             : pm_num_mul(pm_num_from_fixed(drive->config.psi_m, PM_Q_BITS), base->psi);
    const pm_num_t h = pm_num_div(psi, pm_num_mul(pm_num_dec(2 * dL_nH, -9), base->i));
    pm_q_t x;
    (void)pm_num_to_fixed(h, PM_Q_BITS, &x);
    return pm_min(x > PM_Q(7.0) ? 0 : x - pm_hypot(x, i_q), -i_q / 8);
}

/* By the inductance at zero current: three quarters of the voltage that will be needed. */
static void foresee(const drive_t *drive, square_t *square)
{
    const pm_q_t flux = 2 * pm_mul(drive->commissioning.L_q, square->wanted);
    const pm_q_t top = pm_mul(drive->status.v_dc, PM_Q(0.3));
    const pm_q_t step = pm_max(pm_frac(top, drive->config.position.observer.active_flux.model.t_s), 1);
    const uint32_t half = (uint32_t)(flux / step) + 1U;
    square->half = (uint16_t)(half < SHORTEST ? SHORTEST : (half > SQUARE_LONGEST ? SQUARE_LONGEST : half));
    square->voltage = pm_mul(pm_mul(top, pm_div(flux, step * square->half)), PM_Q(0.8));
}

void inductance_enter(drive_t *drive, bool on_q, bool rated)
{
    commissioning_t *self = &drive->commissioning;
    const pm_q_t i = commissioning_current(drive);
    self->of.square = (square_t){
        .half = SHORTEST,
        .on_q = on_q,
        .leading = true,
        .voltage = drive->status.v_dc / 128,
        .wanted = rated ? i : pm_mul(i, SHARE_SMALL),
        .bias = rated ? -best_i_d(drive, i) : 0,
    };
    if (rated) {
        foresee(drive, &self->of.square);
    }
    self->of.square.count = (uint16_t)((uint32_t)self->of.square.half * 646U / 1000U);
    self->v = (pm_ab_t){0, 0};
    self->kind = KIND_SQUARE;
    current_control_reset(&drive->current, (pm_dq_t){0, 0});
}

static pm_num_t number(int64_t x)
{
    const pm_num_t upper = pm_num((int32_t)(x / 65536));
    const pm_num_t lower = pm_num((int32_t)(x % 65536));
    return pm_num_add(pm_num_mul(upper, pm_num(65536)), lower);
}

static pm_num_t inductance(const drive_t *drive)
{
    const commissioning_t *self = &drive->commissioning;
    const drive_base_t *base = &drive->config.base;
    const pm_num_t ratio = pm_num_div(number(self->sum[SUM_FLUX]), number(self->sum[SUM_CURRENT]));
    return pm_num_mul(ratio, pm_num_div(pm_num_mul(base->t_s, base->v), base->i));
}

static pm_num_t cross(const drive_t *drive)
{
    const commissioning_t *self = &drive->commissioning;
    const drive_base_t *base = &drive->config.base;
    const pm_num_t L_d = pm_num_dec(drive->commissioning_report.result.L_d_nH, -9);
    const pm_num_t unit = pm_num_div(pm_num_mul(base->t_s, base->v), base->i);
    const pm_num_t flux = pm_num_mul(number(self->sum[SUM_D_FLUX]), unit);
    const pm_num_t current = pm_num_mul(number(self->sum[SUM_D_CURRENT]), L_d);
    const pm_num_t k =
        pm_num_div(pm_num_sub(flux, current), number(self->sum[SUM_SQUARE])); /* per base current */
    return pm_num_mul(k, pm_num_from_fixed(commissioning_current(drive), PM_Q_BITS));
}

static void conclude_small(drive_t *drive, bool on_q, pm_num_t L)
{
    commissioning_t *self = &drive->commissioning;
    commissioning_result_t *r = &drive->commissioning_report.result;
    const drive_base_t *base = &drive->config.base;
    const int32_t L_nH = commissioning_decimal(L, 9);
    pm_q_t per_unit;
    (void)pm_num_to_fixed(pm_num_div(pm_num_mul(L, base->i), base->psi), PM_Q_BITS, &per_unit);
    if (on_q) {
        r->L_q_nH = L_nH;
        r->L_q_rated_nH = L_nH; /* until that has been measured */
        r->L_dq_rated_nH = 0;
        self->L_q = per_unit;
    } else {
        const pm_num_t R = pm_num_mul(pm_num_from_fixed(self->R, PM_Q_BITS), pm_num_div(base->v, base->i));
        r->L_d_nH = L_nH;
        self->L_d = per_unit;
        commissioning_set_gains(drive, R, L);
    }
}

phase_result_t inductance_slow(drive_t *drive, bool on_q, bool rated)
{
    commissioning_t *self = &drive->commissioning;
    commissioning_result_t *r = &drive->commissioning_report.result;
    if (self->of.square.failed) {
        return (phase_result_t){.failed = COMMISSIONING_NO_CURRENT};
    }
    if (!self->of.square.done) {
        return (phase_result_t){.done = false};
    }
    if (self->sum[SUM_FLUX] <= 0 || self->sum[SUM_CURRENT] <= 0) {
        return (phase_result_t){.failed = COMMISSIONING_IMPLAUSIBLE};
    }
    const pm_num_t L = inductance(drive);
    if (!rated) {
        conclude_small(drive, on_q, L);
    } else {
        r->L_q_rated_nH = commissioning_decimal(L, 9);
        r->L_dq_rated_nH = self->of.square.bias != 0 ? commissioning_decimal(cross(drive), 9) : 0;
    }
    return (phase_result_t){.done = true};
}
