/* The motor, its inverter, DC link, sensors and load, in double precision and SI units.
 *
 * Truth for every test of the firmware, so it shares no code with it. METHODS.md 0.2: E1, E2, E6, E8,
 * E9, E10, E13, E14, E15. Between two switching instants (PWM edges, dead times, diodes starting or
 * ceasing to conduct) the circuit is fixed and its equations are integrated by an error-controlled step.
 * Parts: machine.h, gates.h (timer, dead time), bridge.h (switches, diodes, floating legs), dclink.h,
 * mechanics.h, sensor.h; circuit.h puts them together.
 *
 * Use: plant_create(), then for each PWM period plant_sample() -> control -> plant_set_pwm() for the
 * period that follows the coming one (the plant holds the one-period update delay), plant_run_period().
 * All legs are off until the first PWM takes effect. Cost: about 2 us a period on a PC; up to ten times
 * that where ripple takes the currents through zero in every period and v_switch_V is not zero.
 *
 * Conventions: METHODS.md 0.1. Peak (amplitude-invariant) values; theta_e = 0 when the d-axis is on
 * phase A; positive leg current flows into the motor. The carrier is centre-aligned and a period runs
 * from one centre of the all-low zero vector to the next: that is the default sample instant.
 * Tests: tests/unit/sim_plant. */
#ifndef PLANT_H
#define PLANT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PLANT_LEGS 3

typedef struct {
    double R_s_ohm;
    double L_d0_H;   /* core constants of the energy form: i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f, */
    double L_q0_H;   /* i_q = psi_q/L_q0 + c psi_q |psi|^4, |psi|^2 = psi_d^2 + psi_q^2               */
    double c_A_Wb5;  /* saturation coefficient; 0: linear machine */
    double psi_m_Wb; /* open-circuit magnet flux; i_f follows from it */
    int pole_pairs;
} plant_machine_t;

typedef struct {
    double J_kgm2;
    double B_Nms;        /* viscous */
    double T_coulomb_Nm; /* dry friction, with true sticking at standstill */
    bool locked;         /* rotor held */
} plant_mech_t;

typedef struct {
    double f_pwm_Hz;
    double dead_time_s;
    double v_switch_V;     /* drop of a closed switch, against the current in either direction */
    double v_diode_V;      /* drop of a diode while both switches of its leg are open */
    double r_on_ohm;       /* in series with both */
    uint32_t timer_counts; /* carrier counts in half a period: resolution of an edge */
} plant_inverter_t;

typedef struct {
    double v_source_V;
    double r_source_ohm;
    double c_F;         /* 0: stiff link */
    bool source_blocks; /* rectifier-fed: no current back into the source */
} plant_dclink_t;

typedef struct {
    int bits;              /* 0: ideal converter (no rounding, full-scale still clips) */
    double i_full_scale_A; /* codes span -fs ... +fs */
    double v_full_scale_V; /* DC-link channel spans 0 ... fs */
    double noise_lsb;      /* rms, at the converter */
    double gain_error[PLANT_LEGS];
    double offset_A[PLANT_LEGS];
    double delay_s; /* sample instant after the centre of the zero vector; may be negative */
    uint64_t seed;
} plant_sensor_t;

typedef struct {
    plant_machine_t machine;
    plant_mech_t mech;
    plant_inverter_t inverter;
    plant_dclink_t dclink;
    plant_sensor_t sensor;
    double tolerance; /* relative local error of the integrator; 0: 1e-6 */
} plant_config_t;

/* What the timer is told for one period. Compare values are counts of the half carrier: the high side
 * is on while the carrier is below compare, so compare/timer_counts is the duty of that half. */
typedef struct {
    uint32_t compare[PLANT_LEGS][2]; /* rising-edge half, falling-edge half */
    bool driven[PLANT_LEGS];         /* false: both switches of the leg off */
} plant_pwm_t;

/* Converter codes, left-aligned to 16 bits as the MCU delivers them; mid-scale is zero current. */
typedef struct {
    uint16_t i_leg[PLANT_LEGS];
    uint16_t v_dc;
} plant_adc_t;

/* Truth, for tests and traces only. */
typedef struct {
    double t_s;
    double i_A[PLANT_LEGS];
    double i_d_A, i_q_A;
    double psi_d_Wb, psi_q_Wb;
    double theta_e_rad; /* unwrapped */
    double omega_mech_rad_s;
    double torque_Nm;
    double v_dc_V;
    double v_leg_V[PLANT_LEGS];           /* terminals against the negative rail, just before t */
    double v_mean_alpha_V, v_mean_beta_V; /* mean terminal voltage over the last complete period */
    /* Energies since init: e_in (from the link into the legs) = e_copper + e_device (drops, r_on) + e_mech
     * (shaft) + e_field (change of the stored energy). */
    double e_in_J, e_copper_J, e_device_J, e_mech_J, e_field_J;
} plant_truth_t;

typedef struct plant plant_t;

/* NULL and a message in *error (static storage) when a value makes no sense. */
plant_t *plant_create(const plant_config_t *config, double theta_e_rad, const char **error);
void plant_destroy(plant_t *plant);

/* Values that a scenario may change between periods. One without sense is a bug of the caller: asserted. */
void plant_set_load(plant_t *plant, double torque_Nm);         /* opposes positive rotation */
void plant_set_speed(plant_t *plant, double omega_mech_rad_s); /* imposed by an ideal dynamometer ... */
void plant_free_speed(plant_t *plant);                         /* ... and released again */
void plant_set_locked(plant_t *plant, bool locked);
void plant_set_source(plant_t *plant, double v_source_V);
plant_machine_t *plant_machine(plant_t *plant); /* R, psi_m drift; next period on */
plant_sensor_t *plant_sensor(plant_t *plant);   /* sensor faults */

/* A slip: flux linkages are kept, so currents jump, but for those of floating legs. */
void plant_turn_rotor(plant_t *plant, double angle_e_rad);

/* Once a period, before plant_run_period(): for a positive delay_s it moves the plant on to that instant. */
void plant_sample(plant_t *plant, plant_adc_t *adc);
void plant_set_pwm(plant_t *plant, const plant_pwm_t *pwm); /* takes effect after the coming period */
void plant_trip(plant_t *plant);                            /* all legs off, at once, until plant_set_pwm */
void plant_run_period(plant_t *plant);
void plant_truth(const plant_t *plant, plant_truth_t *truth);

#ifdef __cplusplus
}
#endif

#endif
