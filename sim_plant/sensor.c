#include "sim_plant/sensor.h"

#include <assert.h>
#include <math.h>

#define CODE_BITS         16
#define MID_SCALE         0x8000u
#define SETTLE_CONSTANTS  5.0 /* time constants of a shunt's amplifier in settle_s */
#define T_FULL_SCALE_DEGC 200.0

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

static int resolution(const plant_sensor_t *sensor)
{
    return sensor->bits > 0 ? sensor->bits : CODE_BITS;
}

static double draw_lsb(const plant_sensor_t *sensor, noise_t *noise)
{
    return sensor->bits > 0 && sensor->noise_lsb > 0.0 ? sensor->noise_lsb * noise_gaussian(noise) : 0.0;
}

/* round() of what is positive and small, without its call */
static unsigned nearest(double x)
{
    unsigned below = (unsigned)x;
    return x - below >= 0.5 ? below + 1u : below;
}

/* lsb: the value in converter steps above code zero */
static uint16_t code(int bits, double lsb)
{
    unsigned top = (1u << bits) - 1u;
    unsigned steps = lsb >= top ? top : lsb > 0.0 ? nearest(lsb) : 0u;
    return (uint16_t)(steps << (CODE_BITS - bits));
}

static uint16_t bipolar(int bits, double share, double noise_lsb)
{
    return code(bits, (share + 1.0) * (1u << (bits - 1)) + noise_lsb);
}

static uint16_t unipolar(int bits, double share, double noise_lsb)
{
    return code(bits, share * (1u << bits) + noise_lsb);
}

static uint16_t current(const plant_sensor_t *sensor, noise_t *noise, int leg, double i_A)
{
    double seen_A = (1.0 + sensor->gain_error[leg]) * i_A + sensor->offset_A[leg];
    return bipolar(resolution(sensor), seen_A / sensor->i_full_scale_A, draw_lsb(sensor, noise));
}

/* Output of a shunt's amplifier so long after its current has come on. */
static double shunt_A(const plant_sensor_t *sensor, double i_A, double after_s)
{
    if (after_s >= sensor->settle_s) {
        return i_A;
    }
    return after_s > 0.0 ? -expm1(-SETTLE_CONSTANTS * after_s / sensor->settle_s) * i_A : 0.0;
}

static void convert_currents(const plant_sensor_t *sensor, noise_t *noise, const sensor_input_t *input,
                             plant_adc_t *adc)
{
    bool in_line = sensor->shunt == PLANT_IN_LINE;
    bool single = sensor->shunt == PLANT_SINGLE_SHUNT;
    int shunts = single ? 1 : input->legs;
    for (int k = 0; k < shunts; k++) {
        double i_A = single ? input->i_dc_A : input->i_A[k];
        double after_s = in_line ? (double)INFINITY : single ? input->quiet_s : input->low_for_s[k];
        adc->i_leg[k] = current(sensor, noise, k, shunt_A(sensor, i_A, after_s));
        adc->settled |= (uint8_t)((after_s >= sensor->settle_s) << k);
    }
    for (int k = shunts; k < PLANT_LEGS; k++) {
        adc->i_leg[k] = MID_SCALE;
    }
}

/* n: of the divider, neutrals after all terminals */
static uint16_t divided(const plant_sensor_t *sensor, noise_t *noise, int n, double v_V)
{
    bool own = sensor->v_leg_full_scale_V > 0.0;
    double full_scale_V = own ? sensor->v_leg_full_scale_V : sensor->v_full_scale_V;
    double noise_lsb = own ? draw_lsb(sensor, noise) : 0.0;
    double seen_V = (1.0 + sensor->divider_error[n]) * v_V + sensor->v_offset_V[n];
    return unipolar(resolution(sensor), seen_V / full_scale_V, noise_lsb);
}

static uint16_t differential(const plant_sensor_t *s, noise_t *noise, double v_V)
{
    if (s->v_zero_full_scale_V == 0.0) {
        return MID_SCALE;
    }
    int bits = s->v_zero_bits > 0 ? s->v_zero_bits : resolution(s);
    double loading = s->v_zero_load_ohm > 0.0 ? s->v_zero_network_ohm / (3.0 * s->v_zero_load_ohm) : 0.0;
    double seen_V = (1.0 + s->v_zero_gain_error) * v_V / (1.0 + loading) + s->v_zero_offset_V;
    double noise_lsb = s->v_zero_noise_lsb > 0.0 ? s->v_zero_noise_lsb * noise_gaussian(noise) : 0.0;
    return bipolar(bits, seen_V / s->v_zero_full_scale_V, noise_lsb);
}

static uint16_t link_current(const plant_sensor_t *s, noise_t *noise, double i_A)
{
    if (s->i_dc_full_scale_A == 0.0) {
        return MID_SCALE;
    }
    double seen_A = (1.0 + s->i_dc_gain_error) * i_A + s->i_dc_offset_A;
    return bipolar(resolution(s), seen_A / s->i_dc_full_scale_A, draw_lsb(s, noise));
}

void sensor_convert(const plant_sensor_t *sensor, noise_t *noise, const sensor_input_t *input,
                    plant_adc_t *adc)
{
    assert(input->legs <= PLANT_LEGS && input->sets <= PLANT_SETS);
    int bits = resolution(sensor);
    *adc = (plant_adc_t){.settled = 0};
    convert_currents(sensor, noise, input, adc);
    double v_dc_V = input->v_dc_V + sensor->v_dc_offset_V;
    adc->v_dc = unipolar(bits, v_dc_V / sensor->v_full_scale_V, draw_lsb(sensor, noise));
    for (int k = 0; k < input->legs; k++) {
        adc->v_leg[k] = divided(sensor, noise, k, input->v_leg_V[k]);
    }
    for (int set = 0; set < input->sets; set++) {
        adc->v_neutral[set] = divided(sensor, noise, PLANT_LEGS + set, input->v_neutral_V[set]);
    }
    for (int set = 0; set < PLANT_SETS; set++) {
        adc->v_zero[set] = set < input->sets ? differential(sensor, noise, input->v_zero_V[set]) : MID_SCALE;
    }
    adc->i_dc = link_current(sensor, noise, input->i_link_A);
    double t_full_scale_degC =
        sensor->t_full_scale_degC > 0.0 ? sensor->t_full_scale_degC : T_FULL_SCALE_DEGC;
    adc->temperature = bipolar(bits, input->temperature_degC / t_full_scale_degC, 0.0);
}
