#include "tools/pmsim/runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>

#include "tools/pmsim/loop.h"

namespace pmsim
{
namespace
{

// A metric with the periods it is meant for.
struct WindowedMetric {
    std::unique_ptr<Metric> metric;
    uint64_t first, last;
};

std::vector<WindowedMetric> make_metrics(const Scenario &scenario)
{
    const double f_Hz = scenario.setup.plant.inverter.f_pwm_Hz;
    const uint64_t count = period_count(scenario);
    std::vector<WindowedMetric> metrics;
    for (const Expectation &expectation : scenario.expect) {
        const auto first = static_cast<uint64_t>(std::llround(expectation.t0_s * f_Hz));
        const auto end = std::min(count, static_cast<uint64_t>(std::llround(expectation.t1_s * f_Hz)));
        metrics.push_back({make_metric(expectation, scenario.setup), first, end > 0 ? end - 1 : 0});
    }
    return metrics;
}

uint64_t periods_until(double t_s, double period_s, uint64_t most)
{
    return t_s < double(most) * period_s ? static_cast<uint64_t>(std::ceil(t_s / period_s)) + 1 : most;
}

} // namespace

RunResult run_scenario(const Scenario &scenario, const Observer &observer, std::atomic<uint64_t> *progress)
{
    Loop loop(scenario);
    std::vector<WindowedMetric> metrics = make_metrics(scenario);
    const uint64_t count = period_count(scenario);
    const double period_s = 1.0 / scenario.setup.plant.inverter.f_pwm_Hz;
    const uint64_t report = 1000;
    uint64_t end = count;
    bool faulty = false;
    for (uint64_t k = 0; k < end; ++k) {
        const Sample &sample = loop.step();
        if (sample.rig.fault != 0 && !faulty) {
            faulty = true;
            end = periods_until(double(k) * period_s + scenario.after_fault_s, period_s, count);
        }
        for (WindowedMetric &windowed : metrics) {
            if (k >= windowed.first && k <= windowed.last) {
                windowed.metric->add(sample);
            }
        }
        if (observer) {
            observer(sample);
        }
        if (progress != nullptr && k % report == report - 1) {
            progress->fetch_add(static_cast<uint64_t>(1e6 * period_s * double(report)),
                                std::memory_order_relaxed);
        }
    }
    RunResult result;
    result.simulated_s = double(end) * period_s;
    for (size_t i = 0; i < metrics.size(); ++i) {
        result.outcomes.push_back(judge(scenario.expect[i], metrics[i].metric->value()));
    }
    return result;
}

namespace
{

// Hands out runs to threads; the first error stops all of them.
class Pool
{
  public:
    explicit Pool(const ScenarioFile &file) : file_(file)
    {
        result_.runs.resize(file.runs().size());
    }

    void work()
    {
        for (;;) {
            const size_t i = next_.fetch_add(1);
            if (i >= result_.runs.size() || failed_) {
                return;
            }
            try {
                result_.runs[i] = run_scenario(scenario(i), nullptr, &done_us_);
            } catch (...) {
                const std::lock_guard<std::mutex> lock(mutex_);
                error_ = error_ ? error_ : std::current_exception();
                failed_ = true;
            }
            ++finished_;
        }
    }

    bool finished() const
    {
        return failed_ || finished_ == result_.runs.size();
    }

    void show(double total_s) const
    {
        const double done_s = 1e-6 * double(done_us_.load());
        std::fprintf(stderr, "\r%3.0f %%  %.2f of %.2f s simulated, %zu of %zu runs ",
                     std::min(100.0, 100.0 * done_s / total_s), done_s, total_s, finished_.load(),
                     result_.runs.size());
        std::fflush(stderr);
    }

    SweepResult take()
    {
        if (error_) {
            std::rethrow_exception(error_);
        }
        return std::move(result_);
    }

  private:
    Scenario scenario(size_t i) // yaml-cpp is not made for threads
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        return file_.scenario(file_.runs()[i]);
    }

    const ScenarioFile &file_;
    SweepResult result_;
    std::atomic<size_t> next_{0}, finished_{0};
    std::atomic<uint64_t> done_us_{0};
    std::atomic<bool> failed_{false};
    std::mutex mutex_;
    std::exception_ptr error_;
};

} // namespace

SweepResult run_all(const ScenarioFile &file, int jobs, bool show_progress)
{
    Pool pool(file);
    const size_t count = std::min(file.runs().size(), static_cast<size_t>(std::max(1, jobs)));
    std::vector<std::thread> threads;
    for (size_t i = 0; i < count; ++i) {
        threads.emplace_back([&pool] { pool.work(); });
    }
    if (show_progress) {
        const double total_s = file.scenario(file.runs().front()).duration_s * double(file.runs().size());
        while (!pool.finished()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
            pool.show(total_s);
        }
        std::fprintf(stderr, "\r%60s\r", "");
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    return pool.take();
}

} // namespace pmsim
