#include "firmware/drive/block.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"

#if PM_HAS(six_step)

#define SIXTH    PM_TURN(1.0 / 6)
#define WRONG_MS 20U

/* The sample of two periods ago, in per-unit. */
static void take_sample(const drive_t *drive, const drive_in_t *in, zero_sample_t *sample)
{
    const pm_q_t per_code = drive->config.block.per_code;
    const uint16_t *code = in->more.v_sample[0];
    sample->v[0] = pm_mul(pm_shl(code[0], PM_Q_BITS - 16), per_code);
    sample->v[1] = pm_mul(pm_shl(code[1], PM_Q_BITS - 16), per_code);
    sample->v[2] = pm_mul(pm_shl(code[2], PM_Q_BITS - 16), per_code);
    sample->v_dc = pm_shl(in->more.v_dc_sample[0], (uint32_t)drive->config.protection.v_bits);
    sample->v_neutral = 0;
}

#if PM_CARRIES(NEEDS_NEUTRAL)
static bool is_starting(const drive_t *drive)
{
    return drive->block.six_step.commutation.young != 0U || drive->block_ms < 2U * WRONG_MS;
}

/* Whether the third harmonic is there shows beside the open terminal, at the start; the crossings are not the terminal's. */
PM_APART static void look_for_third(drive_t *drive, const drive_in_t *in, pm_q_t v_zero)
{
    block_t *self = &drive->block;
    const six_step_plan_t *plan = &self->six_step.plan[0];
    if (pm_sampled(&in->more, 0) && plan->commutate_at == 0U && !self->six_step.lost && is_starting(drive)) {
        zero_sample_t sample;
        take_sample(drive, in, &sample);
        const third_missing_in_t at = {.sample = &sample,
                                       .v_zero = v_zero,
                                       .sector = (uint8_t)plan->sector,
                                       .leg = sector_legs(plan->sector, self->six_step.reverse).open,
                                       .legs = (zero_legs_t)plan->legs};
        third_missing_step(&self->missing, &drive->config.block.six_step.missing, &at);
    }
}
#endif

/* Of the rotor at t_k, by the last crossing. */
static pm_angle_t angle(const block_t *self)
{
    const commutation_t *c = &self->six_step.commutation;
    const pm_angle_t theta = ((uint32_t)c->crossed + 1U) * SIXTH + (self->now - c->crossing) * self->rate;
    return self->six_step.reverse ? 0U - theta : theta;
}

void block_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    const block_config_t *c = &drive->config.block;
    block_t *self = &drive->block;
    const pm_q_t i[PM_LEGS] = {drive->i_abc.a, drive->i_abc.b, drive->i_abc.c};
    const int32_t counts = c->six_step.pattern.half_period;
    self->now += 2U * (uint32_t)counts;
    self->i = six_step_current(&self->six_step, i);
    line_current_step(&self->current, &c->current, self->i, drive->status.v_dc);

    zero_sample_t sample;
    six_step_in_t seen = {.now = self->now, .u = self->current.u};
    bool sampled = pm_sampled(&in->more, 0);
#if PM_CARRIES(NEEDS_NEUTRAL)
    seen.v_zero = neutral_signal(&drive->neutral, &drive->config.neutral, in->more.v_neutral);
    if (pm_rarely(c->six_step.crossings == CROSSINGS_third_harmonic)) {
        look_for_third(drive, in, seen.v_zero);
        sampled = false;
    }
#endif
    if (sampled && six_step_awaits(&self->six_step)) {
        take_sample(drive, in, &sample);
        if (pm_rarely(c->six_step.crossings == CROSSINGS_virtual_third)) {
            six_step_from_mean(&self->six_step, &sample);
        }
        seen.sample = &sample;
    }
    six_step_out_t next;
    six_step_step(&self->six_step, &c->six_step, &seen, &next);
    pattern_write(&next.on, next.sector, self->six_step.reverse, out->compare);
    if (pm_rarely(self->current.u > c->six_step.pattern.shown)) {
        const uint32_t end = self->six_step.commutation.sector;
        const uint32_t legs = pattern_hidden(&c->six_step.pattern, end, self->six_step.reverse);
        drive->modulator.hidden += MODULATOR_NEXT * (int32_t)legs;
    }
    out->legs = next.legs;
    out->trip = 0;
    out->instants = (pm_instants_t){.sample_at = {next.sample_at},
                                    .commutate_at = next.commutate_at,
                                    .then = next.commutate_at != 0U ? next.then : 0U};
    self->pll.theta = angle(self);
    drive->status.theta = self->pll.theta;
}

