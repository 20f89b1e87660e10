/* Procedures that own the bridge for a time: calibration, position finding, alignment, identification.
 *
 * All of procedures.def have one shape:
 *   procedure_x_begin(drive)          the bridge is its own; its state is zero, but for that of CONTROL
 *   procedure_x_step(drive, in, out)  one period: what the legs do next, each of them; not with CONTROL, which
 *                                     has none, and with BARE they are off and stay off. Currents and DC link
 *                                     have been checked unless BARE
 *   procedure_x_slow(drive)           1 kHz
 *   procedure_x_abort(drive)          it will not come to its end: enable taken back, coast, a fault. The
 * legs are off already step and slow say whether it runs, is done or has failed, and why
 * (firmware/math/procedure.h). A procedure that finds an angle leaves it in drive->sequence.theta, with its
 * margin in sequence.margin. After the end none of them is called, and the legs are off until the sequence
 * goes on (sequence.h).
 *
 * The traits say who drives the legs:
 *   BARE      nobody: the current sensors' offsets are not known yet. State CALIBRATING
 *   LEGS      its step, duty by duty, off in between. State FINDING
 *   CONTROL   current control, at an angle that its slow part imposes, or on top of the estimated one, whose
 *             millisecond comes before it; begin chooses the stage. State FINDING
 *   ALONE     its step, and it is not part of a start. State RUNNING
 * The state of CONTROL lies beside the position sources, which run meanwhile; that of the others in their
 * place. Only procedures in the image cost anything (firmware/math/image.h).
 * Tests: tests/contract/procedure_contract_test.cpp runs all of the list. */
#ifndef DRIVE_PROCEDURES_PROCEDURE_H
#define DRIVE_PROCEDURES_PROCEDURE_H

#include "firmware/drive/commissioning/commissioning.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/procedures/align.h"
#include "firmware/drive/procedures/calibrate.h"
#include "firmware/drive/procedures/charge.h"
#include "firmware/drive/procedures/d_current.h"
#include "firmware/drive/procedures/flying_start.h"
#include "firmware/drive/procedures/lock.h"
#include "firmware/drive/procedures/saliency_map.h"
#include "firmware/drive/procedures/secondary_current.h"
#include "firmware/drive/procedures/secondary_voltage.h"
#include "firmware/drive/procedures/torque_polarity.h"
#include "firmware/drive/procedures/zero_inductance.h"
#include "firmware/math/pll.h"
#include "firmware/math/procedure.h"
#include "injection/basic_pulses.h"
#include "injection/boundary_detection.h"
#include "injection/dc_link_pulses.h"
#include "injection/dual_pulses.h"
#include "injection/four_pulses.h"
#include "injection/initial_pulses.h"
#include "injection/three_phase_hf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    PROCEDURE_NONE,
#define PM_METHOD(name, help, traits, needs) PROCEDURE_##name,
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    PROCEDURE_COUNT,
} procedure_id_t;

/* Where the state of a row belongs. */
#define PROCEDURE_IN_PLACE_BARE(name)  name##_t name;
#define PROCEDURE_IN_PLACE_LEGS(name)  name##_t name;
#define PROCEDURE_IN_PLACE_ALONE(name) PM_IN_IMAGE(name, name##_t name;)
#define PROCEDURE_IN_PLACE_CONTROL(name)
#define PROCEDURE_BESIDE_BARE(name)
#define PROCEDURE_BESIDE_LEGS(name)
#define PROCEDURE_BESIDE_ALONE(name)
#define PROCEDURE_BESIDE_CONTROL(name) PM_IN_IMAGE(name, name##_t name;)

/* In the place of the position sources, in STAGE_PROCEDURE; which one: drive->sequence.procedure. */
typedef struct {
    pm_pll_t pll;          /* zero; begins position_t, too */
    pm_procedure_t result; /* of the last step */
    union {
#define PM_METHOD(name, help, traits, needs) PROCEDURE_IN_PLACE_##traits(name)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    };
} procedure_t;

/* Beside them; likewise. */
typedef union {
#define PM_METHOD(name, help, traits, needs) PROCEDURE_BESIDE_##traits(name)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
} procedure_beside_t;

#define PM_METHOD(name, help, traits, needs)                                                                 \
    void procedure_##name##_begin(drive_t *drive);                                                           \
    pm_procedure_t procedure_##name##_step(drive_t *drive, const drive_in_t *in, drive_out_t *out);          \
    pm_procedure_t procedure_##name##_slow(drive_t *drive);                                                  \
    void procedure_##name##_abort(drive_t *drive);
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD

/* Current control holds zero, so that the carrier alone makes the signs of the currents. A compensation of dead time by the
 * mean current would make that swing: it takes more than the dead time then does. */
bool procedure_without_current(const drive_t *drive);

/* The angle is not known yet: what current control does by L_q may meet L_d, and with gains for L_q would swing from a ratio
 * of three on. Slower by L_d / L_q it does not. */
bool procedure_without_angle(const drive_t *drive);

/* The one of drive->sequence.procedure; nothing with PROCEDURE_NONE. */
void procedure_begin(drive_t *drive, procedure_id_t id); /* the drive's state and stage, too */
void procedure_expect(
    drive_t *drive); /* a command while off: an identification's report is its own from here on */
pm_procedure_t procedure_slow(drive_t *drive);
void procedure_abort(drive_t *drive); /* from then on there is none */

/* What the bus reads of an identification. Its progress is 0 at the beginning, 100 when it is done, and stays where it has failed. */
void procedure_report(drive_t *drive, commissioning_state_t state, commissioning_reason_t reason);

#ifdef __cplusplus
}
#endif

#endif
