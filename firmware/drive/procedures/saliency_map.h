/* The saliency map of the machine, measured by the drive with the rotor locked (METHODS.md 5.3.1, row 52), and the
 * saliency circle of each of its points (5.3.2, row 53).
 *
 * A current is held at each point of a grid of I, the current of the command (rated by default),
 *   i_d = -1/2, -1/4, 0, 1/4, 1/2 of I        i_q = 0, 1/4, 1/2, 3/4, 1 of I
 * while a carrier V_h cos phi of f_pwm / 20 turns its axis through a whole turn (injection/saliency_circle.h), and the
 * circle of its answers gives L_dh, L_qh, L_dqh. The rotor may be locked anywhere: a circle without current shows its axis,
 * and the difference of L_dh at either i_d which pole it is, as saturation makes L_dh smaller with the magnet, or the other
 * way round where `L_d_falls` says so. A last circle without current shows whether it is still there.
 *
 * Results: the map; I_p, I_n, theta_m of the circle without current; and the table that the sources compensate by
 * (injection/saliency.h), at i_q = 0, I / 2 and I with the i_d that the drive would have there: L_d and L_q, L_dqh / L_qh, and
 * L_dh, L_qh, L_dqh. They become parameters as those of the identification do.
 *
 * Control of the current: 30 Hz on its mean over a period of the carrier, at 1 kHz. A point takes 0.5 s, the
 * whole 14 s. Each period 120 instructions. The bridge is driven without dead-time compensation (commissioning.h).
 * PM_FAILED_NO_CURRENT: a current does not come, or the carrier has no answer; PM_FAILED_SALIENCY: I_n below 1/64
 * of I_p, no axis; PM_FAILED_IMPLAUSIBLE: inductances that no machine has; PM_FAILED_TURNED: the rotor was not locked.
 * Tests: tests/unit/drive/saliency_map_test.cpp, tests/scenario/saliency_map.yaml. */
#ifndef DRIVE_PROCEDURES_SALIENCY_MAP_H
#define DRIVE_PROCEDURES_SALIENCY_MAP_H

#include "firmware/drive/commissioning/commissioning.h"
#include "firmware/params/types.h"
#include "injection/saliency_circle.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SALIENCY_MAP_SIDE   5
#define SALIENCY_MAP_POINTS (SALIENCY_MAP_SIDE * SALIENCY_MAP_SIDE)

typedef struct {
    sine_config_t sine;
    pm_q_t flux;      /* F, psi */
    pm_q_t omega;     /* of the control of the current */
    pm_angle_t turn;  /* of the axis, per period */
    pm_angle_t since; /* what it has turned since the middle of what the window shows */
    bool best;        /* the drive follows the most torque per ampere; else i_d = 0 */
    bool reversed;    /* L_dh grows with a current along the magnet */
} saliency_map_config_t;

/* Of the last map, per-unit; 0: not measured. */
typedef struct {
    saliency_point_t point[SALIENCY_MAP_SIDE][SALIENCY_MAP_SIDE]; /* [i_q][i_d] */
    saliency_point_t half, rated;                                 /* at I / 2 and I, with the drive's i_d */
    pm_q_t i;                                                     /* I */
    pm_q_t centre, radius;                                        /* I_p, I_n without current */
} saliency_map_result_t;

typedef struct {
    sine_t sine;
    saliency_circle_t circle;
    int32_t rest[3]; /* of the timer's counts, 128ths */
    commissioning_hold_t hold;
    pm_angle_t theta; /* d-axis of the rotor, less half a turn or not */
    pm_angle_t axis;  /* eta */
    uint16_t ms;      /* at this point */
    uint16_t axes;    /* of the circle that are in it */
    uint8_t at;       /* 0: axis, then the points, then the axis again */
} saliency_map_t;

void make_saliency_map(maker_t *m, saliency_map_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
