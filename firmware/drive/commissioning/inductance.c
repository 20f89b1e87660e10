/* Inductances: flux over current of a square wave of voltage along one axis, with the rotor on phase A.
 *
 * From -i to i and back, without mean, s the sign of v:
 *   L = sum s T_s (v - R i - lost) / sum s (i_k - i_k-1)
 * The torque of a wave on q has no mean either, and a half wave is too short to turn the rotor. Half waves
 * get longer until 0.4 v_dc drives the wanted current: with the shortest, R and lost voltage matter least.
 *
 * A small wave gives L at zero current. One at the test current, with the i_d of most torque per ampere,
 * gives the apparent L_q there and, by psi_d = L_d i_d + k i_q^2 / 2, the cross inductance k i_q:
 *   x = i_q di_q
 *   k = sum (dpsi_d - L_d di_d) x / sum x^2 */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/num.h"
#include "firmware/math/root.h"

#define SHORTEST    2U
#define SHARE_SMALL PM_Q(0.3)
#define SHARE_FAR   PM_Q(0.8)
/* Whole waves. With negative i_d the rotor is in unstable equilibrium: the time must be short. */
#define SETTLE_CYCLES        3U
#define CYCLES               24U
#define BIASED_SETTLE_CYCLES 1U
#define BIASED_CYCLES        2U
/* Of products, before they are divided by their number. */
#define FINE 65536

/* The i_d of most torque per ampere, but large enough that the sign of its leg's current is certain; none
 * without saliency:
 *   i_d = h - sqrt(h^2 + i^2),   h = psi_m / (2 (L_q - L_d)) */
pm_q_t commissioning_best_i_d(const drive_t *drive, pm_q_t i_q)
{
    const commissioning_result_t *r = &drive->commissioning_report.result;
    const pm_q_t dL = r->L_q - r->L_d;
    if (dL < r->L_q / 20) {
        return 0;
    }
    const pm_q_t psi = r->psi_m != 0 ? r->psi_m : drive->config.machine.psi_m;
    const pm_q_t h = pm_div(psi / 2, dL);
    return pm_min(h > PM_Q(7.0) ? 0 : h - pm_hypot(h, i_q), -i_q / 8);
}

/* From the inductance at zero current: four fifths of the voltage that will be needed. */
static void foresee(const drive_t *drive, square_t *square)
{
    const pm_q_t flux = 2 * pm_mul(drive->procedure.identify.L_q, square->wanted);
    const pm_q_t top = pm_mul(drive->status.v_dc, PM_Q(0.3));
    const pm_q_t step = pm_max(pm_mul(top, commissioning_period(drive)), 1);
    const uint32_t half = (uint32_t)(flux / step) + 1U;
    square->half = (uint16_t)(half < SHORTEST ? SHORTEST : (half > SQUARE_LONGEST ? SQUARE_LONGEST : half));
    square->voltage = pm_mul(pm_mul(top, pm_div(flux, step * square->half)), PM_Q(0.8));
}

void inductance_enter(drive_t *drive, bool on_q, bool rated)
{
    identify_t *self = &drive->procedure.identify;
    const pm_q_t i = rated ? commissioning_current(drive) : pm_mul(commissioning_current(drive), SHARE_SMALL);
    const pm_q_t bias = rated ? -commissioning_best_i_d(drive, i) : 0;
    const uint32_t settled = bias != 0 ? BIASED_SETTLE_CYCLES : SETTLE_CYCLES;
    self->of.square = (square_t){
        .half = SHORTEST,
        .settled = (uint8_t)settled,
        .enough = (uint8_t)(settled + (bias != 0 ? BIASED_CYCLES : CYCLES)),
        .on_q = on_q,
        .leading = true,
        .voltage = drive->status.v_dc / 128,
        .wanted = i,
        .far = pm_mul(i, SHARE_FAR),
        .bias = bias,
        .third = drive->procedure.identify.lost / 3,
    };
    if (rated) {
        foresee(drive, &self->of.square);
    }
    self->of.square.count = (uint16_t)((uint32_t)self->of.square.half * 646U / 1000U);
    self->v = (pm_ab_t){0, 0};
    self->kind = KIND_SQUARE;
    self->axis_d.integral = 0;
}

