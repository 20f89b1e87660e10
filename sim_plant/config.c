#include "sim_plant/config.h"

#include "sim_plant/machine.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

/* Comparisons are written so that NaN fails them. */
static bool positive(double x)
{
    return x > 0.0 && isfinite(x);
}

static bool not_negative(double x)
{
    return x >= 0.0 && isfinite(x);
}

#define REQUIRE(condition, message)                                                                          \
    if (!(condition)) {                                                                                      \
        return message;                                                                                      \
    }

static const char *core_fault(const plant_config_t *config)
{
    const plant_machine_t *m = &config->machine;
    REQUIRE(not_negative(m->R_s_ohm), "machine.R_s_ohm must be finite and not negative")
    REQUIRE(m->pole_pairs > 0, "machine.pole_pairs must be at least 1")
    if (config->map == NULL) {
        REQUIRE(positive(m->L_d0_H), "machine.L_d0_H must be positive")
        REQUIRE(positive(m->L_q0_H), "machine.L_q0_H must be positive")
        REQUIRE(not_negative(m->c_A_Wb5), "machine.c_A_Wb5 must be finite and not negative")
        REQUIRE(not_negative(m->psi_m_Wb), "machine.psi_m_Wb must be finite and not negative")
    }
    return NULL;
}

#define ORDER_MOST 1000

static bool sound_harmonics(const plant_harmonic_t harmonic[], int count)
{
    for (int n = 0; n < count; n++) {
        if (harmonic[n].order < 0 || harmonic[n].order > ORDER_MOST || !isfinite(harmonic[n].amplitude) ||
            !isfinite(harmonic[n].phase_rad)) {
            return false;
        }
    }
    return true;
}

/* Those of winding.h, or none */
static bool sound_saliency(const plant_harmonic_t harmonic[])
{
    for (int n = 0; n < PLANT_HARMONICS; n++) {
        int order = harmonic[n].order;
        bool possible = order == 0 || (order > 0 ? order % 3 == 2 : -order % 3 == 1);
        if (!possible || abs(order) > ORDER_MOST || !isfinite(harmonic[n].amplitude) ||
            !isfinite(harmonic[n].phase_rad)) {
            return false;
        }
    }
    return true;
}

static const char *phases_fault(const plant_winding_t *w, double R_s_ohm)
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        REQUIRE(isfinite(w->dR_ohm[k]) && R_s_ohm + w->dR_ohm[k] >= 0.0,
                "winding.dR_ohm must leave no phase with a negative resistance")
        REQUIRE(isfinite(w->dL_H[k]), "winding.dL_H must be finite")
        REQUIRE(isfinite(w->dM_H[k / 3][k % 3]), "winding.dM_H must be finite")
        REQUIRE(isfinite(w->emf_gain[k]), "winding.emf_gain must be finite")
        REQUIRE(isfinite(w->emf_shift_rad[k]), "winding.emf_shift_rad must be finite")
    }
    return NULL;
}

