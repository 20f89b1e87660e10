#include "sim_plant/dclink.h"

#include <math.h>

#define TWO_PI 6.28318530717958647693

void dclink_init(dclink_t *link, const plant_dclink_t *parameters)
{
    bool stiff = parameters->c_F == 0.0;
    bool chopper = !stiff && parameters->r_chopper_ohm > 0.0;
    bool ripple = !stiff && parameters->ripple_V != 0.0;
    *link = (dclink_t){
        .v_source_V = parameters->v_source_V,
        .g_source_S = stiff ? 0.0 : 1.0 / parameters->r_source_ohm,
        .inv_C_1_F = stiff ? 0.0 : 1.0 / parameters->c_F,
        .blocks = parameters->source_blocks,
        .connected = true,
        .plain = !ripple && !chopper,
        .ripple_V = ripple ? parameters->ripple_V : 0.0,
        .ripple_rad_s = TWO_PI * parameters->ripple_Hz,
        .g_chopper_S = chopper ? 1.0 / parameters->r_chopper_ohm : 0.0,
        .v_chopper_on_V = parameters->v_chopper_on_V,
        .v_chopper_off_V = parameters->v_chopper_off_V,
    };
}

double dclink_ripple_V(const dclink_t *link, double t_s)
{
    return link->ripple_V * sin(link->ripple_rad_s * t_s);
}

double dclink_excess(const dclink_t *link, double v_dc_V)
{
    if (link->g_chopper_S == 0.0) {
        return -1.0;
    }
    return link->chopping ? 1.0 - v_dc_V / link->v_chopper_off_V : v_dc_V / link->v_chopper_on_V - 1.0;
}

void dclink_settle(dclink_t *link, double v_dc_V)
{
    if (dclink_excess(link, v_dc_V) > 0.0) {
        link->chopping = !link->chopping;
    }
}
