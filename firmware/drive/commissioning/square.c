/* The square wave that measures an inductance, period by period; see inductance.c. */
#include "firmware/drive/commissioning/commissioning_parts.h"
#include "firmware/math/compiler.h"

/* -1 for each edge at which a leg's current was negative. The current changes while legs differ: the leg that
 * is up longest switches before and after that, the one that is up shortest in the middle of it. */
PM_INLINE int32_t edges(pm_q_t from, pm_q_t to, pm_q_t u, pm_q_t edge)
{
    const pm_q_t moved = to - from;
    const pm_q_t before = u > edge ? 0 : (u < -edge ? pm_half(moved) : pm_half(pm_half(moved)));
    return (from + before < 0 ? -1 : 0) + (to - before < 0 ? -1 : 0);
}

/* Factors of the lost voltage; the common part of the legs does not count. */
typedef struct {
    int32_t alpha; /* thirds */
    int32_t beta;  /* 1 / sqrt(3) */
} edges_t;

static inline edges_t edges_of(const square_t *square, pm_abc_t i, pm_ab_t v)
{
    const pm_q_t edge = pm_half(pm_half(square->voltage));
    const pm_abc_t u = pm_clarke_inverse(v);
    const int32_t a = edges(square->i_last.a, i.a, u.a, edge);
    const int32_t b = edges(square->i_last.b, i.b, u.b, edge);
    const int32_t c = edges(square->i_last.c, i.c, u.c, edge);
    return (edges_t){.alpha = 2 * a - b - c, .beta = b - c};
}

static inline void sum_axis(identify_t *self, pm_q_t i, pm_q_t di, int32_t negative, bool positive)
{
    self->sum[SUM_CURRENT] += positive ? i : -i;
    self->sum[SUM_CHANGE] += positive ? di : -di;
    self->of.square.negative += positive ? negative : -negative;
    self->samples++;
}

/* The sums of full products stay below 16 i^4. */
static inline void sum_other(identify_t *self, pm_q_t v, pm_ab_t i, pm_ab_t di, int32_t negative)
{
    const square_t *square = &self->of.square;
    if (pm_magnitude(i.beta) > square->far) {
        const pm_q_t x = pm_mul(i.beta, di.beta);
        const pm_q_t w = v - pm_mul(self->R, i.alpha) - negative * square->third;
        self->sum[SUM_D_FLUX] += (int64_t)w * x;
        self->sum[SUM_D_CHANGE] += (int64_t)di.alpha * x;
        self->sum[SUM_SQUARE] += (int64_t)x * x;
    }
}

static inline void take(identify_t *self, pm_ab_t i, pm_abc_t legs, pm_ab_t v)
{
    const square_t *square = &self->of.square;
    const pm_ab_t last = square->last;
    const pm_ab_t di = {.alpha = i.alpha - last.alpha, .beta = i.beta - last.beta};
    const pm_ab_t mean = {.alpha = last.alpha + pm_half(di.alpha), .beta = last.beta + pm_half(di.beta)};
    const edges_t n = edges_of(square, legs, v);
    if (square->on_q) {
        sum_axis(self, mean.beta, di.beta, n.beta, v.beta >= 0);
        if (square->bias != 0) {
            sum_other(self, v.alpha, mean, di, n.alpha);
        }
    } else {
        sum_axis(self, mean.alpha, di.alpha, n.alpha, v.alpha >= 0);
    }
}

/* A whole wave has ended, in the middle of its rise: the current is zero, and a change of the voltage here
 * leaves no mean, which would turn the rotor. */
static void judge(drive_t *drive, square_t *square)
{
    if (square->leading) {
        square->leading = false; /* not a whole one */
    } else if (square->state == (uint8_t)SQUARE_MEASURES) {
        square->cycles++;
        if (square->cycles >= square->enough) {
            square->state = (uint8_t)SQUARE_DONE;
        }
    } else if (pm_min(square->top, square->low) >= square->wanted) {
        square->state = (uint8_t)SQUARE_MEASURES;
        square->bias = -square->bias;
        commissioning_clear_sums(&drive->procedure.identify);
    } else {
        square->voltage += square->voltage / 12;
        if (square->voltage > pm_mul(drive->status.v_dc, PM_Q(0.4))) {
            square->voltage /= 2;
            square->half = (uint16_t)(2U * square->half);
            square->count = square->half / 2U;
            if (square->half > SQUARE_LONGEST) {
                square->state = (uint8_t)SQUARE_FAILED;
            }
        }
    }
    square->top = 0;
    square->low = 0;
}

/* The first waves are chosen so that the rotor's speed is zero at the peaks of the current: then its mean
 * speed is zero, too. */
static void flip(square_t *square)
{
    square->count = square->leading ? (uint16_t)((uint32_t)square->half * 146U / 1000U) : 0U;
    square->up = !square->up;
}

static void move(drive_t *drive, pm_ab_t v_past)
{
    identify_t *self = &drive->procedure.identify;
    square_t *square = &self->of.square;
    const pm_q_t i = square->on_q ? drive->i_ab.beta : drive->i_ab.alpha;
    if (square->state == (uint8_t)SQUARE_WAITS) { /* until the earlier current has decayed */
        square->state = (uint8_t)(pm_abs(i) < square->wanted / 8 ? SQUARE_SEEKS : SQUARE_WAITS);
        return;
    }
    if (square->state == (uint8_t)SQUARE_SEEKS) {
        square->top = pm_max(square->top, i);
        square->low = pm_max(square->low, -i);
    } else if (square->cycles >= square->settled && square->state == (uint8_t)SQUARE_MEASURES) {
        take(self, drive->i_ab, drive->i_abc, v_past);
    } else {
        /* waves in their final form */
    }
    if (square->count >= square->half) {
        flip(square);
    }
    if (square->up && square->count == square->half / 2U && square->state < (uint8_t)SQUARE_DONE) {
        judge(drive, square);
    }
    square->count++;
    const pm_q_t v = square->state < (uint8_t)SQUARE_DONE ? square->voltage : 0;
    pm_q_t *axis = square->on_q ? &self->v.beta : &self->v.alpha;
    *axis = square->up ? v : -v;
}

void square_step(drive_t *drive, pm_ab_t v_past)
{
    square_t *square = &drive->procedure.identify.of.square;
    move(drive, v_past);
    square->last = drive->i_ab;
    square->i_last = drive->i_abc;
}
