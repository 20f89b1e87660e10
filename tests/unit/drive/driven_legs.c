#include "tests/unit/drive/driven_legs.h"

#include "sim_plant/plant_state.h"

int driven_legs(const plant_t *plant)
{
    int count = 0;
    for (int leg = 0; leg < plant->gates.legs; ++leg) {
        count += plant->gates.leg[leg].driven ? 1 : 0;
    }
    return count;
}
