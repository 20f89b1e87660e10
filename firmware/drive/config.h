/* Per-unit configuration of the drive, made from the SI parameters in one place: config.c.
 *
 * Integer arithmetic with exponents (firmware/math/num.h), so host and target get the same bits. Not for the
 * control path. A value that does not fit its format refuses the parameter that made it. */
#ifndef DRIVE_CONFIG_H
#define DRIVE_CONFIG_H

#include "firmware/control/field_weakening.h"
#include "firmware/control/modulator.h"
#include "firmware/control/mtpa.h"
#include "firmware/control/regulator.h"
#include "firmware/control/speed_control.h"
#include "firmware/drive/block.h"
#include "firmware/drive/bridges.h"
#include "firmware/drive/fault_short.h"
#include "firmware/drive/neutral.h"
#include "firmware/drive/open_winding.h"
#include "firmware/drive/position.h"
#include "firmware/drive/procedures/flying_start.h"
#include "firmware/drive/procedures/saliency_map.h"
#include "firmware/drive/procedures/sequence.h"
#include "firmware/drive/procedures/torque_polarity.h"
#include "firmware/drive/procedures/zero_inductance.h"
#include "firmware/drive/rest.h"
#include "firmware/drive/two_sets.h"
#include "firmware/math/image.h"
#include "firmware/math/num.h"
#include "firmware/params/types.h"
#include "injection/boundary_detection.h"
#include "injection/dc_link_pulses.h"
#include "injection/dual_pulses.h"
#include "injection/pulses.h"
#include "injection/three_phase_hf.h"
#include "injection/zero_second.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t i_trip_squared; /* Q24 */
    int32_t v_bits;         /* from a code of the link's voltage to per unit */
    pm_q_t v_dc_min;
    int32_t v_dc_span; /* v_dc_max - v_dc_min */
    pm_q_t v_dc_max, v_dc_derate;
    pm_q_t i_sum;        /* largest believable sum of the phase currents */
    uint16_t offset_max; /* of a 16-bit code */
    uint16_t rest;       /* of a 16-bit code: by which a current that does not flow may seem to move */
    int16_t temp_derate_dC, temp_trip_dC;
    pm_q_t heat_max;        /* square of the current that is borne for good, with a margin of 5 % */
    pm_frac_t k_heat;       /* low-pass of the windings' heat, at 1 kHz */
    pm_q_t bridge_heat_max; /* the same of the bridge */
    pm_frac_t k_bridge_heat;
    pm_q_t judged;         /* square of the least current whose legs are looked at: open_phase.h */
    pm_q_t judged_carrier; /* the same while there is a carrier */
    pm_q_t omega_stall;    /* below: not turning */
    pm_q_t i_stall;        /* current of a rotor that should turn then */
    uint16_t stall_ms, lost_ms;
} protection_config_t;

/* Align and open-loop start, current mode. */
typedef struct {
    pm_q_t i; /* current amplitude */
    /* That the load may ask for, at most i_max:
     *   psi_m = 9/4 (L_q - L_d) i
     * With 2 in place of 9/4 half of the active flux of a rotor on the vector, psi_m - (L_q - L_d) i, would be left, and no
     * hand-over would take place. */
    pm_q_t i_most;
    pm_q_t i_slope;    /* per ms */
    pm_q_t slope;      /* of the speed, per ms */
    pm_frac_t k_swing; /* low-pass that knows swinging from steady turning, at 1 kHz */
    pm_q_t v_swing;    /* largest EMF of swinging that is damped */
    int32_t per_swing; /* speed against such an EMF; pm_small_gain */
    /* By which the vector yields in a millisecond, Q15. What it moves by shows as a swing g times as large, where L_q and L_d differ:
     *   g = per_swing 3/4 |L_q - L_d| i
     *   k = 1.5 / (1 + g), at most 1
     * whose answer to itself has a pole at -1/2 and is gone after some milliseconds. */
    uint16_t k_yield;
    uint16_t align_ms;
    pm_angle_t sweep; /* of the vector per ms while aligning: a quarter turn in half the time */
} open_loop_config_t;