/* What the sectors say, at 1 kHz. */
static void look(block_t *self, const block_config_t *c)
{
    const commutation_t *seen = &self->six_step.commutation;
    const pm_q_t omega = commutation_speed(seen, &c->six_step.commutation);
    self->pll.omega = self->six_step.reverse ? -omega : omega;
    self->rate = UINT32_MAX / seen->sum;
}

bool block_may_begin(const drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    return c->on && drive->state == DRIVE_RUNNING && drive->command.mode < DRIVE_MODE_CURRENT &&
           drive->position.weight == PM_ONE && drive->position.quality > PM_Q(0.5) &&
           pm_abs(drive->pll.omega) >= c->omega_on;
}

/* Of what the vector path leaves behind. */
static void enter(drive_t *drive, pm_q_t i_q)
{
    block_t *self = &drive->block;
    const pm_q_t i = pm_mul(i_q, LINE_OF_Q);
    line_current_reset(&self->current, &drive->config.block.current, self->six_step.reverse ? -i : i);
    look(self, &drive->config.block);
    block_prepare(drive, i_q);
    drive->i_open = 0;
    drive->field_weakening.i_d = 0;
    drive->modulator.hidden = 0;
    drive->modulator.limited = 0;
    drive->block_ms = 0;
    drive->stage = STAGE_SIX_STEP;
}

void block_begin(drive_t *drive)
{
    const pm_pll_t pll = drive->pll;
    block_t *self = &drive->block;
    *self = (block_t){.pll = pll, .six_step = {.thresholds = drive->thresholds}};
    six_step_reset(&self->six_step, &drive->config.block.six_step, pll.theta, pll.omega, 0);
    enter(drive, drive->status.i.q);
}

/* The direction in which the command wants it to turn, 0: not at all, or too slowly. */
static int32_t wanted(const drive_t *drive)
{
    const pm_q_t least = drive->command.mode == DRIVE_MODE_TORQUE ? 1 : drive->config.block.omega_off;
    const pm_q_t x = drive->command.mode == DRIVE_MODE_TORQUE ? drive->torque_target : drive->omega_target;
    if (drive->state == DRIVE_STOPPING || pm_abs(x) < least) {
        return 0;
    }
    return x < 0 ? -1 : 1;
}

bool block_from_rest(drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    if (!c->on || !c->from_rest || drive->command.mode >= DRIVE_MODE_CURRENT) {
        return false;
    }
    const int32_t direction = wanted(drive);
    const pm_q_t omega = drive->omega_ramp;
    if (direction == 0 || (omega != 0 && (omega < 0) != (direction < 0))) {
        /* of a rotor that turned when it was taken over */
        drive->omega_ramp = pm_approach(omega, 0, drive->config.open_loop.slope);
        open_loop_hold(drive);
        return true;
    }
    block_t *self = &drive->block;
    const pm_angle_t theta = drive->theta_open;
    *self = (block_t){.six_step = {.thresholds = drive->thresholds}};
    six_step_begin(&self->six_step, &c->six_step, theta, direction < 0, c->t_30, 0);
    self->pll.theta = theta;
    enter(drive, direction < 0 ? -c->i_start : c->i_start);
    return true;
}

/* Whether a rotor that starts by its crossings is to end here. */
static bool is_slow(const drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    const block_t *self = &drive->block;
    if (!c->from_rest) {
        return pm_abs(self->pll.omega) < c->omega_off;
    }
    const bool other = wanted(drive) != (self->six_step.reverse ? -1 : 1);
    return other && drive->command.mode != DRIVE_MODE_TORQUE && pm_abs(self->pll.omega) < c->omega_off;
}

