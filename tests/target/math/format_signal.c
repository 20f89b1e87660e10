#include "firmware/math/trig.h"
#include "tests/target/math/formats.h"

#define FLUX    0.8
#define CURRENT 0.7

/* Without libm, which would be most of the target image. */
static double steps_of(double x, double step)
{
    return (double)(int32_t)(x / step + (x < 0 ? -0.5 : 0.5)) * step;
}

static double adc(double x)
{
    return steps_of(x, 0x1p-9);
}

format_in_t format_signal_next(format_signal_t *state, double omega_pu)
{
    const double turn = FORMAT_K_FLUX / 6.28318530717958648 * omega_pu;
    const pm_dir_t before = pm_dir(state->theta);
    state->theta += (uint32_t)(int32_t)(turn * 0x1p32);
    const pm_dir_t now = pm_dir(state->theta);
    const pm_dir_t current = pm_dir(state->theta + PM_TURN(0.29)); /* mostly on q, some on -d */

    const double i_alpha = CURRENT * current.cos * 0x1p-31, i_beta = CURRENT * current.sin * 0x1p-31;
    const double e_alpha = (now.cos - (double)before.cos) * (FLUX * 0x1p-31 / FORMAT_K_FLUX);
    const double e_beta = (now.sin - (double)before.sin) * (FLUX * 0x1p-31 / FORMAT_K_FLUX);
    return (format_in_t){
        .i_a = adc(i_alpha),
        .i_b = adc(-0.5 * i_alpha + 0.866025403784438647 * i_beta),
        .i_c = adc(-0.5 * i_alpha - 0.866025403784438647 * i_beta),
        .v_alpha = steps_of(e_alpha + FORMAT_R * i_alpha, 0x1p-13),
        .v_beta = steps_of(e_beta + FORMAT_R * i_beta, 0x1p-13),
        .d_ref = steps_of(CURRENT * -0.248689887164854788, 0x1p-13),
        .q_ref = steps_of(CURRENT * 0.968583161128631119, 0x1p-13),
        .theta = state->theta,
    };
}
