/* Every observer of the list with a phase-locked loop, for count.py: one call of period_<name>() is the
 * observer's step, the loop's correction and its prediction, with their call, loads and stores. The rotor
 * turns at a third of the base speed with the voltage and current of a machine under load, so nothing is
 * zero; 1 kHz runs outside. Prints the bits of the last result and the sizes. */
#include <stdio.h>

#include "firmware/drive/config.h"
#include "firmware/math/pll.h"
#include "firmware/math/trig.h"
#include "firmware/params/parameters.h"

typedef struct {
    pm_pll_t pll;
    observer_t observer;
    obs_in_t in;
} bench_t;

static drive_config_t config;
static bench_t bench;

#define PM_METHOD(name, help, traits, needs)                                                                 \
    void period_##name(bench_t *b, const position_config_t *c);                                              \
    __attribute__((noinline, noclone)) void period_##name(bench_t *b, const position_config_t *c)            \
    {                                                                                                        \
        obs_out_t out;                                                                                       \
        name##_step(&b->observer.name, &c->observer.name, &b->in, &out);                                     \
        pm_pll_correct(&b->pll, &c->pll_high, out.eps);                                                      \
        pm_pll_predict(&b->pll, &c->pll_high);                                                               \
    }
#include "observers/observers.def"
#undef PM_METHOD

static uint16_t code(pm_q_t i)
{
    return (uint16_t)(32768 + i / (PM_ONE / 32768));
}

static void period(observer_id_t id, pm_ab_t v, pm_ab_t i)
{
    const pm_q_t v_dc = PM_Q(0.667);
    const pm_abc_t phase = pm_clarke_inverse(i);
    const pm_measure_t codes = {.sampled = 1, .i_sample = {{code(phase.a), code(phase.b), code(phase.c)}}};
    const obs_more_t more = {
        .codes = &codes, .v_dc = &v_dc, .v_zero = PM_Q(0.003), .v_zero_second = PM_Q(0.002)};
    const pm_dir_t dir = pm_dir(bench.pll.theta);
    bench.in = (obs_in_t){
        .v = v, .i = i, .dir = dir, .omega = bench.pll.omega, .i_dq = pm_park(i, dir), .more = &more};
    switch (id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    case OBSERVER_##name:                                                                                    \
        period_##name(&bench, &config.position);                                                             \
        break;
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default:
        break;
    }
}

static bool configure(observer_id_t id)
{
    drive_params_t params;
    drive_params_default(&params);
    params.observer = (int32_t)id;
    params.psi_3 = 7080000;
    if (id == OBSERVER_third_pair || id == OBSERVER_third_pair_flux) { /* two sets of windings */
        params.winding = (int32_t)WINDING_TWO_SETS;
        params.start_method = 2;
    }
    if (id == OBSERVER_zero_vector) { /* sees its EMF at higher speeds only */
        params.speed_high = params.speed_trip / 5 * 2;
        params.speed_max = params.speed_trip / 2;
    }
    if (!drive_configure(&config, &params, PM_CHANNELS).ok) { /* for a round machine */
        params.L_q = params.L_d;
        params.L_q_rated = params.L_d;
        params.L_qh_rated = params.L_dh_rated;
        params.start_method = 2;
    }
    return drive_configure(&config, &params, PM_CHANNELS).ok;
}

static void run(observer_id_t id)
{
    const int32_t turn = pm_omega_to_angle(PM_Q(0.33), config.position.pll_high.k_theta);
    pm_angle_t theta = 0;
    bench = (bench_t){.pll.theta = (pm_angle_t)turn, .pll.omega = PM_Q(0.33)};
    bench.in = (obs_in_t){.dir = pm_dir(0), .omega = PM_Q(0.33)};
    observer_reset(&bench.observer, &config.position.observer, &bench.in);
    for (int k = 0; k < 1000; k++) {
        theta += (pm_angle_t)turn;
        const pm_ab_t i = pm_park_inverse((pm_dq_t){.d = PM_Q(-0.1), .q = PM_Q(0.3)}, pm_dir(theta));
        const pm_dir_t middle = pm_dir(theta - (pm_angle_t)pm_half(turn));
        const pm_ab_t v = pm_park_inverse((pm_dq_t){.d = PM_Q(-0.09), .q = PM_Q(0.12)}, middle);
        period(id, v, i);
        if (k % 10 == 9) {
            const obs_out_t out = observer_last(&bench.observer, &config.position.observer);
            observer_slow(&bench.observer, &config.position.observer, &bench.in, &out, PM_ONE);
        }
    }
}

int main(void)
{
    static const struct {
        const char *name;
        uint32_t state, config;
    } list[] = {
#define PM_METHOD(name, help, traits, needs) {#name, sizeof(name##_t), sizeof(name##_config_t)},
#include "observers/observers.def"
#undef PM_METHOD
    };
    for (int id = 0; id < (int)OBSERVER_COUNT; id++) {
        if (!configure((observer_id_t)id)) {
            printf("observers_cost: no configuration for %s\n", list[id].name);
            return 1;
        }
        run((observer_id_t)id);
        const obs_out_t out = observer_last(&bench.observer, &config.position.observer);
        printf("%s %08lx %08lx %08lx state %lu config %lu\n", list[id].name, (unsigned long)bench.pll.theta,
               (unsigned long)bench.pll.omega, (unsigned long)out.eps, (unsigned long)list[id].state,
               (unsigned long)list[id].config);
    }
    return 0;
}
