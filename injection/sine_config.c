#include "firmware/params/maker.h"
#include "injection/sine.h"

#define CARRIER_LEAST 8

/* N: the nearest whole number of periods. */
static int32_t periods(const maker_t *m)
{
    int32_t n = 0;
    (void)pm_num_to_fixed(pm_num_div(si(m, DRIVE_PARAM_f_pwm), si(m, DRIVE_PARAM_f_injection)), 0, &n);
    return n;
}

pm_num_t sine_omega(const maker_t *m)
{
    return pm_num_div(PM_NUM_TWO_PI, pm_num_mul(pm_num(periods(m)), m->base.t_s));
}

/* The voltage is a staircase, which makes the flux at the samples larger than V_h / omega_h by x / sin x,
 * x = pi / N; within 1e-5 of its series for N >= 8. */
pm_num_t sine_flux(const maker_t *m)
{
    const pm_num_t x = pm_num_div(PM_NUM_TWO_PI, pm_num(2 * periods(m)));
    const pm_num_t x2 = square(x);
    const pm_num_t more =
        pm_num_mul(x2, pm_num_add(pm_num_ratio(1, 6), pm_num_mul(x2, pm_num_ratio(7, 360))));
    return pm_num_mul(pm_num_div(si(m, DRIVE_PARAM_v_injection), sine_omega(m)), pm_num_add(pm_num(1), more));
}

/* From the position to the error signal: half a window and 1.5 periods. */
static pm_num_t delay(const maker_t *m)
{
    return pm_num_mul(pm_num_ratio(periods(m) + 2, 2), m->base.t_s);
}

static pm_num_t bandwidth(const maker_t *m, pm_num_t phase)
{
    return pm_num_div(phase, pm_num_mul(PM_NUM_TWO_PI, delay(m)));
}

/* Hz; w_s of sine.h. */
static pm_num_t low_pass(const maker_t *m)
{
    const pm_num_t of_carrier = pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num(8 * periods(m)));
    const pm_num_t of_loop = pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_injection_bandwidth));
    return pm_num_cmp(of_carrier, of_loop) > 0 ? of_carrier : of_loop;
}

injection_limits_t sine_limits(const maker_t *m)
{
    return (injection_limits_t){.low_pass = low_pass(m),
                                .pll_max = bandwidth(m, pm_num_ratio(2, 10)),
                                .current_max = bandwidth(m, pm_num_ratio(4, 10))};
}

pm_num_t sine_answer(const maker_t *m, pm_num_t amplitude)
{
    return pm_num_mul(amplitude, pm_num_sqrt(pm_num_ratio(periods(m), 2)));
}

/* injection_delay at omega_h, an angle. */
static int32_t delayed(maker_t *m)
{
    const pm_num_t turns =
        pm_num_mul(si(m, DRIVE_PARAM_injection_delay), pm_num_div(sine_omega(m), PM_NUM_TWO_PI));
    return fixed(m, turns, 32, DRIVE_PARAM_injection_delay);
}

void make_sine(maker_t *m, sine_config_t *c)
{
    const int32_t n = periods(m);
    if (n < CARRIER_LEAST || n > WINDOW_MOST) {
        refuse(m, DRIVE_PARAM_f_injection, "must lie between a fortieth and an eighth of f_pwm");
        return;
    }
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->n = (uint16_t)n;
    c->per_n = fixed(m, pm_num_ratio(1, n), FRAC_BITS, DRIVE_PARAM_f_injection);
    c->step = UINT32_MAX / (uint32_t)n;
    c->ahead = 3U * (c->step / 2U);
    c->lag = c->ahead + PM_TURN(0.25) + (pm_angle_t)delayed(m);
}
