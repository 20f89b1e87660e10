/* The steps of symmetrical.c where the drop of a closed switch turns over with its current.
 *
 * Outside the zone (bridge.h) a drop is constant, within it a cubic of the current, which moves nearly evenly
 * with the time. A step that ends where a turn begins or ends is smooth; one across that is not. */
#ifndef PLANT_SYMMETRICAL_DROPS_H
#define PLANT_SYMMETRICAL_DROPS_H

#include "sim_plant/symmetrical_rates.h"

#include <math.h>

/* While the drop of a closed switch turns over, it is a cubic of the time: of a whole turn d says half, of
 * parts less. Where the turn begins or ends within the step d says less than it should. */
#define TURNING 0.5
#define KINK    4.0
/* In units of the zone: a step that ends within EDGE of where a turn begins or ends counts as there; it aims
 * PAST behind an end, so as not to leave a sliver; beyond FAR of the currents' rates a drop is constant. */
#define ZONE_EDGE 0.01
#define ZONE_PAST 0.003
#define ZONE_FAR  4.0

/* What d says of a step over which drops have moved. */
INLINE double drop_part(const tied_t *from, const tied_t *to, shape_t shape, double part)
{
    for (int k = 0; k < shape.legs; k++) {
        if (from->share[k / 3][k % 3] != to->share[k / 3][k % 3]) {
            double most = larger(fabs(from->zones[k / 3][k % 3]), fabs(to->zones[k / 3][k % 3]));
            part = larger(part, most > 1.0 + ZONE_EDGE ? KINK : TURNING);
        }
    }
    return part;
}

/* Of a leg whose current is x now and moves with a speed: how long the step may be. */
INLINE double turn_s(const circuit_t *c, double x, double speed, double h)
{
    double ahead = speed > 0.0 ? x : -x; /* towards the end of a turn at 1 */
    bool turning = ahead >= -1.0 - ZONE_EDGE;
    double edge = turning ? 1.0 + ZONE_PAST : -1.0;
    if (ahead > 1.0 - ZONE_PAST) {
        return h;
    }
    if (ahead + fabs(speed) * h > edge) {
        h = (edge - ahead) / fabs(speed);
    }
    if (turning) {
        double d_Wb =
            c->bridge.v_switch_V / 3.0 * fabs(1.5 * x + 0.5 * speed * h) * speed * speed * h * h * h;
        double error = TURNING * d_Wb * c->inv_u_scale * c->inv_tolerance;
        h = error > 0.9 ? h * cbrt(0.9 / error) : h;
    }
    return h;
}

/* Whether the drops of all closed switches are constant for so long; how fast their currents move, in units of
 * the zone. */
INLINE bool all_far(const circuit_t *c, shape_t shape, const start_t *s, double h, trio_t speed[])
{
    trio_mask_t near = {0};
    for (int g = 0; g < groups(shape); g++) {
        trio_t switched, x = s->tied.zones[g], end;
        legs_at(c->bridge.inv_zone_1_A, g, &switched);
        along_group(&c->machine.winding, shape, g, s->i_A_s, &speed[g]);
        speed[g] *= switched;
        end = x + speed[g] * h;
        trio_mask_t above = (x > ZONE_FAR) & (end > ZONE_FAR), below = (x < -ZONE_FAR) & (end < -ZONE_FAR);
        near |= ~(above | below) & (switched != 0.0);
    }
    return !trio_any(&near);
}

/* Steps end where the drop of a closed switch begins or ceases to turn over, and while it does are as long as
 * the error of that allows. */
INLINE double zone_s(const circuit_t *c, start_t *s, shape_t shape, double h)
{
    const bridge_t *b = &c->bridge;
    trio_t speeds[PLANT_SETS];
    s->steady = b->v_switch_V == 0.0 || all_far(c, shape, s, h, speeds);
    for (int k = 0; k < shape.legs && !s->steady; k++) {
        double x = s->tied.zones[k / 3][k % 3], speed = speeds[k / 3][k % 3];
        double end = x + speed * h;
        if (b->inv_zone_1_A[k] == 0.0 || (x > ZONE_FAR && end > ZONE_FAR) ||
            (x < -ZONE_FAR && end < -ZONE_FAR)) {
            continue;
        }
        if (!(x >= 1.0 && end >= 1.0) && !(x <= -1.0 && end <= -1.0)) {
            h = turn_s(c, x, speed, h);
        }
    }
    return h;
}

#endif
