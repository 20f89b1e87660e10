/* What the makers of the observers share; for *_config.c. */
#ifndef OBSERVERS_MODEL_CONFIG_H
#define OBSERVERS_MODEL_CONFIG_H

#include "firmware/params/maker.h"
#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rate at which the state is tied to the position while injection leads, rad/s. */
#define OBSERVER_TIE pm_num(300)

void make_model(maker_t *m, observer_model_t *c);

/* k: per slow step; none when the parameters say that R stays. */
void make_resistance(maker_t *m, observer_resistance_t *c, pm_num_t k);

/* Refuses a machine whose L_q is more than an eighth above L_d. */
void round_only(maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
