#include "observers/back_emf.h"

static emf_machine_t round_machine(const back_emf_config_t *config, const obs_in_t *in)
{
    return (emf_machine_t){.L = observer_L_q(&config->model, in->i_dq), .saliency = 0, .lag = PM_GAIN(1.0)};
}

void back_emf_reset(back_emf_t *self, const back_emf_config_t *config, const obs_in_t *in)
{
    const emf_machine_t machine = round_machine(config, in);
    emf_reset(self, config, &machine, in);
}

void back_emf_slow(back_emf_t *self, const back_emf_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    const emf_machine_t machine = round_machine(config, in);
    emf_slow(self, config, &machine, in, weight);
}
