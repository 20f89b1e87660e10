#include "firmware/drive/procedures/flying_start.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(flying_start)

#define PARTS FLYING_START_PARTS
/* What is commanded in a period acts in the next, whose end the one after sees. */
#define SEEN 2U
/* Samples of zero current before a pulse: what one takes for zero may be the end of a slow decay. */
#define QUIET 2U
/* From then on, after a pulse, what is left may be the ringing of the open legs with the winding, which does not end. */
#define RINGS (SEEN + 4U)
/* The sign of a leg's current is sure at so many times the noise, and that it was one all along at that share of the whole. */
#define SURE  4
#define SHARE 10

/* Periods of a pulse. */
static uint32_t periods_of(uint32_t length)
{
    return length < (uint32_t)PARTS ? 1U : length / (uint32_t)PARTS;
}

/* Length of a pulse in 64ths of a period: one that is shorter has the second half alone. */
static uint32_t seen_of(uint32_t length)
{
    return length < (uint32_t)PARTS ? length : 2U * length;
}

/* n x, at most 4. */
static int32_t times(pm_q_t x, uint32_t n)
{
    return n >= (uint32_t)PM_Q(4.0) / (uint32_t)pm_max(x, 1) ? PM_Q(4.0) : x * (int32_t)n;
}

/* The longest of the next pulses that cannot carry twice i_enough: four times as long, twice, or none. */
static uint32_t longer(const flying_start_t *self, const flying_start_config_t *c, pm_q_t i)
{
    const uint32_t now = seen_of(self->length);
    for (uint32_t factor = 4; factor >= 2U; factor /= 2U) {
        const uint32_t next = factor * self->length;
        if (next <= c->longest && i < 2 * c->i_enough / (int32_t)(seen_of(next) / now)) {
            return next;
        }
    }
    return 0;
}

/* Until the next pulse; all of the time that is left, if no other fits behind it. */
static void after_pulse(flying_start_t *self, const flying_start_config_t *c)
{
    static const uint8_t more[FLYING_START_PULSES + 1] = {0, 0,  1, 3,
                                                          7, 15, 0}; /* pitches, of so many pulses */
    const uint32_t pitch = periods_of(self->length) + SEEN + QUIET - 1U;
    const uint32_t behind = (uint16_t)(self->timer - self->began) + pitch;
    if (self->charged >= c->charge && (self->count >= FLYING_START_PULSES || behind > c->span)) {
        self->ended = true;
        self->wait = SEEN;
        return;
    }
    const uint32_t pause = pitch * more[self->count];
    const uint32_t rest = behind < c->span ? c->span - behind : 0U;
    const bool last = rest < pause + pitch && self->count < FLYING_START_PULSES;
    self->wait = (uint16_t)(SEEN + QUIET - 1U + (last ? rest : pause));
}

/* What devices and noise leave of it has no angle. */
static bool is_large(const flying_start_t *self, const flying_start_config_t *c, pm_q_t i)
{
    const pm_q_t drop = times(c->drop, seen_of(self->length));
    return i >= FLYING_START_LEAST * c->noise && i >= drop + pm_half(drop);
}

static pm_procedure_t keep(flying_start_t *self, const flying_start_config_t *c, pm_abc_t i, uint16_t period)
{
    const pm_ab_t i_ab = pm_clarke(i);
    if (self->count == 0U) {
        const pm_q_t size = pm_hypot(i_ab.alpha, i_ab.beta);
        const uint32_t next = longer(self, c, size);
        if (next != 0U) {
            self->length = (uint16_t)next;
            return PM_RUNNING;
        }
        if (!is_large(self, c, size)) {
            return PM_FAILED_NOT_TURNING;
        }
    }
    const uint32_t last = (uint32_t)FLYING_START_PULSES - 1U;
    const uint32_t n = self->count < last ? self->count : last;
    self->pulse[n] = (flying_start_pulse_t){.i = i_ab, .at = period};
    self->count = (uint8_t)(n + 1U);
    after_pulse(self, c);
    return PM_RUNNING;
}

static bool is_zero(const flying_start_t *self, const flying_start_config_t *c, pm_abc_t i)
{
    const pm_q_t zero = self->begun && self->since >= RINGS ? c->i_rings : c->i_zero;
    return pm_abs(i.a) < zero && pm_abs(i.b) < zero && pm_abs(i.c) < zero;
}

