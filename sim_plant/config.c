#include "sim_plant/config.h"

#include <math.h>
#include <stddef.h>

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

const char *config_machine_fault(const plant_machine_t *m)
{
    REQUIRE(not_negative(m->R_s_ohm), "machine.R_s_ohm must be finite and not negative")
    REQUIRE(positive(m->L_d0_H), "machine.L_d0_H must be positive")
    REQUIRE(positive(m->L_q0_H), "machine.L_q0_H must be positive")
    REQUIRE(not_negative(m->c_A_Wb5), "machine.c_A_Wb5 must be finite and not negative")
    REQUIRE(not_negative(m->psi_m_Wb), "machine.psi_m_Wb must be finite and not negative")
    REQUIRE(m->pole_pairs > 0, "machine.pole_pairs must be at least 1")
    return NULL;
}

static const char *mech_fault(const plant_mech_t *m)
{
    REQUIRE(positive(m->J_kgm2), "mech.J_kgm2 must be positive")
    REQUIRE(not_negative(m->B_Nms), "mech.B_Nms must be finite and not negative")
    REQUIRE(not_negative(m->T_coulomb_Nm), "mech.T_coulomb_Nm must be finite and not negative")
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
    return NULL;
}

static const char *dclink_fault(const plant_dclink_t *d)
{
    REQUIRE(not_negative(d->v_source_V), "dclink.v_source_V must be finite and not negative")
    REQUIRE(not_negative(d->r_source_ohm), "dclink.r_source_ohm must be finite and not negative")
    REQUIRE(not_negative(d->c_F), "dclink.c_F must be finite and not negative")
    REQUIRE(d->c_F == 0.0 || d->r_source_ohm > 0.0, "dclink.r_source_ohm must be positive when c_F is")
    REQUIRE(d->c_F > 0.0 || !d->source_blocks, "dclink.source_blocks needs a capacitor, c_F > 0")
    return NULL;
}

const char *config_sensor_fault(const plant_sensor_t *s, double period_s)
{
    REQUIRE(s->bits >= 0 && s->bits <= 16, "sensor.bits must be 0 (ideal) to 16")
    REQUIRE(positive(s->i_full_scale_A), "sensor.i_full_scale_A must be positive")
    REQUIRE(positive(s->v_full_scale_V), "sensor.v_full_scale_V must be positive")
    REQUIRE(not_negative(s->noise_lsb), "sensor.noise_lsb must be finite and not negative")
    REQUIRE(fabs(s->delay_s) < period_s, "sensor.delay_s must be less than a PWM period either way")
    for (int k = 0; k < PLANT_LEGS; k++) {
        REQUIRE(isfinite(s->gain_error[k]), "sensor.gain_error must be finite")
        REQUIRE(isfinite(s->offset_A[k]), "sensor.offset_A must be finite")
    }
    return NULL;
}

const char *config_fault(const plant_config_t *config)
{
    const char *fault = config_machine_fault(&config->machine);
    fault = fault ? fault : mech_fault(&config->mech);
    fault = fault ? fault : inverter_fault(&config->inverter);
    fault = fault ? fault : dclink_fault(&config->dclink);
    fault = fault ? fault : config_sensor_fault(&config->sensor, 1.0 / config->inverter.f_pwm_Hz);
    if (!fault && !(config->tolerance >= 0.0 && config->tolerance <= 1e-2)) {
        fault = "tolerance must be between 0 (default) and 0.01";
    }
    return fault;
}
