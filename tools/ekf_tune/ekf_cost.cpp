// Cost of the Kalman filters' noise figures on recorded runs (METHODS.md 12.4.5, row 144).
//
// usage: ekf_cost SCENARIO...
//   Runs each scenario once in closed loop with the observer it names, and keeps what the observer saw,
//   voltage and current of each period, with the plant's truth, from the moment that the rotor has 5 % of its
//   rated speed. Then each line of standard input is one question,
//     cost OBSERVER ekf_voltage_noise ekf_speed_noise ekf_angle_noise COUNT SPREAD     (parameters in their
//     units) lost OBSERVER ekf_voltage_noise ekf_speed_noise ekf_angle_noise COUNT SPREAD
//   and the answer one line: the mean of dtheta^2 + lambda domega^2, in rad^2, lambda = (10 ms)^2, over all
//   records, once with the right machine and COUNT - 1 times with R_s, L_d, L_q and psi_m of the filter each
//   off by up to SPREAD; or in how many of COUNT such tries (others) the angle error passed 90 degrees.
// The filter runs as in the drive: fixed point, behind the drive's loop, 1 kHz part included.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tools/pmsim/loop.h"
#include "tools/pmsim/scenario_file.h"

#include "firmware/drive/config.h"
#include "firmware/math/trig.h"
#include "firmware/params/parameters.h"
extern "C" {
#include "tools/pmsim/rig_drive.h"
}

namespace
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kLambda_s2 = 1e-4;
constexpr double kStart = 0.05; // of rated speed

struct Period {
    pm_ab_t v, i; // over [k-1, k) and at k
    double theta_rad, omega_rad_s;
};

struct Record {
    pmsim::Parameters params;
    double omega_base_rad_s;
    uint32_t slow_divider;
    std::vector<Period> periods;
};

Record record(const pmsim::Scenario &scenario)
{
    pmsim::Loop loop(scenario);
    Record r = {scenario.setup.params, 0, loop.slow_divider(), {}};
    const double pole_pairs = r.params->pole_pairs;
    const double start = kStart * scenario.setup.rated.speed_rated_rad_s;
    const uint64_t count = pmsim::period_count(scenario);
    const drive_t *drive = rig_drive(loop.rig());
    bool started = false;
    for (uint64_t k = 0; k < count; ++k) {
        const pm_ab_t v = drive->v_acting;
        const rig_sample_t sample = loop.step().rig;
        const bool leads = sample.state == RIG_RUNNING && sample.weight >= 1;
        started = started || (leads && std::abs(sample.truth.omega_mech_rad_s) > start);
        if (started && !leads) {
            break;
        }
        if (started) {
            r.periods.push_back(
                {v, drive->i_ab, sample.truth.theta_e_rad, sample.truth.omega_mech_rad_s * pole_pairs});
        }
    }
    r.omega_base_rad_s = std::ldexp(drive->config.base.omega.m, drive->config.base.omega.e);
    return r;
}

struct Noise {
    double voltage, speed, angle;
};

int32_t parameter(drive_param_id_t id, double value)
{
    return static_cast<int32_t>(std::lround(value * std::pow(10, -drive_param_exp10[id])));
}

bool configure(const Record &r, int observer, const Noise &noise, drive_config_t *config)
{
    drive_params_t params = *r.params;
    params.observer = observer;
    params.ekf_voltage_noise = parameter(DRIVE_PARAM_ekf_voltage_noise, noise.voltage);
    params.ekf_speed_noise = parameter(DRIVE_PARAM_ekf_speed_noise, noise.speed);
    params.ekf_angle_noise = parameter(DRIVE_PARAM_ekf_angle_noise, noise.angle);
    return drive_configure(config, &params, PM_CHANNELS).ok;
}

// The filter's idea of the machine alone.
void mistake(observer_config_t *c, double R, double L_d, double L_q, double psi_m)
{
    observer_model_t *m = c->id == OBSERVER_ekf_full ? &c->ekf_full.model : &c->ekf_reduced.model;
    const auto scale = [](pm_q_t *x, double factor) { *x = static_cast<pm_q_t>(std::lround(*x * factor)); };
    scale(&m->R, R);
    scale(&m->L_d, L_d);
    scale(&m->L_q, L_q);
    scale(&m->L_q2, L_q);
    scale(&m->psi_m, psi_m);
}

struct Result {
    double squares = 0, largest_rad = 0;
};