static const char *winding_fault(const plant_winding_t *w, double R_s_ohm)
{
    bool open = w->connection == PLANT_OPEN;
    REQUIRE(w->sets >= 0 && w->sets <= PLANT_SETS, "winding.sets must be 1 or 2")
    REQUIRE(w->connection == PLANT_STAR || open, "winding.connection must be star or open")
    REQUIRE(!open || w->sets < 2, "winding.connection open needs one set: six legs are all there are")
    REQUIRE(open ? positive(w->L_0_H) : not_negative(w->L_0_H),
            "winding.L_0_H must be finite and not negative, and positive for an open winding")
    REQUIRE(isfinite(w->M_d_H) && isfinite(w->M_q_H), "winding.M_d_H and M_q_H must be finite")
    REQUIRE(isfinite(w->dL_0_H) && isfinite(w->L_c0_H), "winding.dL_0_H and L_c0_H must be finite")
    REQUIRE(isfinite(w->dL_0_d_1_A) && isfinite(w->dL_0_q_1_A2) && isfinite(w->L_c0_q_H_A),
            "winding.dL_0_d_1_A, dL_0_q_1_A2 and L_c0_q_H_A must be finite")
    REQUIRE(!open || (w->dL_0_d_1_A == 0.0 && w->dL_0_q_1_A2 == 0.0 && w->L_c0_q_H_A == 0.0),
            "winding.dL_0_d_1_A, dL_0_q_1_A2 and L_c0_q_H_A are of a star: in an open winding the psi_0 of a "
            "flux map moves with the currents")
    REQUIRE(sound_harmonics(w->emf, PLANT_HARMONICS),
            "winding.emf must have finite values and orders to 1000")
    REQUIRE(sound_saliency(w->saliency),
            "winding.saliency must have finite values, and of the orders to 1000 those that three equal "
            "phases can have: 2, 5, 8, 11 ... and -1, -4, -7, -10 ...")
    REQUIRE(sound_saliency(w->zero_saliency),
            "winding.zero_saliency must have finite values, and of the orders to 1000 those that three equal "
            "phases can have: 2, 5, 8, 11 ... and -1, -4, -7, -10 ...")
    REQUIRE(sound_harmonics(w->cogging, PLANT_HARMONICS),
            "winding.cogging must have finite values and orders to 1000")
    REQUIRE(not_negative(w->L_eddy_d_H) && not_negative(w->L_eddy_q_H),
            "winding.L_eddy_d_H and L_eddy_q_H must be finite and not negative")
    REQUIRE(not_negative(w->R_eddy_ohm), "winding.R_eddy_ohm must be finite and not negative")
    REQUIRE(not_negative(w->r_winding_ohm), "winding.r_winding_ohm must be finite and not negative")
    REQUIRE(isfinite(w->alpha_R_1_K) && isfinite(w->alpha_psi_1_K), "winding.alpha must be finite")
    return phases_fault(w, R_s_ohm);
}

const char *config_machine_fault(const plant_config_t *config)
{
    const char *fault = core_fault(config);
    fault = fault ? fault : winding_fault(&config->winding, config->machine.R_s_ohm);
    if (fault) {
        return fault;
    }
    const plant_winding_t *w = &config->winding;
    REQUIRE(w->connection == PLANT_STAR || !map_zero_given(config->map) ||
                (w->L_eddy_d_H == 0.0 && w->L_eddy_q_H == 0.0),
            "winding.L_eddy_d_H and L_eddy_q_H cannot stand beside psi_0 of a table in an open winding")
    machine_t machine;
    machine_set(&machine, config, 25.0, 25.0);
    REQUIRE(machine_is_sound(&machine),
            "winding: with dL, dM, saliency and the mutual inductances some inductance is not positive")
    return NULL;
}

static const char *mech_fault(const plant_mech_t *m)
{
    REQUIRE(positive(m->J_kgm2), "mech.J_kgm2 must be positive")
    REQUIRE(not_negative(m->B_Nms), "mech.B_Nms must be finite and not negative")
    REQUIRE(not_negative(m->T_coulomb_Nm), "mech.T_coulomb_Nm must be finite and not negative")
    REQUIRE(not_negative(m->J_load_kgm2), "mech.J_load_kgm2 must be finite and not negative")
    REQUIRE(m->J_load_kgm2 > 0.0 ? positive(m->k_shaft_Nm) : m->k_shaft_Nm == 0.0,
            "mech.k_shaft_Nm must be positive with a second mass J_load_kgm2, and is nothing without")
    REQUIRE(not_negative(m->d_shaft_Nms) && (m->J_load_kgm2 > 0.0 || m->d_shaft_Nms == 0.0),
            "mech.d_shaft_Nms must not be negative, and is nothing without J_load_kgm2")
    REQUIRE(not_negative(m->load_Nms) && not_negative(m->load_Nms2),
            "mech.load_Nms and load_Nms2 must be finite and not negative")
    REQUIRE(sound_harmonics(m->load_angle, 4), "mech.load_angle must have finite values and orders to 1000")
    return NULL;
}