pm_procedure_t flying_start_step(flying_start_t *self, const flying_start_config_t *c, pm_abc_t i,
                                 uint16_t period, uint32_t *low)
{
    *low = 0;
    self->timer++;
    self->since++;
    if (self->left == 0U) {
        if (self->begun && self->since == SEEN) {
            return keep(self, c, i, period);
        }
        if (self->timer == UINT16_MAX) {
            return PM_FAILED_TIMEOUT;
        }
        self->quiet = is_zero(self, c, i) ? (uint16_t)(self->quiet + 1U) : 0U;
        if (self->count == 1U && self->since > (uint32_t)self->wait + c->pause) {
            *self = (flying_start_t){.timer = self->timer, .more = c->pause};
        }
        if (self->since <= self->wait || self->quiet < QUIET + self->more) {
            return PM_RUNNING;
        }
        if (self->ended) {
            return PM_DONE;
        }
        if (!self->begun) {
            self->began = self->timer;
            self->length = c->shortest;
            self->begun = true;
        }
        self->left = (uint16_t)periods_of(self->length);
        self->wait = SEEN;
        self->quiet = 0;
        self->more = 0;
    }
    self->left--;
    self->since = 0;
    *low = self->length < (uint16_t)PARTS ? self->length : (uint32_t)PARTS;
    self->charged += *low;
    return PM_RUNNING;
}

/* What a device takes of a current, of which a leg is given back as much as its sign is sure. */
static void find_drop(const flying_start_config_t *c, pm_ab_t i, uint32_t seen, flying_start_reading_t *r)
{
    r->eighth = times(c->drop, seen) / 8;
    const pm_q_t sure = pm_max(SURE * c->noise, pm_hypot(i.alpha, i.beta) / SHARE);
    r->per_sure = pm_ratio(r->eighth, pm_max(sure, r->eighth));
}

static pm_q_t taken_by(const flying_start_reading_t *known, pm_q_t i)
{
    return 8 * pm_clamp(pm_unit(i, known->per_sure), -known->eighth, known->eighth);
}

/* With what the devices took: along d, L_q / L_d times as much. */
static pm_angle_t angle_of(pm_ab_t i, const flying_start_reading_t *known)
{
    const pm_abc_t legs = pm_clarke_inverse(i);
    const pm_ab_t taken = pm_clarke(
        (pm_abc_t){.a = taken_by(known, legs.a), .b = taken_by(known, legs.b), .c = taken_by(known, legs.c)});
    pm_angle_t angle = pm_atan2(i.beta + taken.beta, i.alpha + taken.alpha);
    for (int round = 0; round < 2 && known->ratio != PM_ONE; round++) {
        const pm_dir_t rotor = pm_dir(angle + known->behind - known->half);
        const pm_dq_t along = pm_park(taken, rotor);
        const pm_ab_t whole =
            pm_park_inverse((pm_dq_t){.d = pm_mul_sat(along.d, known->ratio), .q = along.q}, rotor);
        angle = pm_atan2(i.beta + whole.beta, i.alpha + whole.alpha);
    }
    return angle;
}

/* By which the current lags behind the EMF at the end of the pulse. */
static pm_angle_t delta_of(const flying_start_config_t *c, const pm_machine_t *machine, int32_t turn,
                           uint32_t seen)
{
    const pm_q_t x = times(c->decay, seen) / 8;
    const pm_q_t y = pm_mul_sat(x, pm_div(machine->L_q, machine->L_d));
    const pm_q_t later = PM_ONE / 8 + pm_frac(y, PM_FRAC(0.333333333)) - pm_frac(x, PM_FRAC(0.166666667)) +
                         pm_frac(pm_mul(x, y), PM_FRAC(0.32));
    const pm_q_t centre = pm_div(PM_ONE / 16, later);
    const int32_t part = pm_abs(turn) / (int32_t)(2U * PARTS);
    const int32_t most = (int32_t)PM_TURN(0.45);
    const int32_t whole = part < most / (int32_t)seen ? part * (int32_t)seen : most;
    const pm_dir_t dir = pm_dir((pm_angle_t)pm_mul(whole, centre));
    return pm_atan2(pm_unit(machine->L_q, dir.sin), pm_unit(machine->L_d, dir.cos));
}

/* A turn that the noise of the currents could make. */
static bool is_still(const flying_start_config_t *c, pm_q_t i, int32_t turn, uint32_t periods)
{
    const int32_t most = (int32_t)PM_TURN(0.16);
    const int32_t size = pm_abs(turn);
    const int32_t whole = size < most / (int32_t)periods ? size * (int32_t)periods : most;
    return pm_mulh(i, whole) < c->noise + c->noise / 2;
}

/* Each angle tells how many turns lie before the next. */
static void read_pulses(const flying_start_t *self, flying_start_reading_t *r)
{
    const pm_angle_t first = angle_of(self->pulse[0].i, r);
    int32_t turn = 0;
    for (uint32_t n = 1; n < self->count; n++) {
        r->periods = (uint16_t)(self->pulse[n].at - self->pulse[0].at);
        r->angle = angle_of(self->pulse[n].i, r);
        turn += pm_angle_diff(r->angle - first, (uint32_t)turn * r->periods) / (int32_t)r->periods;
    }
    r->turn = turn;
}

