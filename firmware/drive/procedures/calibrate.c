#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"

void procedure_calibrate_begin(drive_t *drive)
{
    (void)drive;
}

#if PM_HAS(two_sets)
static pm_procedure_t conclude_second(drive_t *drive, int32_t most)
{
    const calibrate_t *self = &drive->procedure.calibrate;
    two_sets_t *second = &drive->two_sets;
    pm_procedure_t result = PM_DONE;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        second->zero[x] = pm_shl(self->second[x], PM_Q_BITS - 15 - CALIBRATE_BITS);
        if (pm_abs(second->zero[x] - PM_ONE) > most) {
            result = PM_FAILED_OFFSET;
        }
    }
    second->neutral.zero = pm_shl(self->neutral_second, PM_Q_BITS - 15 - CALIBRATE_BITS);
    if (second->neutral.zero != 0 && pm_abs(second->neutral.zero - PM_ONE) > PM_ONE / 4) {
        result = PM_FAILED_OFFSET;
    }
    return result;
}
#endif

static pm_procedure_t conclude(drive_t *drive)
{
    const int32_t most = pm_shl((int32_t)drive->config.protection.offset_max, PM_Q_BITS - 15);
    pm_procedure_t result = PM_DONE;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const pm_q_t zero = pm_shl(drive->procedure.calibrate.sum[x], PM_Q_BITS - 15 - CALIBRATE_BITS);
        drive->zero[x] = zero;
        if (pm_abs(zero - PM_ONE) > most) {
            result = PM_FAILED_OFFSET;
        }
    }
#if PM_CARRIES(NEEDS_NEUTRAL)
    drive->neutral.zero = pm_shl(drive->procedure.calibrate.neutral, PM_Q_BITS - 15 - CALIBRATE_BITS);
    if (drive->neutral.zero != 0 &&
        pm_abs(drive->neutral.zero - PM_ONE) > PM_ONE / 4) { /* 0: the board has none */
        result = PM_FAILED_OFFSET;
    }
#endif
#if PM_HAS(two_sets)
    if (drive->config.winding == (uint8_t)WINDING_TWO_SETS && conclude_second(drive, most) != PM_DONE) {
        result = PM_FAILED_OFFSET;
    }
#endif
    return result;
}

static bool moves(const uint16_t *code, const uint16_t *first, int32_t most)
{
    bool moved = false;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        moved = moved || pm_abs((int32_t)code[x] - (int32_t)first[x]) > most;
    }
    return moved;
}

/* A current flows: from the beginning, with this period as the first. */
static void wait_for_rest(calibrate_t *self, const drive_in_t *in, int32_t most)
{
    bool moved = self->count == 0U || moves(in->i_leg, self->first, most);
#if PM_HAS(two_sets)
    moved = moved || moves(in->more.i_second, self->second_first, most);
#endif
    if (moved) {
        *self = (calibrate_t){.timer = self->timer};
        for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
            self->first[x] = in->i_leg[x];
#if PM_HAS(two_sets)
            self->second_first[x] = in->more.i_second[x];
#endif
        }
    }
}

PM_RARE pm_procedure_t procedure_calibrate_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)out;
    calibrate_t *self = &drive->procedure.calibrate;
    wait_for_rest(self, in, drive->config.protection.rest);
    self->timer++;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        self->sum[x] += in->i_leg[x];
    }
#if PM_CARRIES(NEEDS_NEUTRAL)
    self->neutral += in->more.v_neutral;
#endif
#if PM_HAS(two_sets)
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        self->second[x] += in->more.i_second[x];
    }
    self->neutral_second += in->more.v_neutral_second;
#endif
    self->count++;
    if (self->count < CALIBRATE_PERIODS) {
        return self->timer == UINT16_MAX ? PM_FAILED_TIMEOUT : PM_RUNNING;
    }
    drive->rests = true;
    return conclude(drive);
}

pm_procedure_t procedure_calibrate_slow(drive_t *drive)
{
    return drive->procedure.result;
}

void procedure_calibrate_abort(drive_t *drive)
{
    (void)drive;
}
