/* What a plant is made of: machine, windings, load, inverter, DC link, sensors. SI units; peak values.
 *
 * Zero of every optional member is the plain case, so that = {0} and the required members make a linear
 * three-phase star machine on an ideal inverter. plant_create() checks all of it and says which member makes
 * no sense. METHODS.md 0.2 names the effects E1 to E19. */
#ifndef PLANT_CONFIG_H
#define PLANT_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#define PLANT_LEGS      6  /* most; a three-phase star uses the first three */
#define PLANT_SETS      2  /* most, of three phases each */
#define PLANT_HARMONICS 16 /* most, of one kind */

typedef struct {
    double R_s_ohm;
    double L_d0_H;   /* core constants of the energy form: i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f, */
    double L_q0_H;   /* i_q = psi_q/L_q0 + c psi_q |psi|^4, |psi|^2 = psi_d^2 + psi_q^2               */
    double c_A_Wb5;  /* saturation coefficient; 0: linear machine */
    double psi_m_Wb; /* open-circuit magnet flux, fundamental; i_f follows from it */
    int pole_pairs;
} plant_machine_t;

typedef struct {
    int order;        /* 0: unused; negative of a saliency only */
    double amplitude; /* unit of the list it stands in */
    double phase_rad;
} plant_harmonic_t;

typedef enum { PLANT_STAR, PLANT_OPEN } plant_connection_t;

/* Everything of the windings beyond a symmetrical three-phase star with sinusoidal flux. Phases are numbered
 * A, B, C and, of a second set 30 degrees further on, X, Y, Z. Inductances here add to those of the core. */
typedef struct {
    int sets;                      /* 0 or 1: one; 2: two, with separate neutrals (E16) */
    plant_connection_t connection; /* open: legs 0 to 2 feed one end of the phases, 3 to 5 the other (E17) */
    double M_d_H, M_q_H;           /* mutual inductance between the sets, E16 */
    double L_0_H;                  /* of the zero sequence; must be positive for an open winding */
    double dL_0_H, L_c0_H;         /* E3: L_s2 - M_s2 and its cross-coupling counterpart, */
    /* how they move with a star's own currents: dL_0 (1 + dL_0_d i_d + dL_0_q i_q^2) and L_c0 + L_c0_q i_q.
     * Where the currents take dL_0 through zero, the model ends. */
    double dL_0_d_1_A, dL_0_q_1_A2, L_c0_q_H_A;
    plant_harmonic_t emf[PLANT_HARMONICS]; /* E5: flux linkage of phase A, psi_n cos(n theta + phase), Wb */
    /* E3, x = n theta + phase, L in H; orders n = 2, 5, 8, 11 ... and -1, -4, -7, -10 ... (winding.h): */
    plant_harmonic_t saliency[PLANT_HARMONICS]; /* psi_ab = L [cos x, sin x; sin x, -cos x] i_ab */
    plant_harmonic_t
        zero_saliency[PLANT_HARMONICS]; /* psi_0 = L/2 (i_alpha cos x - i_beta sin x), reciprocal */
    plant_harmonic_t
        cogging[PLANT_HARMONICS];     /* E15: T sin(n theta + phase), Nm; order per electrical turn */
    double dR_ohm[PLANT_LEGS];        /* E4, per phase: added resistance, */
    double dL_H[PLANT_LEGS];          /* added self-inductance, */
    double dM_H[PLANT_SETS][3];       /* added mutual inductance AB, BC, CA, */
    double emf_gain[PLANT_LEGS];      /* relative error of the magnet's flux linkage, */
    double emf_shift_rad[PLANT_LEGS]; /* and its electrical angle */
    double L_eddy_d_H, L_eddy_q_H; /* E19: shorted circuit on each axis that takes the inductance from L at */
    double R_eddy_ohm;             /* low frequency to L || L_eddy at high, with loss between; 0: none */
    /* Resistor across each phase winding, for what damps its ringing with c_leg_F: with the other legs tied a
     * floating one has Q = 1.5 r_winding / sqrt(1.5 L / c_leg). Its current is in link and losses, not in the
     * currents that shunts and diodes see. 0: none */
    double r_winding_ohm;
    double alpha_R_1_K; /* E14: R = R_s (1 + alpha_R (T - 25 degC)), psi_m alike */
    double alpha_psi_1_K;
} plant_winding_t;

typedef struct {
    double J_kgm2;       /* of the rotor; of all that turns when there is no second mass */
    double B_Nms;        /* viscous */
    double T_coulomb_Nm; /* dry friction, with true sticking at standstill */
    bool locked;         /* rotor held */
    double J_load_kgm2;  /* 0: one mass. Else the load hangs on a shaft: */
    double k_shaft_Nm;   /* stiffness, Nm/rad */
    double d_shaft_Nms;  /* and damping of it */
    double load_Nms; /* load torque a w + b w |w| + plant_set_load(): fan and pump by b, hoist by the last */
    double load_Nms2;
    plant_harmonic_t load_angle[4]; /* compressor: T cos(n theta_mech + phase), Nm */
} plant_mech_t;

