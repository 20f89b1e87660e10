#include "sim_plant/sensor.h"

#include <math.h>

#define CODE_BITS 16

void noise_seed(noise_t *noise, uint64_t seed)
{
    *noise = (noise_t){.state = seed};
}

/* splitmix64 */
static double uniform(noise_t *noise)
{
    uint64_t z = noise->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-53;
}

/* Marsaglia's polar method */
double noise_gaussian(noise_t *noise)
{
    if (noise->has_spare) {
        noise->has_spare = false;
        return noise->spare;
    }
    double x, y, r2;
    do {
        x = 2.0 * uniform(noise) - 1.0;
        y = 2.0 * uniform(noise) - 1.0;
        r2 = x * x + y * y;
    } while (r2 >= 1.0 || r2 == 0.0);
    double scale = sqrt(-2.0 * log(r2) / r2);
    noise->spare = y * scale;
    noise->has_spare = true;
    return x * scale;
}

/* lsb: the value in converter steps above code zero */
static uint16_t convert(const plant_sensor_t *sensor, noise_t *noise, int bits, double lsb)
{
    double top = ldexp(1.0, bits) - 1.0;
    if (sensor->bits > 0 && sensor->noise_lsb > 0.0) {
        lsb += sensor->noise_lsb * noise_gaussian(noise);
    }
    double code = fmin(fmax(round(lsb), 0.0), top);
    return (uint16_t)((unsigned)code << (CODE_BITS - bits));
}

uint16_t sensor_current(const plant_sensor_t *sensor, noise_t *noise, int leg, double i_A)
{
    int bits = sensor->bits > 0 ? sensor->bits : CODE_BITS;
    double seen_A = (1.0 + sensor->gain_error[leg]) * i_A + sensor->offset_A[leg];
    return convert(sensor, noise, bits, ldexp(seen_A / sensor->i_full_scale_A + 1.0, bits - 1));
}

uint16_t sensor_voltage(const plant_sensor_t *sensor, noise_t *noise, double v_V)
{
    int bits = sensor->bits > 0 ? sensor->bits : CODE_BITS;
    return convert(sensor, noise, bits, ldexp(v_V / sensor->v_full_scale_V, bits));
}
