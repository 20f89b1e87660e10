#include "firmware/params/maker.h"
#include "injection/boundary_detection.h"

void make_boundary_detection(maker_t *m, boundary_detection_config_t *c)
{
    c->threshold = fixed(m, si(m, DRIVE_PARAM_boundary_threshold), Q_BITS, DRIVE_PARAM_boundary_threshold);
    c->interpolated = c->threshold == 0;
}
