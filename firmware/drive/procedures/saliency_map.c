#include "firmware/drive/procedures/saliency_map.h"

#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(saliency_map)

#define SETTLED_MS 60U /* with the current where it shall be, so that the carrier's answer has settled too */
#define LATEST_MS  2000U
#define LAST       (SALIENCY_MAP_POINTS + 1)
#define ROUND      64 /* I_p over I_n of a machine without an axis */
#define TURNED     PM_TURN(2.0 / 360)
#define ZERO       (SALIENCY_MAP_SIDE / 2) /* column of i_d = 0 */

static bool is_on_map(const saliency_map_t *self)
{
    return self->at > 0U && self->at < (uint8_t)LAST;
}

static int32_t column_of(const saliency_map_t *self)
{
    return ((int32_t)self->at - 1) % SALIENCY_MAP_SIDE;
}

static int32_t row(const saliency_map_t *self)
{
    return ((int32_t)self->at - 1) / SALIENCY_MAP_SIDE;
}

/* Of this point, stationary frame. */
static pm_ab_t wanted(const drive_t *drive)
{
    const saliency_map_t *self = &drive->procedure.saliency_map;
    if (!is_on_map(self)) {
        return (pm_ab_t){0, 0};
    }
    const pm_q_t quarter = drive->saliency_map.i / 4;
    return pm_park_inverse((pm_dq_t){.d = quarter * (column_of(self) - ZERO), .q = quarter * row(self)},
                           pm_dir(self->theta));
}

static void enter(drive_t *drive, uint8_t at)
{
    saliency_map_t *self = &drive->procedure.saliency_map;
    self->at = at;
    self->ms = 0;
    self->hold.still = 0;
    self->axes = 0;
    saliency_circle_reset(&self->circle);
    drive->commissioning_report.progress = (uint8_t)(100U * (uint32_t)at / (uint32_t)(LAST + 1));
}

void procedure_saliency_map_begin(drive_t *drive)
{
    drive->commissioning_report.routines = (uint8_t)COMMISSIONING_SALIENCY;
    procedure_report(drive, COMMISSIONING_RUNNING, COMMISSIONING_NO_REASON);
    drive->saliency_map = (saliency_map_result_t){.i = commissioning_current(drive)};
    sine_reset(&drive->procedure.saliency_map.sine, &drive->config.saliency_map.sine, (pm_dq_t){0, 0});
    enter(drive, 0);
}

PM_APART pm_procedure_t procedure_saliency_map_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    saliency_map_t *self = &drive->procedure.saliency_map;
    const saliency_map_config_t *c = &drive->config.saliency_map;
    const pm_dq_t i = {.d = drive->i_ab.alpha, .q = drive->i_ab.beta};
    const pm_angle_t phi = sine_step(&self->sine, &c->sine, i);
    const pm_ab_t carrier = carrier_along(pm_unit(c->sine.v_h, pm_dir(phi).cos), pm_dir(self->axis));
    const pm_ab_t v = {.alpha = self->hold.v.alpha + carrier.alpha, .beta = self->hold.v.beta + carrier.beta};
    self->axis += c->turn;
    drive->status.i = i;
    drive->status.theta = self->theta;
    drive->v_next = v;
    commissioning_write_legs(drive, self->rest, pm_clarke_inverse(v), out);
    return PM_RUNNING; /* its slow part knows the end */
}

/* The current of this point is there. */
static bool holds(drive_t *drive)
{
    saliency_map_t *self = &drive->procedure.saliency_map;
    const saliency_map_config_t *c = &drive->config.saliency_map;
    commissioning_hold(drive, &self->hold, wanted(drive), sine_mean(&self->sine, &c->sine), c->omega);
    return self->hold.still >= SETTLED_MS;
}

static void swap(saliency_point_t *a, saliency_point_t *b)
{
    const saliency_point_t one = {b->L_d, b->L_q, -b->L_dq};
    *b = (saliency_point_t){a->L_d, a->L_q, -a->L_dq};
    *a = one;
}

/* The axis that was found is that of the south pole: half a turn on, i_d and i_q have the other signs, and L_dq
 * is odd in i_q. */
static void turn_round(drive_t *drive)
{
    saliency_map_result_t *map = &drive->saliency_map;
    drive->procedure.saliency_map.theta += PM_TURN(0.5);
    for (int32_t n = 0; n < SALIENCY_MAP_SIDE; n++) {
        swap(&map->point[n][0], &map->point[n][4]);
        swap(&map->point[n][1], &map->point[n][3]);
        map->point[n][ZERO].L_dq = -map->point[n][ZERO].L_dq;
    }
}

static pm_q_t along(pm_q_t a, pm_q_t b, pm_q_t share)
{
    return a + pm_mul(b - a, share);
}

