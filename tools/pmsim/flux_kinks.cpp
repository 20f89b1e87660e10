#include "tools/pmsim/flux_kinks.h"

#include <algorithm>
#include <cmath>

namespace pmsim
{
namespace
{

const int fine_cells = 512, window_cells = 64, zoom = 4;
const int order = 6;                      // of the differences
const double smooth_by_half = 1.0 / 32.0; // halving the step: 1/64 where smooth, 1/16 at a kink with p = 4
const double smooth_by_zoom = 1.0 / 1000.0;
const double worth_finding = 1e-11; // of the largest flux: a difference
const double rounding = 3e-13;      // of the largest flux: what a difference of smooth values has of it
const int most_zooms = 11;          // to 1e-9 of the range
const int most_tries = 12;          // on a line
const double step_below = 1.3;      // p of a step of the inductance is 1
const double least_p = 0.5;         // less is a step of the flux, which no map has
const double lines[] = {-0.83, -0.47, 0.13, 0.38, 0.71}; // of i_max
const int enough_lines = 3;
const double same_place = 1e-7; // of i_max

enum class Along { d, q };

// The fluxes along a line of constant current on the other axis.
class Line
{
  public:
    Line(const FluxOfCurrent &flux, Along along, double other_A)
        : flux_(flux), along_(along), other_A_(other_A)
    {
    }

    dq_t at(double i_A)
    {
        last_Wb_ = flux_(along_ == Along::d ? dq_t{i_A, other_A_} : dq_t{other_A_, i_A}, last_Wb_);
        return last_Wb_;
    }

  private:
    const FluxOfCurrent &flux_;
    Along along_;
    double other_A_;
    dq_t last_Wb_{0.0, 0.0};
};

struct Window {
    double low_A, step_A;
    std::vector<dq_t> psi_Wb;

    double at(size_t k) const
    {
        return low_A + double(k) * step_A;
    }
};

Window window(Line &line, double low_A, double high_A, int cells)
{
    Window w{low_A, (high_A - low_A) / cells, std::vector<dq_t>(size_t(cells) + 1)};
    const size_t middle = size_t(cells) / 2; // outwards, so that the last flux is one nearby
    for (size_t k = middle; k <= size_t(cells); ++k) {
        w.psi_Wb[k] = line.at(w.at(k));
    }
    for (size_t k = middle + 1; k-- > 0;) {
        w.psi_Wb[k] = line.at(w.at(k));
    }
    return w;
}

// Sixth difference over samples k to k + 6 stride, of the larger flux.
double difference(const Window &w, size_t k, size_t stride)
{
    static const double weights[order + 1] = {1, -6, 15, -20, 15, -6, 1};
    double d = 0.0, q = 0.0;
    for (size_t j = 0; j <= size_t(order); ++j) {
        d += weights[j] * w.psi_Wb[k + j * stride].d;
        q += weights[j] * w.psi_Wb[k + j * stride].q;
    }
    return std::max(std::fabs(d), std::fabs(q));
}

struct Peak {
    double i_A, size;
};

// The largest sixth difference, at the centre of its samples.
Peak peak(const Window &w)
{
    Peak found{0.0, -1.0};
    for (size_t k = 0; k + size_t(order) < w.psi_Wb.size(); ++k) {
        const double size = difference(w, k, 1);
        if (size > found.size) {
            found = {w.at(k) + 0.5 * order * w.step_A, size};
        }
    }
    return found;
}

// Zooms in on a place; false when it is smooth after all.
bool narrow(Line &line, double i_A, double size, double step_A, double largest_Wb, double i_max_A,
            FluxKink &kink)
{
    const double first = size;
    int zooms = 0;
    for (; zooms < most_zooms && size > rounding * largest_Wb; ++zooms) {
        step_A /= zoom;
        const double reach_A = 0.5 * window_cells * step_A;
        const double centre_A = std::clamp(i_A, -i_max_A + reach_A, i_max_A - reach_A);
        const Peak next = peak(window(line, centre_A - reach_A, centre_A + reach_A, window_cells));
        if (next.size < rounding * largest_Wb) {
            break;
        }
        if (next.size < smooth_by_zoom * size) {
            return false;
        }
        i_A = next.i_A;
        size = next.size;
        kink.within_A = 0.5 * order * step_A;
    }
    const double p = zooms > 0 ? std::log(first / size) / (zooms * std::log(double(zoom))) : 0.0;
    kink.i_A = i_A;
    kink.step = p < step_below;
    return p > least_p;
}

std::vector<FluxKink> kinks_of_line(Line &line, double i_max_A)
{
    const Window w = window(line, -i_max_A, i_max_A, fine_cells);
    double largest_Wb = 0.0;
    for (const dq_t psi : w.psi_Wb) {
        largest_Wb = std::max({largest_Wb, std::fabs(psi.d), std::fabs(psi.q)});
    }
    const size_t fine = w.psi_Wb.size() - order, coarse = w.psi_Wb.size() - 2 * order;
    std::vector<Peak> places; // those that halving the step makes too little smaller
    for (size_t k = 0; k < fine; ++k) {
        const double size = difference(w, k, 1);
        const size_t around = std::min(k > size_t(order) / 2 ? k - order / 2 : 0, coarse - 1);
        if (size > worth_finding * largest_Wb && size > smooth_by_half * difference(w, around, 2)) {
            places.push_back({w.at(k) + 0.5 * order * w.step_A, size});
        }
    }
    std::sort(places.begin(), places.end(), [](const Peak &a, const Peak &b) { return a.size > b.size; });
    std::vector<FluxKink> kinks;
    std::vector<double> seen_A;
    for (const Peak &place : places) {
        const bool seen = std::any_of(seen_A.begin(), seen_A.end(), [&](double i_A) {
            return std::fabs(i_A - place.i_A) < 1.5 * order * w.step_A;
        });
        if (seen || seen_A.size() == size_t(most_tries)) {
            continue;
        }
        FluxKink kink{place.i_A, 0.5 * order * w.step_A, false};
        if (narrow(line, place.i_A, place.size, w.step_A, largest_Wb, i_max_A, kink)) {
            kinks.push_back(kink);
        }
        seen_A.push_back(place.i_A);
    }
    return kinks;
}

// Places that most lines share.
std::vector<FluxKink> kinks_along(const FluxOfCurrent &flux, double i_max_A, Along along)
{
    std::vector<FluxKink> all, shared;
    for (const double part : lines) {
        Line line(flux, along, part * i_max_A);
        const std::vector<FluxKink> found = kinks_of_line(line, i_max_A);
        all.insert(all.end(), found.begin(), found.end());
    }
    std::sort(all.begin(), all.end(), [](const FluxKink &a, const FluxKink &b) { return a.i_A < b.i_A; });
    for (size_t first = 0; first < all.size();) {
        FluxKink best = all[first];
        size_t next = first + 1;
        for (; next < all.size() &&
               all[next].i_A - best.i_A <= all[next].within_A + best.within_A + same_place * i_max_A;
             ++next) {
            const bool step = best.step || all[next].step;
            best = all[next].within_A < best.within_A ? all[next] : best;
            best.step = step;
        }
        const bool node_anyway = !best.step && std::fabs(best.i_A) <= best.within_A; // at zero current
        if (next - first >= size_t(enough_lines) && !node_anyway) {
            shared.push_back(best);
        }
        first = next;
    }
    return shared;
}

} // namespace

FluxKinks find_flux_kinks(const FluxOfCurrent &flux, double i_max_A)
{
    return {kinks_along(flux, i_max_A, Along::d), kinks_along(flux, i_max_A, Along::q)};
}

} // namespace pmsim
