/* One control period: measure, position, current control, modulation. */
#include "firmware/drive/drive.h"

#include "firmware/drive/drive_parts.h"
#include "firmware/drive/second_bridge.h"
#include "firmware/math/compiler.h"
#include "firmware/math/image.h"
#include "firmware/math/pair.h"
#include "firmware/math/trig.h"

/* A code of full scale is one. */
#define CURRENT_BITS (PM_Q_BITS - 15)

/* The currents sum to zero, so one that is missing follows from the others; with fewer than two those of the
 * period before stand. */
static inline pm_abc_t complete(const drive_t *drive, pm_abc_t i, uint32_t missing)
{
    pm_abc_t whole = i;
    switch (missing) {
    case 0U:
        break;
    case 1U:
        whole.a = -(i.b + i.c);
        break;
    case 2U:
        whole.b = -(i.c + i.a);
        break;
    case 4U:
        whole.c = -(i.a + i.b);
        break;
    default:
        whole = drive->i_abc;
        break;
    }
    return whole;
}

static inline pm_abc_t currents(const drive_t *drive, const uint16_t code[DRIVE_LEGS], pm_q_t zero_c)
{
    const pm_q_t *zero = drive->zero;
    const pm_pair_t zero_ab = pm_pair(&zero[0], &zero[1]);
    return (pm_abc_t){
        .a = pm_shl(code[0], CURRENT_BITS) - zero_ab.first,
        .b = pm_shl(code[1], CURRENT_BITS) - zero_ab.second,
        .c = pm_shl(code[2], CURRENT_BITS) - zero_c,
    };
}

#if PM_CARRIES(PM_MEASURED)
static inline obs_more_t measure_more(drive_t *drive, const drive_in_t *in)
{
    (void)drive;
    obs_more_t more = {.codes = &in->more};
#if PM_HAS(zero_vector)
    more.v_dc = &drive->status.v_dc;
#endif
#if PM_HAS(pwm_excitation)
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        if (pm_sampled(&in->more, n)) {
            more.i_sample[n] = pm_clarke(currents(drive, in->more.i_sample[n], drive->zero[2]));
        }
    }
#endif
#if PM_HAS(two_sets) && PM_CARRIES(NEEDS_NEUTRAL)
    more.v_zero_second =
        neutral_signal(&drive->two_sets.neutral, &drive->config.neutral, in->more.v_neutral_second);
    more.apart = drive->two_sets.z;
#endif
#if PM_HAS(open_winding)
    if (pm_rarely(drive->config.winding == (uint8_t)WINDING_OPEN)) {
        more.v_zero = open_winding_signal(&drive->open_winding, &drive->config.open_winding, drive->i_abc);
        return more;
    }
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    more.v_zero = neutral_signal(&drive->neutral, &drive->config.neutral, in->more.v_neutral) -
                  neutral_star(&drive->neutral, &drive->config.neutral, drive->v_acting);
#endif
#if PM_HAS(two_sets) && PM_CARRIES(NEEDS_NEUTRAL)
    if (drive->config.two_sets.between) { /* v_N1 - v_N2, which is -(v_01 - v_02) */
        more.v_zero_second = pm_half(more.v_zero);
        more.v_zero = -more.v_zero_second;
    }
#endif
    return more;
}
#endif

static inline void measure(drive_t *drive, const drive_in_t *in, int32_t v_bits)
{
    const pm_pair_t zero_c = pm_pair(&drive->zero[2], &drive->modulator.hidden);
    pm_abc_t i = currents(drive, in->i_leg, zero_c.first);
    if (pm_rarely(zero_c.second != 0)) {
        drive->completed = drive->period;
        i = complete(drive, i, modulator_take_hidden(&drive->modulator));
    }
#if PM_CARRIES(NEEDS_CURRENT_MASK)
    if (pm_rarely(in->more.missing != 0U)) {
        drive->completed = drive->period;
        i = complete(drive, i, in->more.missing);
    }
#endif
    drive->i_abc = i;
    drive->i_ab = pm_clarke(i);
#if PM_CARRIES(NEEDS_BRIDGES)
    if (pm_rarely(drive->config.winding != (uint8_t)WINDING_STAR)) {
        second_bridge_measure(drive, in);
    }
#endif
    drive->status.v_dc = pm_shl(in->v_dc, (uint32_t)v_bits);
}