/* Products of two signals have twice their fractional bits. */
static pm_q_t mean_product(const identify_t *self, uint32_t n)
{
    return (pm_q_t)pm_quotient(self->sum[n] / FINE, self->samples);
}

/* Flux per T_s: the voltage, whose amplitude is the same in all periods, less R i and lost voltage. */
static pm_q_t per_unit(const drive_t *drive)
{
    const identify_t *self = &drive->procedure.identify;
    const square_t *square = &self->of.square;
    const pm_q_t edges = (pm_q_t)pm_quotient((int64_t)square->negative * PM_ONE, self->samples);
    const pm_q_t lost =
        pm_mul(pm_mul(edges, self->lost), square->on_q ? PM_Q(0.577350269) : PM_Q(0.333333333));
    const pm_q_t w = square->voltage - pm_mul(self->R, commissioning_mean(self, SUM_CURRENT)) - lost;
    return pm_div(pm_mul(w, commissioning_period(drive)), commissioning_mean(self, SUM_CHANGE));
}

static pm_q_t cross(const drive_t *drive)
{
    const identify_t *self = &drive->procedure.identify;
    const pm_q_t flux = pm_mul(mean_product(self, SUM_D_FLUX), commissioning_period(drive));
    const pm_q_t current = pm_mul(mean_product(self, SUM_D_CHANGE), drive->commissioning_report.result.L_d);
    const pm_q_t slope = pm_div(flux - current, mean_product(self, SUM_SQUARE));
    return pm_mul_sat(slope, commissioning_current(drive));
}

/* The amplitude was found with positive i_d; with negative i_d there is less saturation, so less current. */
static pm_q_t at_test_current(const drive_t *drive, pm_q_t L)
{
    const identify_t *self = &drive->procedure.identify;
    const pm_q_t L_q = drive->commissioning_report.result.L_q;
    const pm_q_t peak = pm_half((int32_t)self->of.square.half * commissioning_mean(self, SUM_CHANGE));
    const pm_q_t short_of = pm_min(pm_div(commissioning_current(drive), peak), PM_Q(1.25));
    return L_q + pm_mul(L - L_q, pm_mul(short_of, short_of));
}

static void conclude(drive_t *drive, bool on_q, bool rated, pm_q_t L)
{
    identify_t *self = &drive->procedure.identify;
    commissioning_result_t *r = &drive->commissioning_report.result;
    if (rated) {
        r->L_q_rated = at_test_current(drive, L);
        r->L_dq_rated = self->of.square.bias != 0 ? cross(drive) : 0;
    } else if (on_q) {
        r->L_q = L;
        r->L_q_rated = L; /* until that has been measured */
        r->L_dq_rated = 0;
        self->L_q = L;
    } else {
        r->L_d = L;
        self->L_d = L;
        commissioning_set_gains(drive);
    }
}

phase_result_t inductance_slow(drive_t *drive, bool on_q, bool rated)
{
    const identify_t *self = &drive->procedure.identify;
    if (self->of.square.state == (uint8_t)SQUARE_FAILED) {
        return (phase_result_t){.failed = COMMISSIONING_NO_CURRENT};
    }
    if (self->of.square.state != (uint8_t)SQUARE_DONE) {
        return (phase_result_t){.done = false};
    }
    const pm_q_t L = self->sum[SUM_CHANGE] > 0 ? per_unit(drive) : 0;
    if (L <= 0) {
        return (phase_result_t){.failed = COMMISSIONING_IMPLAUSIBLE};
    }
    conclude(drive, on_q, rated, L);
    return (phase_result_t){.done = true};
}
