#include "firmware/drive/procedures/injected.h"
#include "firmware/math/compiler.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#if PM_HAS(lock)

#define LOOK_MS  24U
#define READ_MS  16U /* of a look: from then on it is read */
#define CLOSE_MS 40U
#define APART    PM_TURN(0.125)
/* A = 1/2 with the machine's data. */
#define LEAST PM_Q(0.2)

void procedure_lock_begin(drive_t *drive)
{
    drive->beside.lock = (lock_t){.misfit = -PM_ONE};
    start_injection(drive, 0);
}

/* The loop is open: the frame stays where it is. */
static void look(drive_t *drive, polarity_mean_t *mean, bool read)
{
    drive->position.gains.kp_turn = 0;
    drive->position.gains.ki = 0;
    if (read) {
        polarity_add(mean,
                     injection_last(&drive->position.injection, &drive->config.position.injection).eps / 16);
    }
}

static pm_procedure_t close_loop(drive_t *drive)
{
    const lock_t *self = &drive->beside.lock;
    const pm_q_t eps_0 = polarity_mean(&self->look[0]), eps_1 = polarity_mean(&self->look[1]);
    const pm_q_t noise = pm_hypot(polarity_noise(&self->look[0]), polarity_noise(&self->look[1]));
    const pm_q_t answer = pm_hypot(eps_0, eps_1);
    const pm_sigma_t margin = pulses_margin(answer, pm_max(noise, 1));
    if (self->misfit < -PM_Q(0.75)) {
        return PM_FAILED_NO_CURRENT;
    }
    if (answer < LEAST / 16 || margin < PULSES_SURE) {
        return PM_FAILED_SALIENCY;
    }
    drive->sequence.margin = margin;
    drive->position.pll.theta = pm_atan2(eps_0, -eps_1) / 2U;
    return PM_RUNNING;
}

PM_APART pm_procedure_t procedure_lock_slow(drive_t *drive)
{
    lock_t *self = &drive->beside.lock;
    self->ms++;
    if (lock_looks(self)) {
        look(drive, &self->look[self->looks], self->ms > READ_MS);
        if (self->ms < LOOK_MS) {
            return PM_RUNNING;
        }
        const obs_out_t last = injection_last(&drive->position.injection, &drive->config.position.injection);
        self->misfit = pm_max(self->misfit, last.misfit);
        self->ms = 0;
        self->looks++;
        if (!lock_looks(self)) {
            return close_loop(drive);
        }
        drive->position.pll.theta = APART;
        return PM_RUNNING;
    }
    if (pm_abs(drive->position.pll.omega) > PM_ONE / 2) {
        return PM_FAILED_SALIENCY;
    }
    drive->sequence.theta = drive->position.pll.theta;
    return self->ms < CLOSE_MS ? PM_RUNNING : PM_DONE;
}

void procedure_lock_abort(drive_t *drive)
{
    (void)drive;
}

#endif