static void off(drive_out_t *out)
{
    out->legs = PM_LEGS_OFF;
}

/* Only those that drive the legs themselves have a step. */
#define STEP_OF(name)                                                                                        \
    {                                                                                                        \
        drive->procedure.result = procedure_##name##_step(drive, in, out);                                   \
    }
#define STEP(name)      PM_IN_IMAGE(name, case PROCEDURE_##name : STEP_OF(name) break;)
#define STEP_BARE(name) STEP(name)
#define STEP_LEGS(name) STEP(name)
#define STEP_ALONE(name)
#define STEP_CONTROL(name)
#define FIRST_BARE(name)
#define FIRST_LEGS(name)
#define FIRST_ALONE(name)                                                                                    \
    PM_IN_IMAGE(                                                                                             \
        name, if (id == (uint8_t)PROCEDURE_##name) {                                                         \
            STEP_OF(name)                                                                                    \
            return;                                                                                          \
        })
#define FIRST_CONTROL(name)

/* The procedure that has the legs, until it ends. What is not part of a start is looked for first: it takes the
 * most time of a period. */
static inline void procedure_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    const uint8_t id = drive->sequence.procedure;
    if (drive->procedure.result != PM_RUNNING) {
        off(out);
        return;
    }
#define PM_METHOD(name, help, traits, needs) FIRST_##traits(name)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    switch (id) {
#define PM_METHOD(name, help, traits, needs) STEP_##traits(name)
#include "firmware/drive/procedures/procedures.def"
#undef PM_METHOD
    default:
        break;
    }
}

/* Currents and DC link need not be looked at twice, and cannot be before the calibration. */
static inline bool is_checked(const drive_t *drive, const drive_in_t *in)
{
    return drive->stage == STAGE_PROCEDURE && drive->state != DRIVE_CALIBRATING && !in->hw_fault &&
           protection_passed(drive, drive->config.protection.i_trip_squared);
}

/* A period without control: a fault, the bridge off, or a procedure that has the legs. */
PM_RARE static void without_control(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    const bool checked = is_checked(drive, in);
    drive->v_acting = drive->v_next;
    PM_IF_HELD(held_end(&drive->held);)
    out->trip = 0;
    drive_clear_instants(out);
    if (!checked) {
        drive->v_next = (pm_ab_t){0, 0};
        drive->hw_fault = in->hw_fault;
        protection_step(drive);
        drive->status.theta = drive->pll.theta;
        if (drive->stage == STAGE_SHORT) {
            fault_short_step(drive, out);
        } else {
            off(out);
            out->trip = drive->fault != DRIVE_FAULT_NONE ? 1U : 0U;
        }
    }
    if (checked || drive->stage == STAGE_PROCEDURE) {
        procedure_step(drive, in, out);
    }
#if PM_CARRIES(NEEDS_BRIDGES)
    second_bridge_without(drive, out);
#endif
}

/* Open loop at a speed where the observer has an angle of its own. */
static inline position_out_t imposed_frame(const drive_t *drive)
{
    const pm_dir_t dir = pm_dir(drive->theta_open);
    return (position_out_t){.ahead = pm_dir_sum(dir, pm_pair_dir(&drive->ahead)),
                            .i = pm_park(drive->i_ab, dir),
                            .omega = drive->omega_open};
}

/* What a carrier asks of the period beside its mean voltage. */
static inline void excite(drive_t *drive, const excitation_t *carrier, drive_out_t *out)
{
#if PM_CARRIES(NEEDS_HALVES)
    modulator_split(&drive->modulator, &drive->config.modulator, carrier->split, drive->status.v_dc,
                    out->compare);
#endif
#if PM_HAS(pwm_excitation)
    for (uint32_t n = 0; n < PM_SAMPLES; n++) {
        out->instants.sample_at[n] |= carrier->sample_at[n]; /* never both, config_position.c */
    }
#endif
    (void)drive;
    (void)carrier;
    (void)out;
}

static inline pm_dq_t current_wanted(const drive_t *drive, const position_out_t *frame)
{
    pm_dq_t i_ref = pm_pair_dq(&drive->i_ref);
#if PM_HAS(current_sine)
    i_ref.d += drive->carrier ? frame->carrier.i_ref : 0;
#endif
    (void)frame;
    return i_ref;
}