/* In a row, at i_d of the drive there. */
static saliency_point_t on_trajectory(const drive_t *drive, int32_t n)
{
    const saliency_map_result_t *map = &drive->saliency_map;
    const pm_q_t quarter = map->i / 4;
    const pm_q_t i_d = drive->config.saliency_map.best ? commissioning_best_i_d(drive, quarter * n) : 0;
    const pm_q_t at = pm_clamp(pm_div(i_d, quarter), -ZERO * PM_ONE, 0); /* columns from the middle */
    const int32_t left = at < -PM_ONE ? 0 : 1;
    const pm_q_t share = at + (ZERO - left) * PM_ONE;
    const saliency_point_t *a = &map->point[n][left];
    const saliency_point_t *b = &map->point[n][left + 1];
    return (saliency_point_t){.L_d = along(a->L_d, b->L_d, share),
                              .L_q = along(a->L_q, b->L_q, share),
                              .L_dq = along(a->L_dq, b->L_dq, share)};
}

static void conclude(drive_t *drive)
{
    saliency_map_result_t *map = &drive->saliency_map;
    commissioning_result_t *r = &drive->commissioning_report.result;
    const bool falls = map->point[0][SALIENCY_MAP_SIDE - 1].L_d < map->point[0][0].L_d;
    if (falls == drive->config.saliency_map.reversed) {
        turn_round(drive);
    }
    r->L_d = map->point[0][ZERO].L_d;
    r->L_q = map->point[0][ZERO].L_q;
    map->half = on_trajectory(drive, 2);
    map->rated = on_trajectory(drive, 4);
}

static pm_procedure_t take(drive_t *drive)
{
    saliency_map_t *self = &drive->procedure.saliency_map;
    saliency_map_result_t *map = &drive->saliency_map;
    const saliency_fit_t fit = saliency_circle_fit(&self->circle);
    if (fit.centre < map->i / ROUND) {
        return PM_FAILED_NO_CURRENT;
    }
    if (is_on_map(self)) {
        saliency_point_t *point = &map->point[row(self)][column_of(self)];
        *point = saliency_circle_inductances(&self->circle, self->theta, drive->config.saliency_map.flux);
        return point->L_d > 0 && point->L_q > 0 ? PM_RUNNING : PM_FAILED_IMPLAUSIBLE;
    }
    if (fit.radius < fit.centre / ROUND) {
        return PM_FAILED_SALIENCY;
    }
    if (self->at == 0U) {
        self->theta = fit.angle;
        map->centre = fit.centre;
        map->radius = fit.radius;
        return PM_RUNNING;
    }
    const pm_angle_t twice = 2U * (fit.angle - self->theta); /* either pole */
    if (pm_abs(pm_angle_diff(twice, 0U)) > (int32_t)(2U * TURNED)) {
        return PM_FAILED_TURNED;
    }
    conclude(drive);
    return PM_DONE;
}

static commissioning_reason_t reason_of(pm_procedure_t result)
{
    switch (result) {
    case PM_FAILED_NO_CURRENT:
        return COMMISSIONING_NO_CURRENT;
    case PM_FAILED_SALIENCY:
        return COMMISSIONING_ROUND;
    case PM_FAILED_TURNED:
        return COMMISSIONING_TURNED;
    case PM_FAILED_IMPLAUSIBLE:
    default:
        return COMMISSIONING_IMPLAUSIBLE;
    }
}

static pm_procedure_t finish(drive_t *drive, pm_procedure_t result)
{
    if (result == PM_DONE) {
        procedure_report(drive, COMMISSIONING_DONE, COMMISSIONING_NO_REASON);
    } else {
        procedure_report(drive, COMMISSIONING_FAILED, reason_of(result));
        drive->saliency_map = (saliency_map_result_t){.i = 0};
    }
    return result;
}

pm_procedure_t procedure_saliency_map_slow(drive_t *drive)
{
    saliency_map_t *self = &drive->procedure.saliency_map;
    const saliency_map_config_t *c = &drive->config.saliency_map;
    self->ms++;
    const bool held = holds(drive);
    if (self->ms > LATEST_MS) {
        return finish(drive, PM_FAILED_NO_CURRENT);
    }
    if (!held && self->axes == 0U) {
        return PM_RUNNING;
    }
    saliency_circle_add(&self->circle, pm_dir(self->axis - c->since),
                        window_cosine(&self->sine.window, c->sine.per_n),
                        window_sine(&self->sine.window, c->sine.per_n));
    self->axes++;
    if (self->axes < (uint16_t)SALIENCY_CIRCLE_AXES) {
        return PM_RUNNING;
    }
    const pm_procedure_t result = take(drive);
    if (result != PM_RUNNING) {
        return finish(drive, result);
    }
    enter(drive, (uint8_t)(self->at + 1U));
    return PM_RUNNING;
}

void procedure_saliency_map_abort(drive_t *drive)
{
    drive->saliency_map = (saliency_map_result_t){.i = 0};
}

#endif
