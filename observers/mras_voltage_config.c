#include "observers/mras_voltage.h"

void make_mras_voltage(maker_t *m, mras_voltage_config_t *c)
{
    make_mras(m, c);
}