static const char *inverter_fault(const plant_inverter_t *v)
{
    REQUIRE(positive(v->f_pwm_Hz), "inverter.f_pwm_Hz must be positive")
    REQUIRE(not_negative(v->dead_time_s), "inverter.dead_time_s must be finite and not negative")
    REQUIRE(v->dead_time_s < 0.5 / v->f_pwm_Hz, "inverter.dead_time_s must be less than half a PWM period")
    REQUIRE(not_negative(v->v_switch_V), "inverter.v_switch_V must be finite and not negative")
    REQUIRE(not_negative(v->v_diode_V), "inverter.v_diode_V must be finite and not negative")
    REQUIRE(not_negative(v->r_on_ohm), "inverter.r_on_ohm must be finite and not negative")
    REQUIRE(v->timer_counts > 0, "inverter.timer_counts must be at least 1")
    REQUIRE(not_negative(v->turn_on_s) && not_negative(v->turn_off_s),
            "inverter.turn_on_s and turn_off_s must be finite and not negative")
    REQUIRE(v->dead_time_s + v->turn_on_s < 0.5 / v->f_pwm_Hz,
            "inverter.turn_on_s with the dead time must be less than half a PWM period")
    REQUIRE(v->turn_off_s <= v->dead_time_s + v->turn_on_s,
            "inverter.turn_off_s beyond dead time and turn_on_s shorts the link at every edge")
    REQUIRE(not_negative(v->bootstrap_charge_s),
            "inverter.bootstrap_charge_s must be finite and not negative")
    REQUIRE(
        v->bootstrap_charge_s == 0.0 ||
            (positive(v->bootstrap_hold_s) && positive(v->bootstrap_lockout) && v->bootstrap_lockout < 1.0),
        "inverter.bootstrap_charge_s needs bootstrap_hold_s above zero and bootstrap_lockout between 0 and 1")
    REQUIRE(not_negative(v->c_leg_F), "inverter.c_leg_F must be finite and not negative")
    return NULL;
}

static const char *dclink_fault(const plant_dclink_t *d)
{
    REQUIRE(not_negative(d->v_source_V), "dclink.v_source_V must be finite and not negative")
    REQUIRE(not_negative(d->r_source_ohm), "dclink.r_source_ohm must be finite and not negative")
    REQUIRE(not_negative(d->c_F), "dclink.c_F must be finite and not negative")
    REQUIRE(d->c_F == 0.0 || d->r_source_ohm > 0.0, "dclink.r_source_ohm must be positive when c_F is")
    REQUIRE(d->c_F > 0.0 || !d->source_blocks, "dclink.source_blocks needs a capacitor, c_F > 0")
    REQUIRE(d->ripple_V == 0.0 || (isfinite(d->ripple_V) && positive(d->ripple_Hz)),
            "dclink.ripple_Hz must be positive with a finite ripple_V")
    REQUIRE(d->c_F > 0.0 || d->ripple_V == 0.0, "dclink.ripple_V needs a capacitor, c_F > 0")
    REQUIRE(not_negative(d->r_chopper_ohm), "dclink.r_chopper_ohm must be finite and not negative")
    REQUIRE(d->c_F > 0.0 || d->r_chopper_ohm == 0.0, "dclink.r_chopper_ohm needs a capacitor, c_F > 0")
    REQUIRE(d->r_chopper_ohm == 0.0 ||
                (positive(d->v_chopper_off_V) && d->v_chopper_on_V > d->v_chopper_off_V &&
                 isfinite(d->v_chopper_on_V)),
            "dclink.v_chopper_on_V must exceed v_chopper_off_V, both positive")
    return NULL;
}