typedef struct {
    protection_config_t protection;
    modulator_config_t modulator;
    drive_base_t base;
    regulator_config_t regulator;
    speed_control_config_t speed;
    mtpa_config_t mtpa;
    field_weakening_config_t field_weakening;
    position_config_t position;
#if PM_CARRIES(NEEDS_NEUTRAL)
    neutral_config_t neutral;
#endif
#if PM_CARRIES(NEEDS_BRIDGES)
    uint8_t winding; /* WINDING_... */
#endif
    PM_IN_IMAGE(open_winding, open_winding_config_t open_winding;)
    PM_IN_IMAGE(two_sets, two_sets_config_t two_sets;)
    pulses_config_t pulses;
    PM_IN_IMAGE(boundary_detection, boundary_detection_config_t boundary_detection;)
    PM_IN_IMAGE(dc_link_pulses, dc_link_pulses_config_t dc_link_pulses;)
    PM_IN_IMAGE(carrier_rest, rest_config_t rest;)
    PM_IN_IMAGE(flying_start, flying_start_config_t flying_start;)
    PM_IN_IMAGE(saliency_map, saliency_map_config_t saliency_map;)
    PM_IN_IMAGE(zero_inductance, zero_inductance_config_t zero_inductance;)
#if SEQUENCE_HAS_POLARITY
    polarity_config_t polarity;
    PM_IN_IMAGE(dual_pulses, dual_pulses_config_t dual_pulses;)
    PM_IN_IMAGE(torque_polarity, torque_polarity_config_t torque_polarity;)
    PM_IN_IMAGE(secondary_voltage, zero_second_config_t zero_second;)
    PM_IN_IMAGE(three_phase_hf, three_phase_hf_config_t three_phase_hf;)
#endif
    open_loop_config_t open_loop;
    fault_short_config_t fault_short;
    PM_IN_IMAGE(six_step, block_config_t block;)
    pm_num_t pole_pairs;
    pm_num_t per_mrad_s, per_uNm, per_mA; /* units of a command in per-unit */
    uint16_t slow_divider;                /* periods per drive_slow(): the nearest to 1 ms */
    uint16_t charge_periods;              /* of the upper switches' supply; 0: needs none */
    bool injection;                       /* injection leads at low speed; else open-loop start */
    uint8_t start;                        /* SEQUENCE_...: how the initial position is found ... */
    uint8_t find;                         /* PROCEDURE_...: ... by which of them ... */
#if SEQUENCE_HAS_POLARITY
    uint8_t pole; /* PROCEDURE_...: ... and what tells the pole afterwards, or none */
#endif
    int32_t k_theta; /* pm_omega_to_angle() */
    pm_q_t i_max;
    pm_q_t i_injection; /* of i_q while the carrier is on: what leaves saliency */
    pm_q_t i_d_light;
    pm_q_t omega_max;
    pm_unit_t v_share; /* share of v_dc that the voltage vector may reach */
    pm_machine_t machine;
} drive_config_t;

static inline uint8_t config_pole(const drive_config_t *config)
{
#if SEQUENCE_HAS_POLARITY
    return config->pole;
#else
    (void)config;
    return 0;
#endif
}

/* Of the start, where the configuration is made: which sequence and which procedures; what they are told. */
void choose_start(maker_t *m, drive_config_t *config, uint32_t channels);
void make_start(maker_t *m, drive_config_t *config);

/* Of the imposed vector; then i_most, and i no larger, when the machine is known. */
void make_open_loop(maker_t *m, open_loop_config_t *c);
void limit_imposed(drive_config_t *config);

/* share: of the bandwidth of current control, while injection leads; most: the largest current then. */
void make_protection(maker_t *m, protection_config_t *c, pm_unit_t share, pm_q_t most);

#if PM_CARRIES(NEEDS_BRIDGES)
/* Of two bridges, config_windings.c: which winding they feed; then the limits that it moves. */
void make_windings(maker_t *m, drive_config_t *config);
void limit_windings(maker_t *m, drive_config_t *config);
#endif

/* channels: what the board has, hal_channels(). */
drive_result_t drive_configure(drive_config_t *config, const drive_params_t *params, uint32_t channels);

#ifdef __cplusplus
}
#endif

#endif
