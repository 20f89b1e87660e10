#include "firmware/drive/procedures/sequence.h"

#include "firmware/drive/procedures/procedure.h"
#include "firmware/math/measure.h"

#define FAULT_ALWAYS SEQUENCE_FAULT, SEQUENCE_FAULT, SEQUENCE_FAULT
#define CALIBRATE                                                                                            \
    {                                                                                                        \
        PROCEDURE_calibrate, 1, FAULT_ALWAYS                                                                 \
    }
#define LOOK                                                                                                 \
    {                                                                                                        \
        PROCEDURE_flying_start, SEQUENCE_CAUGHT, 2, SEQUENCE_FAULT, SEQUENCE_FAULT                           \
    }
#define CHARGE                                                                                               \
    {                                                                                                        \
        PROCEDURE_charge, 3, FAULT_ALWAYS                                                                    \
    }
#define FIND_AXIS(round)                                                                                     \
    {                                                                                                        \
        SEQUENCE_FIND, 4, 4, round, SEQUENCE_FAULT                                                           \
    }

/* The axis is known and its pole is not; a rotor that turns by itself is aligned. `align` is the step of that. */
#define NO_POLE(align) (PM_HAS(torque_polarity) ? (align) + 1 : (align))
#define TURN_FORTH_AND_BACK(align)                                                                           \
    {                                                                                                        \
        PROCEDURE_torque_polarity, SEQUENCE_RUN, SEQUENCE_FAULT, SEQUENCE_FAULT, align                       \
    }

static const sequence_step_t steps[SEQUENCE_KINDS][SEQUENCE_STEPS] = {
    [SEQUENCE_align] = {CALIBRATE, LOOK, CHARGE, {PROCEDURE_align, SEQUENCE_RUN, FAULT_ALWAYS}},
    [SEQUENCE_pulses] = {CALIBRATE, LOOK, CHARGE, {SEQUENCE_FIND, SEQUENCE_RUN, FAULT_ALWAYS}},
    [SEQUENCE_pulses_align] = {CALIBRATE,
                               LOOK,
                               CHARGE,
                               {SEQUENCE_FIND, SEQUENCE_RUN, NO_POLE(4), 4, SEQUENCE_FAULT},
                               {PROCEDURE_align, SEQUENCE_RUN, FAULT_ALWAYS},
#if PM_HAS(torque_polarity)
                               TURN_FORTH_AND_BACK(4)
#endif
    },
    [SEQUENCE_identify] = {{PROCEDURE_calibrate, 2, FAULT_ALWAYS},
                           {PROCEDURE_NONE, 2, FAULT_ALWAYS},
                           CHARGE,
                           {PROCEDURE_identify, SEQUENCE_WAIT, SEQUENCE_WAIT, SEQUENCE_WAIT, SEQUENCE_WAIT}},
#if SEQUENCE_HAS_POLARITY
    [SEQUENCE_pole] =
        {CALIBRATE, LOOK, CHARGE, FIND_AXIS(SEQUENCE_FAULT), {SEQUENCE_POLE, SEQUENCE_RUN, FAULT_ALWAYS}},
    [SEQUENCE_pole_align] = {CALIBRATE,
                             LOOK,
                             CHARGE,
                             FIND_AXIS(5),
                             {SEQUENCE_POLE, SEQUENCE_RUN, NO_POLE(5), SEQUENCE_FAULT, SEQUENCE_FAULT},
                             {PROCEDURE_align, SEQUENCE_RUN, FAULT_ALWAYS},
                             TURN_FORTH_AND_BACK(5)},
#endif
};

const sequence_step_t *sequence_step(sequence_id_t id, uint32_t step)
{
    return &steps[id][step];
}

uint8_t sequence_procedure(const sequence_step_t *step, uint8_t find, uint8_t pole)
{
#if SEQUENCE_HAS_POLARITY
    if (step->procedure == SEQUENCE_POLE) {
        return pole;
    }
#else
    (void)pole;
#endif
    return step->procedure == SEQUENCE_FIND ? find : step->procedure;
}

static uint32_t procedure_needs(uint8_t procedure)
{
    static const uint16_t needed[PROCEDURE_COUNT] = {
        0,
#define PM_METHOD(name, help, traits, needs) needs,
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    };
    return needed[procedure];
}

uint32_t sequence_needs(sequence_id_t id, uint8_t find, uint8_t pole)
{
    uint32_t needs = 0;
    for (uint32_t step = 0; step < SEQUENCE_STEPS; step++) {
        needs |= procedure_needs(sequence_procedure(&steps[id][step], find, pole));
    }
    return needs;
}

uint32_t sequence_next(const sequence_step_t *step, pm_procedure_t result)
{
    switch (result) {
    case PM_DONE:
        return step->done;
    case PM_FAILED_POLARITY:
    case PM_FAILED_NOT_TURNING:
        return step->not_there;
    case PM_FAILED_SALIENCY:
        return step->no_axis;
    default:
        return step->other;
    }
}