const char *config_sensor_fault(const plant_sensor_t *s, double period_s)
{
    REQUIRE(s->bits >= 0 && s->bits <= 16, "sensor.bits must be 0 (ideal) to 16")
    REQUIRE(positive(s->i_full_scale_A), "sensor.i_full_scale_A must be positive")
    REQUIRE(positive(s->v_full_scale_V), "sensor.v_full_scale_V must be positive")
    REQUIRE(not_negative(s->noise_lsb), "sensor.noise_lsb must be finite and not negative")
    REQUIRE(fabs(s->delay_s) < period_s, "sensor.delay_s must be less than a PWM period either way")
    REQUIRE(s->shunt >= PLANT_IN_LINE && s->shunt <= PLANT_SINGLE_SHUNT,
            "sensor.shunt must be in_line, low_side or single_shunt")
    REQUIRE(not_negative(s->settle_s) && s->settle_s < period_s,
            "sensor.settle_s must be less than a PWM period and not negative")
    REQUIRE(not_negative(s->v_leg_full_scale_V) && not_negative(s->t_full_scale_degC),
            "sensor: full scales must be finite and not negative")
    REQUIRE(not_negative(s->filter_s) && not_negative(s->hysteresis_V) && not_negative(s->capture_s),
            "sensor.filter_s, hysteresis_V and capture_s must be finite and not negative")
    REQUIRE(s->comparator_reference >= PLANT_REFERENCE_MEAN &&
                s->comparator_reference <= PLANT_REFERENCE_NEUTRAL,
            "sensor.comparator_reference must be mean, half_link or neutral")
    REQUIRE(not_negative(s->comparator_blanking_s) && s->comparator_blanking_s < period_s,
            "sensor.comparator_blanking_s must be less than a PWM period and not negative")
    REQUIRE(not_negative(s->i_dc_full_scale_A) && not_negative(s->i_dc_filter_s) &&
                isfinite(s->i_dc_gain_error) && isfinite(s->i_dc_offset_A),
            "sensor.i_dc_*: range and filter must be finite and not negative, gain error and offset finite")
    REQUIRE(isfinite(s->v_dc_offset_V) && isfinite(s->v_zero_offset_V) && isfinite(s->v_zero_gain_error),
            "sensor: offsets and gain errors must be finite")
    REQUIRE(not_negative(s->i_filter_s) && not_negative(s->v_zero_filter_s),
            "sensor.i_filter_s and v_zero_filter_s must be finite and not negative")
    REQUIRE(s->i_filter_s == 0.0 || s->shunt == PLANT_IN_LINE,
            "sensor.i_filter_s is for shunts in line; the others settle, settle_s")
    REQUIRE(not_negative(s->v_zero_full_scale_V) && not_negative(s->v_zero_network_ohm) &&
                not_negative(s->v_zero_load_ohm) && not_negative(s->v_zero_noise_lsb),
            "sensor.v_zero_*: range, resistances and noise must be finite and not negative")
    REQUIRE(s->v_zero_bits >= 0 && s->v_zero_bits <= 16, "sensor.v_zero_bits must be 0 (bits) to 16")
    for (int k = 0; k < PLANT_LEGS; k++) {
        REQUIRE(s->v_zero_network_error[k] > -1.0 && isfinite(s->v_zero_network_error[k]),
                "sensor.v_zero_network_error must be finite and above -1")
        REQUIRE(isfinite(s->gain_error[k]), "sensor.gain_error must be finite")
        REQUIRE(isfinite(s->offset_A[k]), "sensor.offset_A must be finite")
        REQUIRE(isfinite(s->comparator_offset_V[k]), "sensor.comparator_offset_V must be finite")
    }
    for (int n = 0; n < PLANT_LEGS + PLANT_SETS; n++) {
        REQUIRE(s->divider_error[n] > -1.0 && isfinite(s->divider_error[n]),
                "sensor.divider_error must be finite and above -1")
        REQUIRE(isfinite(s->v_offset_V[n]), "sensor.v_offset_V must be finite")
    }
    return NULL;
}

const char *config_fault(const plant_config_t *config)
{
    const char *fault = config_machine_fault(config);
    fault = fault ? fault : mech_fault(&config->mech);
    fault = fault ? fault : inverter_fault(&config->inverter);
    fault = fault ? fault : dclink_fault(&config->dclink);
    fault = fault ? fault : config_sensor_fault(&config->sensor, 1.0 / config->inverter.f_pwm_Hz);
    if (!fault && config->winding.r_winding_ohm > 0.0 && config->inverter.c_leg_F == 0.0) {
        fault = "winding.r_winding_ohm needs inverter.c_leg_F: without it nothing rings";
    }
    if (!fault && config->sensor.comparator_reference == PLANT_REFERENCE_NEUTRAL &&
        config->winding.connection == PLANT_OPEN) {
        fault = "sensor.comparator_reference: an open winding has no neutral";
    }
    if (!fault && config->sensor.v_zero_between && config->winding.sets != 2) {
        fault = "sensor.v_zero_between is for two sets";
    }
    double tolerance = config->tolerance;
    if (!fault && tolerance != 0.0 && !(tolerance >= 1e-12 && tolerance <= 1e-2)) {
        fault = "tolerance must be 0 (default) or between 1e-12 and 0.01";
    }
    return fault;
}