Result run(const Record &r, const drive_config_t &config)
{
    const position_config_t &c = config.position;
    const Period &first = r.periods.front();
    const auto turns = [](double rad) {
        const double turn = rad / (2 * kPi);
        return static_cast<pm_angle_t>(static_cast<int64_t>((turn - std::floor(turn)) * 0x1p32));
    };
    pm_pll_t pll = {turns(first.theta_rad),
                    static_cast<pm_q_t>(first.omega_rad_s / r.omega_base_rad_s * 0x1p28)};
    observer_t observer;
    obs_in_t in = {first.v, first.i, pm_dir(pll.theta), pll.omega, {}, nullptr};
    in.i_dq = pm_park(in.i, in.dir);
    observer_reset(&observer, &c.observer, &in);
    Result result;
    for (size_t k = 1; k < r.periods.size(); ++k) {
        const Period &p = r.periods[k];
        pm_pll_predict(&pll, &c.pll_high);
        in = {p.v, p.i, pm_dir(pll.theta), pll.omega, {}, nullptr};
        in.i_dq = pm_park(in.i, in.dir);
        obs_out_t out;
        observer_step(&observer, &c.observer, &in, &out);
        pm_pll_correct(&pll, &c.pll_high, out.eps);
        if (k % r.slow_divider == 0) {
            observer_slow(&observer, &c.observer, &in, &out, PM_ONE);
        }
        const double theta = pll.theta * 0x1p-32 * 2 * kPi;
        const double error = std::remainder(p.theta_rad - theta, 2 * kPi);
        const double speed = p.omega_rad_s - pll.omega * 0x1p-28 * r.omega_base_rad_s;
        result.squares += error * error + kLambda_s2 * speed * speed;
        result.largest_rad = std::max(result.largest_rad, std::abs(error));
    }
    return result;
}

class Factors
{
  public:
    Factors(uint64_t seed, double spread) : random_(seed), spread_(spread)
    {
    }
    void apply(observer_config_t *c)
    {
        const double R = next(), L_d = next(), L_q = next(), psi_m = next();
        mistake(c, R, L_d, L_q, psi_m);
    }

  private:
    double next()
    {
        return 1 + spread_ * (2 * static_cast<double>(random_() >> 11) * 0x1p-53 - 1);
    }

    std::mt19937_64 random_;
    double spread_;
};

// The first try with the right machine.
double cost(const std::vector<Record> &records, int observer, const Noise &noise, int count, double spread)
{
    double sum = 0, periods = 0;
    Factors factors(2, spread);
    for (int n = 0; n < count; ++n) {
        for (const Record &r : records) {
            drive_config_t config;
            if (!configure(r, observer, noise, &config)) {
                return static_cast<double>(INFINITY);
            }
            if (n > 0) {
                factors.apply(&config.position.observer);
            }
            sum += run(r, config).squares;
            periods += static_cast<double>(r.periods.size() - 1);
        }
    }
    return sum / periods;
}

int lost(const std::vector<Record> &records, int observer, const Noise &noise, int count, double spread)
{
    Factors factors(1, spread);
    int lost = 0;
    for (int n = 0; n < count; ++n) {
        const Record &r = records[static_cast<size_t>(n) % records.size()];
        drive_config_t config;
        if (!configure(r, observer, noise, &config)) {
            return count;
        }
        factors.apply(&config.position.observer);
        lost += run(r, config).largest_rad > kPi / 2 ? 1 : 0;
    }
    return lost;
}

} // namespace

int main(int argc, char **argv)
{
    std::vector<Record> records;
    for (int k = 1; k < argc; ++k) {
        const pmsim::ScenarioFile file(argv[k]);
        for (const pmsim::Run &one : file.runs()) {
            records.push_back(record(file.scenario(one)));
        }
    }
    std::string line;
    while (std::getline(std::cin, line)) {
        std::istringstream words(line);
        std::string what;
        int observer = 0, count = 0;
        double spread = 0;
        Noise noise = {};
        words >> what >> observer >> noise.voltage >> noise.speed >> noise.angle >> count >> spread;
        if (!words || records.empty()) {
            std::fprintf(stderr, "ekf_cost: not a question: %s\n", line.c_str());
            return 1;
        }
        if (what == "lost") {
            std::printf("%d\n", lost(records, observer, noise, count, spread));
        } else {
            std::printf("%.9g\n", cost(records, observer, noise, count, spread));
        }
        std::fflush(stdout);
    }
    return 0;
}
