#include "observers/extended_emf.h"

void extended_emf_reset(extended_emf_t *self, const extended_emf_config_t *config, const obs_in_t *in)
{
    const emf_machine_t machine = emf_salient(config, in, PM_GAIN(1.0));
    emf_reset(self, config, &machine, in);
}

void extended_emf_slow(extended_emf_t *self, const extended_emf_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    const emf_machine_t machine = emf_salient(config, in, PM_GAIN(1.0));
    emf_slow(self, config, &machine, in, weight);
}
