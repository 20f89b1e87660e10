#include "step_length.h"

#include "sim_plant/plant_state.h"

double step_length_s(const plant_t *plant)
{
    return plant->circuit.step_s;
}
