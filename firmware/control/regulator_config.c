#include "firmware/control/regulator.h"
#include "firmware/math/image.h"
#include "firmware/params/maker.h"

uint32_t regulator_traits(regulator_id_t id)
{
    static const uint8_t traits_of[REGULATOR_COUNT] = {
#define PM_METHOD(name, help, traits, needs) (uint8_t)(traits),
#include "firmware/control/regulators.def"
#undef PM_METHOD
    };
    return traits_of[id];
}

void make_regulator(maker_t *m, regulator_config_t *c)
{
    c->id = (regulator_id_t)m->params->regulator;
    switch (c->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case REGULATOR_##name                                                                  \
                : require(m, needs, DRIVE_PARAM_regulator);                                                  \
                make_##name(m, &c->name); break;)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    case REGULATOR_COUNT:
    default: /* excluded by the range of the parameter */
        refuse(m, DRIVE_PARAM_regulator, "is not in this image");
        break;
    }
}

pm_num_t regulator_bandwidth(const maker_t *m)
{
    switch ((regulator_id_t)m->params->regulator) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case REGULATOR_##name : return name##_bandwidth(m);)
#include "firmware/control/regulators.def"
#undef PM_METHOD
    case REGULATOR_COUNT:
    default:
        return pm_num(0);
    }
}
