#include "firmware/math/image.h"
#include "firmware/params/maker.h"
#include "observers/observer.h"

uint32_t observer_traits(observer_id_t id)
{
    static const uint8_t traits_of[OBSERVER_COUNT] = {
#define PM_METHOD(name, help, traits, needs) (uint8_t)(traits),
#include "observers/observers.def"
#undef PM_METHOD
    };
    return traits_of[id];
}

void make_observer(maker_t *m, observer_config_t *c)
{
    c->id = (observer_id_t)m->params->observer;
    switch (c->id) {
#define PM_METHOD(name, help, traits, needs)                                                                 \
    PM_IN_IMAGE(name, case OBSERVER_##name                                                                   \
                : require(m, needs, DRIVE_PARAM_observer);                                                   \
                make_##name(m, &c->name); break;)
#include "observers/observers.def"
#undef PM_METHOD
    case OBSERVER_COUNT:
    default: /* excluded by the range of the parameter */
        refuse(m, DRIVE_PARAM_observer, "is not in this image");
        break;
    }
}
