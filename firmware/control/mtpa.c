#include "firmware/control/mtpa.h"

#include "firmware/math/root.h"

pm_q_t mtpa_i_d(const mtpa_config_t *config, pm_q_t i_q)
{
    return config->h == 0 ? 0 : config->h - pm_hypot(config->h, i_q);
}