/* The first and the last alone, between which the turns are known. */
static void read_ends(const flying_start_t *self, flying_start_reading_t *r)
{
    const pm_angle_t first = angle_of(self->pulse[0].i, r);
    r->angle = angle_of(self->pulse[self->count - 1U].i, r);
    r->turn += pm_angle_diff(r->angle - first, (uint32_t)r->turn * r->periods) / (int32_t)r->periods;
}

/* By what is known of the pulses how d lies. */
static void find_behind(const flying_start_config_t *c, const pm_machine_t *machine, uint32_t seen,
                        flying_start_reading_t *p)
{
    const pm_angle_t behind = PM_TURN(0.25) + delta_of(c, machine, p->turn, seen);
    p->behind = p->turn > 0 ? behind : (pm_angle_t)(0U - behind);
    p->half = (pm_angle_t)(p->turn / (int32_t)(4U * PARTS) * (int32_t)seen);
}

pm_procedure_t flying_start_find(flying_start_t *self, const flying_start_config_t *c,
                                 const pm_machine_t *machine, int32_t k_theta)
{
    if (self->count < 2U) {
        return PM_FAILED_NOT_TURNING;
    }
    const uint32_t seen = seen_of(self->length);
    flying_start_reading_t *r = &self->reading;
    r->calls++;
    if (r->calls == 1U) {
        r->ratio = PM_ONE;
        find_drop(c, self->pulse[0].i, seen, r);
        read_pulses(self, r);
        const pm_ab_t i = self->pulse[self->count - 1U].i;
        if (is_still(c, pm_hypot(i.alpha, i.beta), r->turn, r->periods)) {
            return PM_FAILED_NOT_TURNING;
        }
        find_behind(c, machine, seen, r);
        r->ratio = pm_div(machine->L_q, machine->L_d);
        r->calls = pm_abs(r->ratio - PM_ONE) < PM_ONE / 8 ? 2U : 1U;
    } else if (r->calls == 2U) {
        read_ends(self, r);
        find_behind(c, machine, seen, r);
    } else {
        return PM_DONE;
    }
    self->theta = r->angle + r->behind;
    self->omega = pm_div(r->turn, pm_omega_to_angle(PM_ONE, k_theta));
    return PM_RUNNING;
}

void procedure_flying_start_begin(drive_t *drive)
{
    drive->procedure.flying_start.more = drive->rests ? 0U : drive->config.flying_start.pause;
}

/* Less than a period: in its second half alone, at whose end the currents are sampled. Else the diodes would conduct between
 * the two, and what they leave lies along an axis of theirs. */
static void write_low(drive_t *drive, uint32_t low, drive_out_t *out)
{
    const uint32_t counts = (uint32_t)drive->config.modulator.counts;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        pm_write_leg(out->compare[x], (int32_t)(counts - counts * low / (uint32_t)PARTS));
    }
    out->legs = PM_LEGS_PWM;
#if PM_CARRIES(NEEDS_ONE_SWITCH) && PM_CARRIES(NEEDS_HALVES)
    if (low < (uint32_t)PARTS) {
        out->legs = PM_LEGS_ALL(PM_LEG_LOWER);
        for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
            out->compare[x][0] = (uint16_t)counts;
        }
    }
#endif
}

PM_RARE pm_procedure_t procedure_flying_start_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    uint32_t low;
    const pm_procedure_t result =
        flying_start_step(&drive->procedure.flying_start, &drive->config.flying_start, drive->i_abc,
                          (uint16_t)drive->period, &low);
    if (low != 0U) {
        write_low(drive, low, out);
    } else {
        out->legs = PM_LEGS_OFF;
        drive->completed = drive->period + 1U; /* low-side shunts do not see the upper diodes */
    }
    return result;
}

pm_procedure_t procedure_flying_start_slow(drive_t *drive)
{
    if (drive->procedure.result != PM_DONE) {
        return drive->procedure.result;
    }
    flying_start_t *self = &drive->procedure.flying_start;
    const drive_config_t *c = &drive->config;
    const pm_procedure_t result = flying_start_find(self, &c->flying_start, &c->machine, c->k_theta);
    const uint32_t since = (uint16_t)((uint16_t)drive->period - self->pulse[self->count - 1U].at);
    const int32_t turn = pm_omega_to_angle(self->omega, c->k_theta);
    drive->sequence.theta = self->theta + (uint32_t)turn * since;
    drive->sequence.omega = self->omega;
    return result;
}

void procedure_flying_start_abort(drive_t *drive)
{
    (void)drive;
}

#endif
