#include "firmware/drive/second_bridge.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/math/compiler.h"
#include "firmware/math/image.h"

#if PM_CARRIES(NEEDS_BRIDGES)

#define UNEXPLAINED_MS 2U

static void write_second(const modulator_out_t *m, drive_out_t *out)
{
    for (uint32_t leg = 0; leg < DRIVE_LEGS; leg++) {
        pm_assume(m->on[leg] >= 0 && m->on[leg] <= UINT16_MAX);
        out->second[leg] = (uint16_t)m->on[leg];
    }
    out->second_legs = PM_LEGS_PWM;
}

void second_bridge_measure(drive_t *drive, const drive_in_t *in)
{
#if PM_HAS(two_sets)
    if (drive->config.winding == (uint8_t)WINDING_TWO_SETS) {
        drive->i_ab = two_sets_measure(&drive->two_sets, in->more.i_second, drive->i_ab);
    }
#else
    (void)drive;
    (void)in;
#endif
}

#if PM_HAS(two_sets)
/* Current that the sets have apart on purpose. */
static pm_q_t apart(const drive_t *drive)
{
    const position_t *position = &drive->position;
    const bool wanted = drive->stage == STAGE_VECTOR &&
                        mismatch_is_apart(&position->window, &drive->config.position.mismatch);
    return wanted ? position_injected(position) : 0;
}

pm_ab_t second_bridge_seen(const drive_t *drive)
{
    const drive_config_t *c = &drive->config;
    pm_ab_t v = drive->v_acting;
    if (c->position.mismatch.id == (uint8_t)MISMATCH_APART) {
        const pm_ab_t more = two_sets_unexplained(&drive->two_sets, &c->two_sets);
        v.alpha += more.alpha;
        v.beta += more.beta;
    }
    return v;
}
#endif

void second_bridge_control(drive_t *drive, const position_out_t *frame, pm_ab_t v, pm_ab_t i_quarter,
                           drive_out_t *out)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t v_dc = drive->status.v_dc;
    bridges_t bridges = {.v = {0, 0}};
    (void)frame;
#if PM_HAS(two_sets)
    if (c->winding == (uint8_t)WINDING_TWO_SETS) {
        const two_sets_in_t in = {.v = v,
                                  .apart = drive->carrier ? frame->carrier.apart : (pm_ab_t){0, 0},
                                  .i_quarter = i_quarter,
                                  .ahead = frame->ahead,
                                  .omega = frame->omega,
                                  .v_dc = v_dc,
                                  .z_q = apart(drive)};
        two_sets_step(&drive->two_sets, &c->two_sets, &drive->modulator, &c->modulator, &in, &bridges);
    }
#endif
#if PM_HAS(open_winding)
    if (c->winding == (uint8_t)WINDING_OPEN) {
        open_winding_step(&drive->open_winding, &c->open_winding, &drive->modulator, &c->modulator, v, v_dc,
                          i_quarter, &bridges);
    }
#endif
    drive->v_next = bridges.v;
    drive_write_out(&bridges.bridge[0], out);
    write_second(&bridges.bridge[1], out);
}

void second_bridge_without(drive_t *drive, drive_out_t *out)
{
    const bool tied = drive->config.winding != (uint8_t)WINDING_TWO_SETS || drive->stage == STAGE_SHORT;
    for (uint32_t leg = 0; leg < DRIVE_LEGS; leg++) {
        out->second[leg] = 0;
    }
    out->second_legs = tied && out->legs != PM_LEGS_OFF ? PM_LEGS_PWM : PM_LEGS_OFF;
    PM_IN_IMAGE(open_winding, open_winding_reset(&drive->open_winding);)
    PM_IN_IMAGE(two_sets, two_sets_reset(&drive->two_sets, &drive->config.two_sets);)
}

#if PM_HAS(open_winding)
/* Current, speed and carrier ask for the voltage: open_winding.h. */
static bool is_explained(const drive_t *drive)
{
    const pm_machine_t *machine = &drive->config.machine;
    const pm_q_t i_max = drive->config.i_max;
    const pm_q_t emf = pm_mul(pm_abs(drive->pll.omega), machine->psi_m + pm_mul(machine->L_q, i_max));
    const pm_q_t most = 2 * pm_mul(machine->R_s, i_max) + emf + emf / 2 + drive->status.v_dc / 16;
    const pm_q_t carrier = drive->carrier ? drive->config.open_winding.carrier : 0;
    const pm_q_t left = most + carrier - pm_abs(drive->open_winding.v_acting);
    const pm_ab_t v = drive->v_acting;
    return left > 0 && pm_mul(v.alpha, v.alpha) + pm_mul(v.beta, v.beta) <= pm_mul(left, left);
}

bool second_bridge_is_strained(drive_t *drive)
{
    uint8_t *ms = &drive->open_winding.unexplained_ms;
    *ms = is_explained(drive) ? 0U : (uint8_t)(*ms + 1U);
    return *ms > UNEXPLAINED_MS;
}
#endif

bool second_bridge_has_open_phase(drive_t *drive, pm_q_t least, pm_ab_t wanted, pm_ab_t i)
{
#if PM_HAS(two_sets)
    if (drive->config.winding == (uint8_t)WINDING_TWO_SETS) {
        const pm_ab_t z = drive->two_sets.z;
        const pm_ab_t i_1 = {.alpha = i.alpha + z.alpha, .beta = i.beta + z.beta};
        const pm_ab_t i_2 = {.alpha = i.alpha - z.alpha, .beta = i.beta - z.beta};
        const bool first = open_phase_slow(&drive->open_phase, least, wanted, i_1, 0);
        return open_phase_slow(&drive->second_open_phase, least, two_sets_backwards(wanted),
                               two_sets_backwards(i_2), 0) ||
               first;
    }
#endif
#if PM_HAS(open_winding)
    /* where i_0 flows it may be as large as what is wanted of a leg */
    return drive->config.open_winding.held &&
           open_phase_slow(&drive->open_phase, least, wanted, i, drive->open_winding.i);
#else
    return false;
#endif
}

void second_bridge_slow(drive_t *drive, pm_q_t omega)
{
    (void)drive;
    (void)omega;
    PM_IN_IMAGE(open_winding, open_winding_slow(&drive->open_winding, &drive->config.open_winding, omega);)
}

#endif
