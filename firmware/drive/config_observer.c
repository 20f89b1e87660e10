/* Configuration of the fundamental-model observers. */
#include "firmware/drive/config_maker.h"

static void make_model(maker_t *m, observer_model_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t change = pm_num_sub(si(m, DRIVE_PARAM_L_q_rated), si(m, DRIVE_PARAM_L_q));
    c->R = per_unit(m, DRIVE_PARAM_R_s, m->impedance);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    /* observers hold it in Q29 */
    (void)fixed(m, pm_num_div(si(m, DRIVE_PARAM_L_q), m->inductance), Q_BITS + 1, DRIVE_PARAM_L_q);
    c->L_q2 = 0;
    if (m->params->saturation_comp != 0) {
        c->L_q2 = fixed(m, pm_num_div(pm_num_div(change, m->inductance), square(i_rated)), Q_BITS,
                        DRIVE_PARAM_L_q_rated);
    }
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
    c->t_s = fixed(m, step, FRAC_BITS, DRIVE_PARAM_f_pwm);
}

/* What is not known is tied to the position with so many rad/s while injection leads. */
#define TIE pm_num(300)

/* R follows in 8 ms at rated current. seen: what the observer shows of one unit of lacking voltage. */
static void make_resistance(maker_t *m, const observer_model_t *model, pm_num_t seen,
                            observer_resistance_t *c)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    c->k = 0;
    if (m->params->resistance_adaptation != 0) {
        const pm_num_t follow = pm_num_ratio(1, 8);
        const pm_num_t k = pm_num_div(follow, pm_num_mul(seen, square(i_rated)));
        c->k = fixed(m, k, GAIN_BITS, DRIVE_PARAM_i_rated);
    }
    c->omega = speed(m, DRIVE_PARAM_speed_low) / 2;
    c->min = model->R / 2;
    c->max = model->R < PM_Q(4.0) ? model->R * 2 : PM_Q(7.9);
}

static void make_active_flux(maker_t *m, active_flux_config_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    make_model(m, &c->model);
    make_resistance(m, &c->model, pm_num_div(m->base.omega, TIE), &c->resistance);
    c->g = fixed(m, pm_num_mul(si(m, DRIVE_PARAM_flux_gain), step), FRAC_BITS, DRIVE_PARAM_flux_gain);
    c->k_adapt = PM_FRAC(0.01);
    c->k_seed = fixed(m, pm_num_mul(TIE, m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
}

/* The adapted quantity at 50 Hz, twice the loop; nothing is claimed below a quarter of the speed at which the
 * observer comes in. The speed in the reactive term lags by twice what stability needs at rated
 * current, and by 0.2 rad at least. */
static void make_mras(maker_t *m, mras_config_t *c)
{
    make_model(m, &c->model);
    make_resistance(m, &c->model, pm_num(1), &c->resistance);
    const pm_num_t L = pm_num_div(si(m, DRIVE_PARAM_L_d), m->inductance);
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    (void)fixed(m, pm_num_div(L, step), 24, DRIVE_PARAM_L_d);
    (void)fixed(m, pm_num_div(step, L), 30, DRIVE_PARAM_L_d);
    c->k = fixed(m, mul3(PM_NUM_TWO_PI, pm_num(50), m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
    c->emf_min = pm_max(1, pm_mul(speed(m, DRIVE_PARAM_speed_low) / 4, c->model.psi_m));
    const pm_num_t saliency = pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    const pm_num_t needed =
        pm_num_div(pm_num_mul(saliency, si(m, DRIVE_PARAM_i_rated)), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t lag = pm_num_add(pm_num_mul(pm_num(2), needed), pm_num_ratio(1, 5));
    const pm_num_t turn = pm_num_div(pm_num_mul(m->base.omega, m->t_slow), lag);
    c->turn = fixed(m, least(turn, pm_num_ratio(49, 100)), FRAC_BITS, DRIVE_PARAM_f_pwm);
}

static void make_mras_current(maker_t *m, mras_current_config_t *c)
{
    make_mras(m, c);
}

static void make_mras_voltage(maker_t *m, mras_voltage_config_t *c)
{
    make_mras(m, c);
}

static void make_mras_simple(maker_t *m, mras_simple_config_t *c)
{
    make_mras(m, c);
}

void make_observer(maker_t *m, observer_config_t *c)
{
    c->id = OBSERVER_active_flux;
    switch (c->id) {
#define PM_OBSERVER(name, help)                                                                              \
    case OBSERVER_##name:                                                                                    \
        make_##name(m, &c->name);                                                                            \
        break;
#include "observers/observers.def"
#undef PM_OBSERVER
    case OBSERVER_COUNT:
    default:
        break;
    }
}
