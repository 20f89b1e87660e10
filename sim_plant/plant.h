/* The motor, its inverter, DC link, sensors and load, in double precision and SI units.
 *
 * Truth for every test of the firmware, so it shares no code with it. METHODS.md 0.2, E1 to E19. Between
 * two switching instants (PWM edges, dead times, diodes starting or ceasing to conduct) the circuit is fixed
 * and its equations are integrated by an error-controlled step.
 * Parts: plant_config.h (what it is made of), machine.h, gates.h (timer, dead time), bridge.h (switches,
 * diodes, floating legs), dclink.h, mechanics.h, sensor.h; circuit.h puts them together.
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

#include "sim_plant/plant_config.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How the timer drives a leg. The share of the period at the upper rail is compare/timer_counts, as long as
 * the current keeps the diode of the switch that is off conducting. */
typedef enum {
    PLANT_LEG_PWM,      /* both switches, one the complement of the other, with dead time */
    PLANT_LEG_UPPER,    /* the upper switch is on for that share, the lower one off: freewheeling through its
                        diode */
    PLANT_LEG_LOWER,    /* the lower switch is on for the rest, the upper one off */
    PLANT_LEG_HIGH,     /* held at the upper rail whatever compare says, */
    PLANT_LEG_LOW,      /* at the lower rail */
    PLANT_LEG_INVERTED, /* both switches, the lower one on for that share, about the middle of the period */
    PLANT_LEG_LOWER_INVERTED /* that one alone */
} plant_leg_state_t;

/* The timer's settings for one period. Compare values are counts of the half carrier: the high side
 * is on while the carrier is below compare, so compare/timer_counts is the duty of that half. */
typedef struct {
    uint32_t compare[PLANT_LEGS][2];     /* rising-edge half, falling-edge half */
    bool driven[PLANT_LEGS];             /* false: both switches of the leg off, whatever its state */
    double driven_after_s;               /* driven and state take effect so long after the period's start */
    plant_leg_state_t state[PLANT_LEGS]; /* of driven legs */
} plant_pwm_t;

/* Converter codes, left-aligned to 16 bits as the MCU delivers them; mid-scale is zero current. */
typedef struct {
    uint16_t i_leg[PLANT_LEGS]; /* single shunt: the link current in [0] */
    uint16_t v_dc;
    uint16_t v_leg[PLANT_LEGS];
    uint16_t v_neutral[PLANT_SETS];
    uint16_t v_zero[PLANT_SETS]; /* mid-scale is none */
    uint16_t i_dc;               /* of a sensor beside those of the legs; mid-scale is none */
    uint16_t temperature;
    uint8_t settled; /* bit k: i_leg[k] was sampled in its valid window */
} plant_adc_t;

/* An edge of a terminal comparator, in counts of capture_s since the start of the period it fell into. */
typedef struct {
    uint32_t count;
    uint8_t leg;
    bool rising;
} plant_capture_t;

typedef enum {
    PLANT_HEALTHY,
    PLANT_UPPER_OPEN, /* a switch that no longer closes, ... */
    PLANT_LOWER_OPEN,
    PLANT_UPPER_SHORT, /* ... or no longer opens */
    PLANT_LOWER_SHORT,
    PLANT_WIRE_OPEN /* the terminal of the motor has come off the leg */
} plant_leg_fault_t;

/* Over-current comparators, one per leg, on what its shunt sees: on the low side only while the lower path of
 * the leg conducts. */
typedef struct {
    double above_A[PLANT_LEGS]; /* acts when the leg's current is above this; 0: never */
    double below_A[PLANT_LEGS]; /* acts when it is below minus this; 0: never */
    double delay_s;             /* from there until all legs are off, less than a period */
} plant_break_t;

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
    double v_leg_V[PLANT_LEGS];     /* terminals against the negative rail, just before t */
    double v_neutral_V[PLANT_SETS]; /* star points against the negative rail */
    double v_zero_V[PLANT_SETS];    /* zero sequence of the phase voltages: star network against neutral */
    double i_zero_A;                /* of an open winding */
    double i_dc_A;                  /* from the link into the legs */
    double v_mean_alpha_V, v_mean_beta_V; /* mean terminal voltage of set 0 over the last complete period */
    double omega_load_rad_s;              /* of the second mass */
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
plant_machine_t *plant_machine(plant_t *plant); /* drift; next period on */
plant_sensor_t *plant_sensor(plant_t *plant);   /* sensor faults */
const plant_inverter_t *plant_inverter(const plant_t *plant);
int plant_leg_count(const plant_t *plant); /* 3, or 6 */
void plant_set_temperature(plant_t *plant, double winding_degC, double magnet_degC);
void plant_set_leg_fault(plant_t *plant, int leg, plant_leg_fault_t fault);
void plant_set_supply(plant_t *plant, bool connected); /* lost supply: the link runs on its capacitor */
/* Ties two terminals, or one to the negative rail (leg_b < 0), through a resistance and 1 uH; R < 0 opens. Such
 * a leg has no output capacitance meanwhile (bridge.h). */
void plant_set_short(plant_t *plant, int leg_a, int leg_b, double R_ohm);

/* A slip: flux linkages are kept, so currents jump, but for those of floating legs. */
void plant_turn_rotor(plant_t *plant, double angle_e_rad);

/* Once a period, before plant_run_period(): for a positive delay_s it moves the plant on to that instant. */
void plant_sample(plant_t *plant, plant_adc_t *adc);
void plant_set_pwm(plant_t *plant, const plant_pwm_t *pwm); /* takes effect after the coming period */
void plant_trip(plant_t *plant);                            /* all legs off, at once, until plant_set_pwm */
void plant_run_period(plant_t *plant);

/* For who follows a timer within the period, in order of time: moves the plant on to an instant of the
 * present period (no further than its end), then acts there. */
void plant_move(plant_t *plant, double after_s);
void plant_sample_at(plant_t *plant, double after_s, plant_adc_t *adc);
void plant_drive(plant_t *plant,
                 const bool driven[]); /* the legs change now, until the next PWM takes effect; */
void plant_drive_legs(plant_t *plant, const bool driven[],
                      const plant_leg_state_t state[]); /* and their state */

/* Comparators that trip like plant_trip() at their instant, found to 0.05 us; NULL: none. A period
 * costs a quarter more. */
void plant_set_break(plant_t *plant, const plant_break_t *comparators);
bool plant_broke(plant_t *plant, double *after_s); /* since asked last; counts from that period's start */
bool plant_break_held(const plant_t *plant);       /* a comparator sees too much now */

/* Comparator edges of the last period, oldest first; returns their number, at most `most` are written. */
int plant_captured(const plant_t *plant, plant_capture_t captured[], int most);

/* Without inverter: ideal sources hold the legs at the given voltages for that long, but terminals that are
 * off (PLANT_WIRE_OPEN), which float. `pmsim plant`. With rate_rad_s2 the imposed speed moves linearly. */
void plant_run_voltages(plant_t *plant, const double v_leg_V[], double rate_rad_s2, double duration_s);
void plant_truth(const plant_t *plant, plant_truth_t *truth);

/* The same without what costs most: voltages of terminals and neutrals and the link current are zero. */
void plant_truth_windings(const plant_t *plant, plant_truth_t *truth);

#ifdef __cplusplus
}
#endif

#endif
