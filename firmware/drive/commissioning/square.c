/* The square wave that measures an inductance, period by period: inductance.c. */
#include "firmware/drive/commissioning/commissioning_parts.h"

#define SETTLE_CYCLES 3U
#define CYCLES        24U
#define BIASED_CYCLES 2U
/* Of products, so that the sum of thousands fits. */
#define FINE 65536

static int32_t sign_of(pm_q_t i)
{
    return i < 0 ? -1 : 1;
}

/* Sum of the signs of a leg's current at its two edges. The current moves while legs differ: the leg that is
 * up longest switches before and after that, the one that is up shortest in the middle of it. */
static int32_t signs(pm_q_t from, pm_q_t to, pm_q_t u, pm_q_t edge)
{
    if (u > edge) {
        return sign_of(from) + sign_of(to);
    }
    if (u < -edge) {
        return 2 * sign_of(from + to);
    }
    return sign_of(3 * from + to) + sign_of(from + 3 * to);
}

static pm_ab_t lost(const drive_t *drive, const commissioning_t *self, pm_ab_t v)
{
    const pm_q_t half = self->lost / 2;
    const pm_q_t edge = self->of.square.voltage / 4;
    const pm_abc_t u = pm_clarke_inverse(v);
    const pm_abc_t x = {
        .a = signs(self->i_last.a, drive->i_abc.a, u.a, edge) * half,
        .b = signs(self->i_last.b, drive->i_abc.b, u.b, edge) * half,
        .c = signs(self->i_last.c, drive->i_abc.c, u.c, edge) * half,
    };
    return pm_clarke(x);
}

static void take(drive_t *drive, pm_ab_t v)
{
    commissioning_t *self = &drive->identify.work;
    const pm_ab_t last = pm_clarke(self->i_last);
    const pm_ab_t di = {.alpha = drive->i_ab.alpha - last.alpha, .beta = drive->i_ab.beta - last.beta};
    const pm_ab_t mean = {.alpha = last.alpha + di.alpha / 2, .beta = last.beta + di.beta / 2};
    self->taken++;
    const pm_ab_t gone = lost(drive, self, v);
    const pm_ab_t w = {.alpha = v.alpha - pm_mul(self->R, mean.alpha) - gone.alpha,
                       .beta = v.beta - pm_mul(self->R, mean.beta) - gone.beta};
    if (self->of.square.on_q) {
        self->sum[SUM_FLUX] += v.beta < 0 ? -w.beta : w.beta;
        self->sum[SUM_CURRENT] += v.beta < 0 ? -di.beta : di.beta;
        const pm_q_t far = pm_mul(self->of.square.wanted, PM_Q(0.8)); /* near the current that it is for */
        const pm_q_t x = pm_abs(mean.beta) > far ? pm_mul(mean.beta, di.beta) : 0;
        self->sum[SUM_D_FLUX] += (int64_t)w.alpha * x / FINE;
        self->sum[SUM_D_CURRENT] += (int64_t)di.alpha * x / FINE;
        self->sum[SUM_SQUARE] += (int64_t)x * x / FINE;
    } else {
        self->sum[SUM_FLUX] += v.alpha < 0 ? -w.alpha : w.alpha;
        self->sum[SUM_CURRENT] += v.alpha < 0 ? -di.alpha : di.alpha;
    }
}

/* With negative i_d the rotor stands on its edge: it must not be long. */
static uint32_t settling(const square_t *square)
{
    return square->bias != 0 ? 1U : SETTLE_CYCLES;
}

/* A whole wave has ended, in the middle of its rise: the current is zero, and a change of the voltage here
 * leaves no mean behind, which would turn the rotor. */
static void judge(drive_t *drive, square_t *square)
{
    const uint32_t cycles = square->bias != 0 ? BIASED_CYCLES : CYCLES;
    if (square->leading) {
        square->leading = false; /* not a whole one */
    } else if (square->state == (uint8_t)SQUARE_MEASURES) {
        square->cycles++;
        if (square->cycles >= settling(square) + cycles) {
            square->state = (uint8_t)SQUARE_DONE;
        }
    } else if (pm_min(square->top, square->low) >= square->wanted) {
        square->state = (uint8_t)SQUARE_MEASURES;
        commissioning_clear_sums(&drive->identify.work);
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

/* The first waves are such that the rotor has no speed when the current is at its peaks: then its mean speed
 * is zero, too. */
static void flip(square_t *square)
{
    square->count = square->leading ? (uint16_t)((uint32_t)square->half * 146U / 1000U) : 0U;
    square->up = !square->up;
}

void square_step(drive_t *drive, pm_ab_t v_past)
{
    commissioning_t *self = &drive->identify.work;
    square_t *square = &self->of.square;
    const pm_q_t i = square->on_q ? drive->i_ab.beta : drive->i_ab.alpha;
    if (square->state == (uint8_t)SQUARE_WAITS) { /* what flowed before goes first */
        square->state = (uint8_t)(pm_abs(i) < square->wanted / 8 ? SQUARE_SEEKS : SQUARE_WAITS);
        return;
    }
    square->top = pm_max(square->top, i);
    square->low = pm_max(square->low, -i);
    if (square->state == (uint8_t)SQUARE_MEASURES && square->cycles >= settling(square)) {
        take(drive, v_past);
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
