#include "firmware/drive/procedures/injected.h"
#include "firmware/math/compiler.h"

#if PM_HAS(torque_polarity)

#define LOCK_MS  20U /* transients */
#define STILL_MS 40U /* without a current, so long a rotor that rests stays where it is */
#define WAIT     25U /* times that */
#define PULSE_MS 24U
#define FALL_MS  8U
#define REST_MS  8U
#define ALL_MS   (PULSE_MS + FALL_MS + REST_MS)
#define SEEN     ((int32_t)PM_TURN(1.0 / 16))
#define FAR      ((int32_t)PM_TURN(3.0 / 8)) /* no pulse turns it so far */
#define MOST     8U                          /* pulses of the largest current */

enum { PART_LOCK, PART_FORTH, PART_BACK, PART_TOLD };

void procedure_torque_polarity_begin(drive_t *drive)
{
    drive->beside.torque_polarity = (torque_polarity_t){.part = PART_LOCK};
    start_injection(drive, drive->sequence.theta);
}

/* A direction begins from where the rotor is. */
static void turn_from_here(drive_t *drive, uint8_t part)
{
    torque_polarity_t *self = &drive->beside.torque_polarity;
    self->theta = drive->position.pll.theta;
    self->i = drive->config.torque_polarity.step;
    self->pulses = 0;
    self->part = part;
}

/* The frame has been turned to the pole that the EMF shows, or had it. */
static bool emf_has_told(const slip_t *slip)
{
    return slip->count != 0U || slip->agrees_ms >= SLIP_MS;
}

static void give_current(drive_t *drive, bool pulse)
{
    const torque_polarity_t *self = &drive->beside.torque_polarity;
    const pm_q_t along = self->part == (uint8_t)PART_FORTH ? self->i : -self->i;
    const pm_q_t step = (self->i / (int32_t)FALL_MS) + 1;
    drive->i_ref.q += pm_clamp((pulse ? along : 0) - drive->i_ref.q, -step, step);
}

static int32_t turned_by(const drive_t *drive)
{
    return pm_angle_diff(drive->position.pll.theta, drive->beside.torque_polarity.theta);
}

/* Injection has found its way, and the rotor rests: PM_DONE. It is left alone meanwhile. */
static pm_procedure_t wait_for_rest(drive_t *drive)
{
    torque_polarity_t *self = &drive->beside.torque_polarity;
    if (self->ms == LOCK_MS) {
        self->theta = drive->position.pll.theta;
    }
    if (self->ms < LOCK_MS + STILL_MS) {
        return PM_RUNNING;
    }
    if (pm_abs(turned_by(drive)) < SEEN / 4) {
        return PM_DONE;
    }
    self->theta = drive->position.pll.theta;
    self->ms = LOCK_MS;
    self->pulses = (uint8_t)(self->pulses + 1U);
    return self->pulses < WAIT ? PM_RUNNING : PM_FAILED_TURNED;
}

/* The other way than before, it counts from the farthest that it has come. With current, cross-saturation shows some of it that is
 * not there. */
static bool has_turned(drive_t *drive, bool rests)
{
    torque_polarity_t *self = &drive->beside.torque_polarity;
    const int32_t turned = turned_by(drive);
    const int32_t seen = rests ? SEEN : SEEN / 2 * 3;
    if (self->part == (uint8_t)PART_FORTH) {
        return pm_abs(turned) >= seen;
    }
    if (rests && (turned > 0) == self->forwards) {
        self->theta = drive->position.pll.theta;
    }
    return (self->forwards ? -turned : turned) >= seen;
}

static pm_procedure_t look(drive_t *drive, bool turned)
{
    torque_polarity_t *self = &drive->beside.torque_polarity;
    const torque_polarity_config_t *c = &drive->config.torque_polarity;
    self->ms = 0;
    if (!turned) {
        self->pulses = (uint8_t)(self->pulses + (self->i == drive->config.i_injection ? 1U : 0U));
        self->i = pm_min(self->i + c->step, drive->config.i_injection);
        return self->pulses < MOST ? PM_RUNNING : PM_FAILED_NOT_TURNING;
    }
    if (self->part == (uint8_t)PART_FORTH) {
        self->forwards = turned_by(drive) > 0;
        turn_from_here(drive, PART_BACK);
        return PM_RUNNING;
    }
    leave_polarity(drive, drive->sequence.margin, self->part == (uint8_t)PART_TOLD || self->forwards);
    return PM_DONE;
}

PM_APART pm_procedure_t procedure_torque_polarity_slow(drive_t *drive)
{
    torque_polarity_t *self = &drive->beside.torque_polarity;
    self->ms++;
    if (emf_has_told(&drive->position.slip) && self->part != (uint8_t)PART_TOLD) {
        self->part = PART_TOLD;
        self->ms = PULSE_MS;
    }
    if (self->part == (uint8_t)PART_LOCK) {
        const pm_procedure_t rests = wait_for_rest(drive);
        if (rests == PM_DONE) {
            self->ms = 0;
            turn_from_here(drive, PART_FORTH);
            return PM_RUNNING;
        }
        return rests;
    }
    if (pm_abs(drive->position.pll.omega) > PM_ONE / 2) {
        return PM_FAILED_SALIENCY;
    }
    if (self->part != (uint8_t)PART_TOLD && pm_abs(turned_by(drive)) > FAR) {
        return PM_FAILED_TURNED;
    }
    const bool turned = self->part == (uint8_t)PART_TOLD || has_turned(drive, self->ms > PULSE_MS + FALL_MS);
    if (turned && self->ms < PULSE_MS) {
        self->ms = PULSE_MS;
    }
    const bool held = self->ms == PULSE_MS && pm_abs(turned_by(drive)) < SEEN / 4;
    give_current(drive, self->ms < PULSE_MS || held);
    return self->ms < ALL_MS && !held ? PM_RUNNING : look(drive, turned);
}

void procedure_torque_polarity_abort(drive_t *drive)
{
    (void)drive;
}

#endif
