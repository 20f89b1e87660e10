#include "injection/polarity.h"

#include "firmware/math/num.h"
#include "firmware/math/root.h"

#define MOST PM_Q(0.125)

void polarity_add(polarity_mean_t *self, pm_q_t x)
{
    const int64_t value = pm_clamp(x, -MOST, MOST);
    self->sum += value;
    self->square += value * value;
    self->count++;
}

pm_q_t polarity_mean(const polarity_mean_t *self)
{
    return self->count == 0U ? 0 : (pm_q_t)pm_quotient(self->sum, self->count);
}

/* Root of an integer below 2^60. */
static int32_t root(int64_t x)
{
    int32_t less = 1;
    while (x > INT32_MAX) {
        x /= 4;
        less *= 2;
    }
    const int32_t r = pm_sqrt((int32_t)x); /* 2^14 times the root of what is left */
    return less < 16384 ? r / (16384 / less) : r;
}

pm_q_t polarity_noise(const polarity_mean_t *self)
{
    if (self->count < 2U) {
        return 0;
    }
    const int32_t count = (int32_t)self->count;
    const int64_t mean = pm_quotient(self->sum, count);
    const int64_t spread = self->square - mean * self->sum;
    return spread <= 0 ? 0 : root(spread) / count;
}

pm_q_t polarity_rest(pm_q_t noise, uint32_t count)
{
    return pm_div(noise, pm_sqrt(pm_shl((int32_t)count, PM_Q_BITS - 8))) / 16; /* of count / 256 */
}

pm_procedure_t polarity_judge(const polarity_config_t *config, pm_q_t mean, pm_q_t allowance, pm_q_t noise,
                              pm_sigma_t *margin, bool *north)
{
    *margin = pulses_polarity(mean, allowance, pm_max(noise, 1));
    *north = (mean > 0) != config->reversed;
    return *margin < PULSES_SURE ? PM_FAILED_POLARITY : PM_DONE;
}