/* Beyond speed_trip. */
static bool is_fast(const block_t *self)
{
    return pm_abs(self->pll.omega) > PM_ONE;
}

/* Speed of the last sector, of that of the last turn. */
static pm_q_t last_sector(const block_t *self)
{
    const commutation_t *seen = &self->six_step.commutation;
    return pm_div((pm_q_t)commutation_t_60(seen), (pm_q_t)seen->interval[seen->crossed]);
}

/* More than half of its largest ripple: it does not change its sign within a period. */
static bool flows(const drive_t *drive)
{
    return pm_abs(drive->block.i) >= pm_mul(drive->config.block.ripple, drive->status.v_dc);
}

static bool is_beside(pm_q_t e, pm_q_t emf, pm_q_t unsure)
{
    return pm_abs(e - emf) > pm_half(emf) + unsure;
}

/* Of crossings that the voltage between the legs belies, of the last turn as of the last sector, as the speed may change within one;
 * those of a turn at once where they would be an over-speed. Not drawn into block_slow(): that costs every period two instructions. */
PM_APART static bool is_wrong(drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    block_t *self = &drive->block;
    const pm_q_t v_dc = drive->status.v_dc;
    const pm_q_t driven = self->i < 0 ? -c->lost : c->lost;
    const bool sure = flows(drive);
    const pm_q_t taken = sure ? driven : 0;
    const pm_q_t unsure = sure ? 0 : pm_mul(c->lost, v_dc);
    const pm_q_t e = pm_mul(self->current.u - taken, v_dc) - pm_mul(c->current.R_2, self->i);
    const pm_q_t emf = block_emf(drive);
    const bool of_turn = self->six_step.complementary && is_beside(e, emf, unsure);
    const bool of_both = of_turn && is_beside(e, pm_mul_sat(emf, last_sector(self)), unsure);
    self->wrong_ms = of_both ? (uint16_t)(self->wrong_ms + 1U) : 0U;
    return self->wrong_ms > WRONG_MS || (of_turn && is_fast(self));
}

/* A rotor that is held shows no EMF: noise may make the crossings of a start, but not for longer than is_wrong() takes. */
static block_result_t lost(const drive_t *drive)
{
    const bool starts = drive->block.six_step.commutation.young != 0U ||
                        (drive->config.block.from_rest && drive->block_ms < 2U * WRONG_MS);
    return starts ? BLOCK_STALLED : BLOCK_LOST;
}

drive_fault_t block_fault(const drive_t *drive, drive_fault_t fault)
{
#if PM_CARRIES(NEEDS_NEUTRAL)
    return drive->block.missing.missing ? DRIVE_FAULT_NO_THIRD_HARMONIC : fault;
#else
    (void)drive;
    return fault;
#endif
}

block_result_t block_slow(drive_t *drive)
{
    const block_config_t *c = &drive->config.block;
    block_t *self = &drive->block;
    const bool young = self->six_step.commutation.young != 0U;
    drive->thresholds = self->six_step.thresholds;
    if (self->six_step.lost) {
        return lost(drive);
    }
    six_step_slow(&self->six_step, &c->six_step);
    six_step_freewheel(&self->six_step, &c->six_step, self->current.u, flows(drive));
    look(self, c);
    if (young && is_fast(self)) { /* from rest: no rotor was there so soon */
        return BLOCK_STALLED;
    }
    if (young) {
        const pm_q_t i_q = self->six_step.reverse ? -c->i_start : c->i_start;
        speed_control_reset(&drive->speed, self->pll.omega, i_q);
        block_prepare(drive, i_q);
        block_report(drive, i_q);
        return BLOCK_RUNS;
    }
    if (is_slow(drive)) {
        return BLOCK_SLOW;
    }
    if (is_wrong(drive)) {
        return lost(drive);
    }
    block_follow(drive);
    if (drive->block_ms < BLOCK_SETTLED_MS) {
        drive->block_ms++;
    } else {
        drive->block_tries = 0;
    }
    self->current.limited = 0;
    return BLOCK_RUNS;
}

#endif
