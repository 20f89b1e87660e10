#include "firmware/drive/drive.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/drive/second_bridge.h"
#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

PM_RARE drive_result_t drive_init(drive_t *drive, const drive_params_t *params, uint32_t channels)
{
    *drive = (drive_t){.state = DRIVE_OFF, .stage = STAGE_OFF};
    const drive_result_t result = drive_configure(&drive->config, params, channels);
    if (!result.ok) {
        drive_trip(drive, DRIVE_FAULT_PARAMETERS);
    }
    return result;
}

static bool same(pm_num_t a, pm_num_t b)
{
    return a.m == b.m && a.e == b.e;
}

bool drive_same_frame(const drive_config_t *a, const drive_config_t *b)
{
    const drive_base_t *x = &a->base;
    const drive_base_t *y = &b->base;
    return same(x->v, y->v) && same(x->i, y->i) && same(x->omega, y->omega) && same(x->t_s, y->t_s) &&
           same(a->pole_pairs, b->pole_pairs) && a->modulator.counts == b->modulator.counts &&
           a->injection == b->injection && a->regulator.id == b->regulator.id &&
           a->position.injection.id == b->position.injection.id && a->start == b->start;
}

PM_RARE void drive_reconfigure(drive_t *drive, const drive_config_t *config)
{
    const observer_id_t before = drive->config.position.observer.id;
#if PM_HAS(second_harmonic)
    const second_harmonic_id_t removed = drive->config.position.second_harmonic.id;
#endif
    drive->config = *config;
    const position_config_t *position = &drive->config.position;
    if (position->observer.id != before && drive->stage >= STAGE_OPEN_LOOP) {
        position_change_observer(&drive->position, position, drive->i_ab, drive->status.i);
    }
#if PM_HAS(second_harmonic)
    if (position->second_harmonic.id != removed && drive->stage >= STAGE_OPEN_LOOP) {
        const pm_pll_t *pll = &drive->position.pll;
        const pm_angle_t turn = (pm_angle_t)pm_omega_to_angle(pll->omega, drive->config.k_theta);
        second_harmonic_change(&drive->position.second_harmonic, removed, position->second_harmonic.id,
                               pll->theta + turn);
    }
#endif
    if (drive->fault == DRIVE_FAULT_PARAMETERS) {
        drive->command.enable = false;
        drive->fault = DRIVE_FAULT_NONE;
        drive->state = DRIVE_OFF;
        drive->stage = STAGE_OFF;
    }
}

PM_RARE void drive_command(drive_t *drive, const drive_command_t *command)
{
    const drive_mode_t mode = drive->state == DRIVE_OFF ? command->mode : drive->command.mode;
    drive->command = *command;
    drive->command.mode = mode;
    if (drive->state == DRIVE_OFF) {
        procedure_expect(drive);
    }
    if (!command->enable && drive->stage == STAGE_PROCEDURE) {
        drive->stage = STAGE_OFF; /* nothing to slow down: the period that comes is without voltage */
    }
}

bool drive_clear_fault(drive_t *drive)
{
    if (drive->fault == DRIVE_FAULT_NONE) {
        return true;
    }
    if (drive->fault == DRIVE_FAULT_PARAMETERS || drive->stage == STAGE_SHORT || drive->command.enable ||
        protection_cause_present(drive)) {
        return false;
    }
    drive->fault = DRIVE_FAULT_NONE;
    drive->state = DRIVE_OFF;
    drive->stage = STAGE_OFF;
    return true;
}

const drive_status_t *drive_status(const drive_t *drive)
{
    return &drive->status;
}

const drive_fault_record_t *drive_fault_record(const drive_t *drive)
{
    return &drive->record;
}

/* Current control by L_q may meet L_d where the angle is not that of the rotor, and swings from a ratio of three on. */
static void prepare_current_control(drive_t *drive)
{
    const pm_machine_t *machine = &drive->config.machine;
    drive->regulator_config = drive->config.regulator;
    if (drive->carrier) {
        const pm_unit_t share = position_current_share(&drive->position, &drive->config.position);
        if (share < PM_UNIT_MAX) {
            regulator_slow_down(&drive->regulator_config, share);
        }
#if PM_HAS(lock)
        if (procedure_without_angle(drive)) {
            regulator_slow_down(&drive->regulator_config, pm_ratio(machine->L_d, machine->L_q));
        }
#endif
    }
    if (drive->stage == STAGE_OPEN_LOOP && machine->L_d < machine->L_q / 3) {
        regulator_slow_down(&drive->regulator_config, pm_ratio(3 * machine->L_d, machine->L_q));
    }
}

PM_RARE void drive_prepare(drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    const bool open = drive->stage == STAGE_OPEN_LOOP;
    const pm_q_t v_dc = drive->status.v_dc;
    const bool imposed = open || drive->stage == STAGE_PROCEDURE;
    const pm_q_t omega = imposed ? drive->omega_open : drive->pll.omega;
    const int32_t turn = pm_omega_to_angle(omega, c->k_theta);
    /* On an imposed angle an observer drifts at low speed, and on the way up it slips. */
    const pm_q_t lead_to = open_loop_ramps(drive) ? c->position.omega_high : c->position.omega_low;
    const bool forced = open && pm_abs(drive->omega_ramp) < lead_to;
    if (open && drive->forced && !forced) {
        open_loop_release(drive);
    }
    drive->forced = forced;
    if (drive->forced) {
        const pm_pll_t along = {.theta = drive->theta_open, .omega = omega};
        position_force(&drive->position, &c->position, &along);
    }
#if PM_CARRIES(NEEDS_BRIDGES)
    second_bridge_slow(drive, omega);
#endif
    drive->turn_open = turn;
    drive->usual = drive->stage == STAGE_VECTOR && drive->config.regulator.id == REGULATOR_INLINE;
    drive->ahead = pm_dir((pm_angle_t)turn + (pm_angle_t)pm_half(turn));
    drive->carrier = drive->stage == STAGE_VECTOR && drive->position.inject;
    drive->v_share = c->v_share;
    if (drive->carrier) {
        /* The more an observer leads, the less of the carrier's voltage is kept from control: where a link that has sagged does not
         * have both, the carrier gives way, or the rotor would never be faster; and control has half of it in any case. */
        const pm_q_t reserve = pm_mul(c->position.injection.reserve, PM_ONE - drive->position.weight);
        const pm_unit_t reserved = pm_ratio(pm_min(reserve, v_dc), v_dc);
        drive->v_share = pm_max(c->v_share - reserved, c->v_share / 2);
    }
    prepare_current_control(drive);
    drive->modulator.carrier = drive->carrier;
    modulator_slow(&drive->modulator, &c->modulator, pm_max(v_dc, DRIVE_V_DC_LEAST), drive->v_next,
                   drive->i_ref);
#if SEQUENCE_HAS_POLARITY
    if (procedure_without_current(drive)) {
        drive->modulator.near = 0;
        drive->modulator.far = 0;
    }
#endif
}