/* The voltage acts one and a half periods later, when the frame has turned to drive->ahead. */
static inline void control(drive_t *drive, const position_out_t *frame, bool usual, drive_out_t *out)
{
    const drive_config_t *c = &drive->config;
    const pm_q_t v_dc = drive->status.v_dc;
    const regulator_in_t in = {.i = frame->i,
                               .i_ref = current_wanted(drive, frame),
                               .omega = frame->omega,
                               .v_max = pm_unit(v_dc, drive->v_share),
                               PM_IF_HELD(.ahead = frame->ahead, .v_dc = v_dc)};
    regulator_out_t *u = &drive->voltage;
    regulator_step_usual(&drive->regulator, &drive->regulator_config, usual, &in, u);
    drive->status.i = frame->i;

    const pm_dq_t v = {.d = pm_shl(u->v.d, 30 - PM_WIDE_BITS), .q = pm_shl(u->v.q, 30 - PM_WIDE_BITS)};
    pm_ab_t v_ab = pm_park_inverse_quarter(v, frame->ahead);
#if REGULATION_HOLDS
    if (pm_rarely(u->legs != 0U)) {
        held_step(drive);
        drive->v_next = v_ab;
        out->legs = u->legs;
        out->trip = 0;
        drive_clear_instants(out);
        return;
    }
#endif
    pm_dq_t i = frame->i;
    if (drive->carrier) {
        v_ab.alpha += frame->carrier.v.alpha;
        v_ab.beta += frame->carrier.v.beta;
#if PM_HAS(counted_carrier)
        i.d += frame->carrier.i.d;
        i.q += frame->carrier.i.q;
#endif
    }
    const pm_ab_t i_quarter = pm_park_inverse_quarter(i, frame->ahead);
#if PM_CARRIES(NEEDS_BRIDGES)
    if (pm_rarely(c->winding != (uint8_t)WINDING_STAR)) {
        second_bridge_control(drive, frame, v_ab, i_quarter, out);
        return;
    }
#endif
    modulator_out_t m;
    modulator_step(&drive->modulator, &c->modulator, v_ab, v_dc, i_quarter, &m);
    drive->v_next = m.v;
    drive_write_out(&m, out);
#if PM_HAS(zero_vector)
    out->instants.sample_at[0] = drive->position.sample_at;
#endif
    if (drive->carrier) {
        excite(drive, &frame->carrier, out);
    }
}

void drive_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    const protection_config_t *limits = &drive->config.protection;
    const pm_pair_t i_trip_and_bits = pm_pair(&limits->i_trip_squared, &limits->v_bits);
    drive->period++;
    measure(drive, in, i_trip_and_bits.second);
    if (drive->stage < STAGE_OPEN_LOOP || in->hw_fault || !protection_passed(drive, i_trip_and_bits.first)) {
#if PM_HAS(six_step)
        if (drive->stage == STAGE_SIX_STEP && !in->hw_fault &&
            protection_passed(drive, i_trip_and_bits.first)) {
            block_step(drive, in, out);
            return;
        }
#endif
        without_control(drive, in, out);
    } else {
        PM_IF_MEASURED(const obs_more_t more = measure_more(drive, in);)
#if PM_HAS(two_sets)
        const pm_ab_t of_first = second_bridge_seen(drive);
        const pm_ab_t *v = &of_first;
#else
        const pm_ab_t *v = &drive->v_acting;
#endif
        const position_in_t seen = {
            .v = v, .i = drive->i_ab, .ahead = &drive->ahead, PM_IF_MEASURED(.more = &more)};
        position_out_t frame;
        position_step(&drive->position, &drive->config.position, &seen, &frame);
        const pm_ab_t next = pm_pair_ab(&drive->v_next);
        drive->v_acting.alpha = next.alpha;
        drive->v_acting.beta = next.beta;
        drive->status.theta = drive->position.pll.theta;
        bool usual = drive->usual;
        if (!usual) {
            usual = drive->regulator_config.id == REGULATOR_INLINE;
            if (drive->stage != STAGE_VECTOR) {
                drive->theta_open += (pm_angle_t)drive->turn_open;
                if (!drive->forced) {
                    frame = imposed_frame(drive);
                }
            }
        }
        control(drive, &frame, usual, out);
    }
}
