/* Voltage pulses on a rotor at rest, and what the currents that they leave say of its position (METHODS.md
 * 9.2 to 9.4.2): what the methods that find the initial position by pulses share.
 *
 * A pulse along the axis g_x of a leg, + (this leg high against the two others) or - (low against them), is n
 * periods at a duty cycle from zero current; then, after a period of the zero vector, all switches are off and the
 * diodes drive the current back to zero. i is measured at the pulse's end in all three legs.
 *
 * Two values or one of each axis stand in e, row x: of + minus -, or of + alone.
 *   y = sum_x e_x e^{j g_x}
 * is the saliency, whose angle is 2 theta. With the sum of what each leg shows of its own pulses, whatever the link's voltage and
 * the length were,
 *   s = |y| / sum_x e_xx = (L_q - L_d) / (L_q + L_d)
 * of the flux that the pulse makes. What is below half of what L_d and L_q of the parameters make of it, or below five times its
 * noise, is no saliency: injection, whose gain follows it, would be too slow for what it was told.
 *
 * Relative gains of the sensors from the sums of the currents. With gains 1 + g_k what is measured does not
 * sum to zero, though the currents do:
 *   sum_k g_k e_xk = sum_k e_xk        three equations; their common part is not seen: sum_k g_k = 0
 * Solved by iteration, a step each millisecond; e_xk (1 - g_k) then stands for e_xk. Left alone, 1 % errs by 3.5 degrees where the
 * saliency is a tenth. The gains' noise makes that of y sqrt 2 to 1.5 times as large.
 *
 * The polarity is a difference of + and -, of a tenth of the pulse or a third, and a bridge makes one too: in + one
 * leg switches and in - two, whose currents lose unlike voltages where a saliency makes them unlike, and the legs'
 * capacitance rings with the winding until the next pulse:
 *   i_bridge = 4/3 n T_dt v_dc / L_d + 2 v_dc sqrt(C_leg / L_d)
 * Of 360 starts of machines that do not saturate, saliency 1.1 to 4, up to 1.1 n T_dt v_dc / L_d was seen. A polarity that
 * is not sure beyond it is not found. It is that of a magnet which saturates the core; where bridges that it holds
 * saturated make L_d fall with demagnetising current, it is the other one (polarity.h: L_d_falls).
 *
 * A one-shot procedure that owns the bridge; the step costs at most 130 instructions. What follows from the
 * train is found outside the control interrupt.
 * Tests: tests/unit/injection/initial_pulses_test.cpp, four_pulses_test.cpp. */
#ifndef INJECTION_PULSES_H
#define INJECTION_PULSES_H

#include "firmware/math/frames.h"
#include "firmware/math/procedure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PULSES_AXES      3
#define PULSES_BALANCING 4                  /* steps for the gains */
#define PULSES_STEPS     PM_Q(8.0 / 4096.0) /* 4 of 12 bits: with five times the noise, no current */

typedef struct {
    uint16_t periods; /* length of a pulse */
    uint16_t timeout; /* periods that the decay may take */
    pm_q_t duty;      /* of the driven leg, 0 ... 1 */
    pm_q_t i_zero;    /* of a current that has ended: noise, and what rings */
    pm_q_t s_min;     /* least saliency: half of what the machine's data say */
    pm_q_t i_noise;   /* of one current */
    pm_q_t i_bridge;  /* what the bridge may add to the currents that show the polarity */
    bool reversed;    /* polarity.h: L_d_falls */
} pulses_config_t;

typedef struct {
    pm_angle_t theta;
    pm_sigma_t margin; /* the smaller of saliency and polarity, at most 2560 */
} pulses_found_t;

typedef struct {
    pm_q_t e[PULSES_AXES][PULSES_AXES]; /* axis, leg */
    pm_abc_t i;                         /* at the end of the pulse */
    pm_q_t g[PULSES_AXES];              /* of the sensors */
    uint16_t timer, quiet;
    uint16_t pulse; /* how many are done */
    uint16_t steps; /* of what is computed from them */
    bool decaying;
    pulses_found_t found;
} pulses_t;

/* What the legs do in the coming period. */
typedef struct {
    pm_q_t duty[PULSES_AXES];
    bool driven;
} pulses_out_t;

static inline pm_q_t pulses_leg(const pm_abc_t *i, uint32_t leg)
{
    return leg == 0U ? i->a : (leg == 1U ? i->b : i->c);
}

extern const pm_angle_t pulses_axis[PULSES_AXES];

/* A period of the pulse along `axis`. */
static inline void pulses_apply(pulses_out_t *out, uint32_t axis, bool reverse, pm_q_t duty)
{
    for (uint32_t k = 0; k < PULSES_AXES; k++) {
        out->duty[k] = ((k == axis) != reverse) ? duty : 0;
    }
    out->driven = true;
}

/* One period of the pulse along `axis`. PM_DONE: it is over, self->i are its currents and the next step begins
 * another; PM_FAILED_OPEN: no current has come; PM_FAILED_TIMEOUT: it did not fall in time. */
pm_procedure_t pulses_step(pulses_t *self, const pulses_config_t *config, uint32_t axis, bool reverse,
                           pm_abc_t i, pulses_out_t *out);

void pulses_add(pulses_t *self, uint32_t axis, bool reverse); /* self->i to e */

/* The first steps of finding: PM_RUNNING while the gains are sought, 350 instructions each, so that the 1 kHz
 * interrupt ends within a period of control at 40 kHz; PM_DONE from then on. With the last, e becomes that of
 * sensors with equal gains. PM_FAILED_UNEVEN: an eighth and more are no gains, but a sensor or a winding that is
 * not what it should be. */
pm_procedure_t pulses_balance(pulses_t *self);
pm_ab_t pulses_saliency(const pulses_t *self);

/* Of a length with a noise. */
pm_sigma_t pulses_margin(pm_q_t length, pm_q_t noise);

/* sum_x e_xx */
pm_q_t pulses_sum(const pulses_t *self);

/* PM_DONE: |y| is s_min of `sum` and sure, `margin` is that of the saliency; PM_FAILED_SALIENCY */
pm_procedure_t pulses_salient(pm_q_t length, pm_q_t sum, pm_q_t s_min, pm_sigma_t margin);

/* The same of what shows the polarity, beyond what the bridge may add to it. Both are sure from PULSES_SURE on. */
#define PULSES_SURE (5 * PM_SIGMA_ONE)
pm_sigma_t pulses_polarity(pm_q_t along, pm_q_t bridge, pm_q_t noise);

typedef struct {
    pm_q_t bridge; /* what the bridge may add to w */
    pm_q_t noise;  /* of a component of w */
    bool reversed; /* polarity.h: L_d_falls */
} pulses_pole_t;

/* w points to the end of the axis found->theta that saturates: PM_DONE, theta is that of the magnet and the margin the
 * smaller of both; or PM_FAILED_POLARITY. What lies across the axis is none of its poles', and counts against them:
 *   margin = (|w . e^{j theta}| - |w x e^{j theta}| - bridge) / noise */
pm_procedure_t pulses_pole(pm_ab_t w, const pulses_pole_t *limits, pulses_found_t *found);

void make_pulses(maker_t *m, pulses_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
