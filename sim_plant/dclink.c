#include "sim_plant/dclink.h"

void dclink_init(dclink_t *link, const plant_dclink_t *parameters)
{
    bool stiff = parameters->c_F == 0.0;
    *link = (dclink_t){
        .v_source_V = parameters->v_source_V,
        .g_source_S = stiff ? 0.0 : 1.0 / parameters->r_source_ohm,
        .inv_C_1_F = stiff ? 0.0 : 1.0 / parameters->c_F,
        .blocks = parameters->source_blocks,
    };
}
