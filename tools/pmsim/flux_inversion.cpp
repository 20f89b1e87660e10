#include <cmath>

#include "tools/pmsim/flux_formula.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const int most_steps = 100, most_halvings = 40;
const double good_enough = 1e-9;  // of i_max: a residual that no step makes smaller is rounding below this
const double difference = 1e-5;   // of the flux, for derivatives: the square of it is the relative error
const double probe_current = 0.1; // of i_max, made by the scale of the flux
const double probe_least_Wb = 1e-9, probe_most_Wb = 1e6;

// Solves i(psi) = i for the flux.
class Inversion
{
  public:
    Inversion(const Expression &i_d, const Expression &i_q, double i_max_A)
        : i_d_(i_d), i_q_(i_q), i_max_A_(i_max_A)
    {
        const dq_t zero = current({0.0, 0.0});
        scale_Wb_ = probe_least_Wb;
        while (scale_Wb_ < probe_most_Wb &&
               !(std::fabs(current({scale_Wb_, 0.0}).d - zero.d) > probe_current * i_max_A)) {
            scale_Wb_ *= 2.0;
        }
    }

    dq_t operator()(dq_t i_A, dq_t guess_Wb) const
    {
        dq_t psi = guess_Wb;
        double residual = distance(psi, i_A);
        for (int step = 0; step < most_steps && residual > 0.0; ++step) {
            const dq_t by = newton_step(psi, i_A);
            double part = 1.0, next = residual;
            dq_t there = psi;
            for (int k = 0; k < most_halvings; ++k, part *= 0.5) {
                there = {psi.d - part * by.d, psi.q - part * by.q};
                next = distance(there, i_A);
                if (next < residual) {
                    break;
                }
            }
            if (!(next < residual)) {
                break;
            }
            psi = there;
            residual = next;
        }
        if (!(residual < good_enough * i_max_A_)) {
            i_d_.value().fail("no flux was found for i_d = " + format(i_A.d) + " A, i_q = " + format(i_A.q) +
                              " A");
        }
        return psi;
    }

  private:
    dq_t current(dq_t psi) const
    {
        return {i_d_(psi.d, psi.q), i_q_(psi.d, psi.q)};
    }

    double distance(dq_t psi, dq_t i_A) const // not a number where the formulas have no value
    {
        const dq_t i = current(psi);
        return std::hypot(i.d - i_A.d, i.q - i_A.q);
    }

    dq_t newton_step(dq_t psi, dq_t i_A) const
    {
        const double h = difference * (scale_Wb_ + std::hypot(psi.d, psi.q));
        const dq_t dp = current({psi.d + h, psi.q}), dm = current({psi.d - h, psi.q});
        const dq_t qp = current({psi.d, psi.q + h}), qm = current({psi.d, psi.q - h});
        const double dd = (dp.d - dm.d) / (2 * h), qd = (dp.q - dm.q) / (2 * h);
        const double dq = (qp.d - qm.d) / (2 * h), qq = (qp.q - qm.q) / (2 * h);
        const dq_t i = current(psi);
        const double e_d = i.d - i_A.d, e_q = i.q - i_A.q, det = dd * qq - dq * qd;
        return {(qq * e_d - dq * e_q) / det, (dd * e_q - qd * e_d) / det};
    }

    const Expression &i_d_, &i_q_;
    double i_max_A_, scale_Wb_;
};

} // namespace

FluxOfCurrent flux_by_inversion(const Expression &i_d, const Expression &i_q, double i_max_A)
{
    return Inversion(i_d, i_q, i_max_A);
}

} // namespace pmsim