typedef struct {
    double f_pwm_Hz;
    double dead_time_s;
    double v_switch_V;            /* drop of a closed switch, against the current in either direction */
    double v_diode_V;             /* drop of a diode while both switches of its leg are open */
    double r_on_ohm;              /* in series with both */
    uint32_t timer_counts;        /* carrier counts in half a period: resolution of an edge */
    double turn_on_s, turn_off_s; /* delay of a switch behind its gate signal (E6) */
    double
        bootstrap_charge_s; /* time constant at which the lower switches charge the upper ones' supply; 0: ideal */
    double bootstrap_hold_s;  /* from full to the lock-out, without charging */
    double bootstrap_lockout; /* share of the full voltage below which an upper switch stays open */
    double c_leg_F;           /* output capacitance of a leg (E7); 0: voltage steps at once */
} plant_inverter_t;

typedef struct {
    double v_source_V;
    double r_source_ohm;
    double c_F;                 /* 0: stiff link */
    bool source_blocks;         /* rectifier-fed: no current back into the source */
    double ripple_V, ripple_Hz; /* sine on the source */
    double r_chopper_ohm;       /* 0: none */
    double v_chopper_on_V, v_chopper_off_V;
} plant_dclink_t;

typedef enum { PLANT_IN_LINE, PLANT_LOW_SIDE, PLANT_SINGLE_SHUNT } plant_shunt_t;

/* What the comparator of a terminal compares with: mean of the terminals of its set, half the DC-link
 * voltage, or the star point of its set, which an open winding does not have. */
typedef enum { PLANT_REFERENCE_MEAN, PLANT_REFERENCE_HALF_LINK, PLANT_REFERENCE_NEUTRAL } plant_reference_t;

typedef struct {
    int bits;              /* 0: ideal converter (no rounding, full-scale still clips) */
    double i_full_scale_A; /* codes span -fs ... +fs */
    double v_full_scale_V; /* DC-link channel spans 0 ... fs */
    double noise_lsb;      /* rms, at the converter */
    double gain_error[PLANT_LEGS];
    double offset_A[PLANT_LEGS];
    double delay_s; /* sample instant after the centre of the zero vector; may be negative */
    uint64_t seed;
    plant_shunt_t shunt;
    double settle_s;           /* a shunt's amplifier has settled this long after the last edge */
    double v_leg_full_scale_V; /* terminal and neutral channels; 0: the board has none */
    double divider_error[PLANT_LEGS + PLANT_SETS]; /* E12, relative: terminals, then neutrals */
    double filter_s;                               /* RC of those channels; 0: none */
    double hysteresis_V;                           /* E18: comparators of the terminals */
    double capture_s;                              /* resolution of the timer that captures their edges */
    plant_reference_t comparator_reference;
    double comparator_offset_V[PLANT_LEGS]; /* added to the difference, ahead of the divider */
    /* After each commanded edge of any leg nothing is captured for so long, less than a period; a comparator
     * that differs at the end has its edge there. 0: none */
    double comparator_blanking_s;
    double t_full_scale_degC;                   /* temperature channel spans -fs ... +fs; 0: 200 */
    double v_dc_offset_V;                       /* added to what the DC link's channel sees, */
    double v_offset_V[PLANT_LEGS + PLANT_SETS]; /* and behind the dividers of terminals and neutrals */
    double i_filter_s; /* in line: time constant of the currents' amplifiers; 0: none */
    /* Differential channel of each set, bipolar: the mean of the terminals, by a star of three resistors,
     * against the neutral (v_zero_V of plant_truth_t). */
    double v_zero_full_scale_V; /* codes span -fs ... +fs; 0: the board has none */
    bool v_zero_between;        /* two sets: that of the first is between the two star points, v_N1 - v_N2 */
    double v_zero_gain_error;   /* relative */
    double v_zero_offset_V;     /* behind the gain */
    double v_zero_network_ohm;  /* each resistor of the star, */
    double v_zero_load_ohm;     /* and what loads it: gain 1/(1 + network/(3 load)); 0: nothing */
    double v_zero_network_error[PLANT_LEGS]; /* relative, of each resistor */
    double v_zero_filter_s;                  /* RC; 0: none */
    double v_zero_noise_lsb;                 /* rms, of its own converter; */
    int v_zero_bits;                         /* 0: bits */
    /* Sensor of the DC-link current beside those of the legs (i_dc_A of plant_truth_t). */
    double i_dc_full_scale_A;              /* codes span -fs ... +fs; 0: the board has none */
    double i_dc_gain_error, i_dc_offset_A; /* relative; behind the gain */
    double i_dc_filter_s;                  /* RC; 0: none */
} plant_sensor_t;

typedef struct map_table map_table_t; /* map_table.h */

typedef struct {
    plant_machine_t machine;
    plant_winding_t winding;
    const map_table_t *map; /* NULL: energy form. Else it replaces L_d0, L_q0, c and psi_m; not owned */
    plant_mech_t mech;
    plant_inverter_t inverter;
    plant_dclink_t dclink;
    plant_sensor_t sensor;
    double tolerance; /* relative local error of the integrator; 0: 1e-6 */
} plant_config_t;

#endif
