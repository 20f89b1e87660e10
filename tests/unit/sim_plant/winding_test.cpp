// winding.h against the phases themselves: every matrix is written here phase by phase, as METHODS.md 1.3.1.1
// and plant_config.h state it, and only then seen in the coordinates of the winding.
extern "C" {
#include "sim_plant/winding.h"
}

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <complex>

namespace
{

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double pi = 3.14159265358979323846;
// Sums of a few dozen products of numbers near one: rounding.
constexpr double rounding = 1e-13;
// Central differences with this step: h^2/6 of the third derivative, n^3 = 3000 for the highest order here.
constexpr double step_rad = 1e-6;
constexpr double difference = 1e-8;

constexpr double R_s = 0.4, psi_m = 0.08, psi_core = 0.07, magnet = 0.9;

double phase_angle(int phase)
{
    return 2 * pi / 3 * (phase % 3) + pi / 6 * (phase / 3);
}

// One set or two, star or open, with everything that a winding can add.
plant_winding_t everything(int sets, plant_connection_t connection)
{
    plant_winding_t p{};
    p.sets = sets;
    p.connection = connection;
    p.L_0_H = 0.7e-3;
    p.dL_0_H = 0.4e-3;
    p.L_c0_H = -0.15e-3;
    p.M_d_H = sets == 2 ? 0.9e-3 : 0.0;
    p.M_q_H = sets == 2 ? 1.3e-3 : 0.0;
    p.emf[0] = {3, 4e-3, 0.2};
    p.emf[1] = {5, -2e-3, 0.0};
    p.emf[2] = {0, 1.0, 0.0}; // unused: skipped
    p.emf[3] = {7, 1e-3, -0.4};
    p.saliency[0] = {0, 1.0, 0.0};
    p.saliency[1] = {-4, 0.2e-3, 0.3};
    p.saliency[2] = {8, 0.1e-3, -1.0};
    p.saliency[3] = {2, 0.05e-3, 0.7};
    p.saliency[4] = {-10, 0.07e-3, 0.4};
    p.zero_saliency[0] = {-4, 0.3e-3, -0.6};
    p.zero_saliency[1] = {0, 1.0, 0.0};
    p.zero_saliency[2] = {5, -0.1e-3, 0.2};
    for (int k = 0; k < PLANT_LEGS; k++) {
        p.dR_ohm[k] = 0.02 * std::sin(1.0 + 2.0 * k);
        p.dL_H[k] = 0.1e-3 * std::cos(3.0 * k);
        p.dM_H[k / 3][k % 3] = 0.05e-3 * std::sin(2.0 + k);
        p.emf_gain[k] = 0.03 * std::cos(1.0 + k);
        p.emf_shift_rad[k] = 0.02 * std::sin(5.0 * k);
    }
    return p;
}

// Inductance between the phases at an angle.
class Phases
{
  public:
    explicit Phases(const plant_winding_t &parameters) : p(parameters), sets(p.sets > 1 ? 2 : 1), n(3 * sets)
    {
    }

    MatrixXd inductance(double theta) const
    {
        MatrixXd L = MatrixXd::Zero(n, n);
        for (int set = 0; set < sets; set++) {
            double own = theta - pi / 6 * set; // seen from phase A or X
            MatrixXd block = MatrixXd::Constant(3, 3, p.L_0_H / 3.0);
            block += second_harmonic(own) + saliency(own) + zero_saliency(own);
            for (int k = 0; k < 3; k++) {
                int next = (k + 1) % 3;
                block(k, k) += p.dL_H[3 * set + k];
                block(k, next) += p.dM_H[set][k];
                block(next, k) += p.dM_H[set][k];
            }
            L.block(3 * set, 3 * set, 3, 3) = block;
        }
        if (sets == 2) {
            L.block(0, 3, 3, 3) = mutual(theta);
            L.block(3, 0, 3, 3) = mutual(theta).transpose();
        }
        return L;
    }

    VectorXd flux(double theta) const
    {
        VectorXd psi(n);
        for (int k = 0; k < n; k++) {
            double own = theta - phase_angle(k);
            double gain = 1.0 + p.emf_gain[k], shift = p.emf_shift_rad[k];
            psi(k) = psi_m * gain * std::cos(own - shift) - psi_core * std::cos(own);
            for (const plant_harmonic_t &h : p.emf) {
                psi(k) += h.order == 0
                              ? 0.0
                              : magnet * h.amplitude * gain * std::cos(h.order * (own - shift) + h.phase_rad);
            }
        }
        return psi;
    }

    MatrixXd resistance() const
    {
        VectorXd R(n);
        for (int k = 0; k < n; k++) {
            R(k) = R_s + p.dR_ohm[k];
        }
        return R.asDiagonal();
    }

  private:
    // METHODS.md 1.3.1.1 with L_s2 - M_s2 = dL_0 and no more saliency than the core has: L_s2/2 + M_s2 = 0.
    // The cross-coupling counterpart has sines.
    MatrixXd second_harmonic(double own) const
    {
        MatrixXd L(3, 3);
        auto term = [&](double self, double mutual, auto f) {
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) {
                    // AA: 0, BB: -120, CC: +120; AB: +120, BC: 0, CA: -120 degrees
                    double shift = a == b ? -2 * pi / 3 * a
                                          : 2 * pi / 3 *
                                                (a + b == 1   ? 1
                                                 : a + b == 3 ? 0
                                                              : -1);
                    L(a, b) = -(a == b ? self : mutual) * f(2.0 * (own + shift));
                }
            }
            return L;
        };
        MatrixXd cosine =
            term(2.0 / 3.0 * p.dL_0_H, -1.0 / 3.0 * p.dL_0_H, [](double x) { return std::cos(x); });
        MatrixXd sine =
            term(2.0 / 3.0 * p.L_c0_H, -1.0 / 3.0 * p.L_c0_H, [](double x) { return std::sin(x); });
        return cosine + sine;
    }

    // Each set has it from its own axes: flux of each phase by its own current and those of the two others
    MatrixXd saliency(double own) const
    {
        MatrixXd clarke(2, 3), axes(3, 2), in_ab = MatrixXd::Zero(2, 2);
        for (int k = 0; k < 3; k++) {
            axes(k, 0) = std::cos(2 * pi / 3 * k);
            axes(k, 1) = std::sin(2 * pi / 3 * k);
            clarke.col(k) = 2.0 / 3.0 * axes.row(k).transpose();
        }
        for (const plant_harmonic_t &h : p.saliency) {
            double x = h.order * own + h.phase_rad;
            Eigen::Matrix2d turned;
            turned << std::cos(x), std::sin(x), std::sin(x), -std::cos(x);
            in_ab += h.order == 0 ? 0.0 * turned : h.amplitude * turned;
        }
        return axes * in_ab * clarke;
    }

    // Every phase has psi_0 = L/2 Re(e^{jx} i) of all three currents, and what a current makes in the others'
    // flux they make in its own: each phase answers i_0 = sum/3 with L Re(e^{-jx} e^{-j gamma}).
    MatrixXd zero_saliency(double own) const
    {
        MatrixXd L = MatrixXd::Zero(3, 3);
        for (const plant_harmonic_t &h : p.zero_saliency) {
            double x = h.order * own + h.phase_rad;
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) {
                    double by_phase = h.order == 0 ? 0.0 : h.amplitude / 3.0;
                    L(a, b) += by_phase * (std::cos(x + 2 * pi / 3 * a) + std::cos(x + 2 * pi / 3 * b));
                }
            }
        }
        return L;
    }

    // The rotor's axes carry M_d and M_q from the currents of X, Y, Z to the phases A, B, C
    MatrixXd mutual(double theta) const
    {
        MatrixXd M(3, 3);
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++) {
                double x = theta - phase_angle(a), y = theta - phase_angle(3 + b);
                M(a, b) =
                    2.0 / 3.0 * (p.M_d_H * std::cos(x) * std::cos(y) + p.M_q_H * std::sin(x) * std::sin(y));
            }
        }
        return M;
    }

    plant_winding_t p;
    int sets, n;
};

struct Case {
    const char *name;
    int sets;
    plant_connection_t connection;
};

class Winding : public testing::TestWithParam<Case>
{
  protected:
    Winding() : parameters(everything(GetParam().sets, GetParam().connection)), phases(parameters)
    {
        winding_init(&w, &parameters, R_s, psi_m, psi_core, magnet);
        bool open = GetParam().connection == PLANT_OPEN;
        from = MatrixXd::Zero(3 * GetParam().sets, 2 * GetParam().sets + open);
        for (int k = 0; k < from.rows(); k++) {
            from(k, k / 3 * 2) = std::cos(phase_angle(k));
            from(k, k / 3 * 2 + 1) = std::sin(phase_angle(k));
            if (open) {
                from(k, 2) = 1.0;
            }
        }
        to = (from.transpose() * from).inverse() * from.transpose();
    }

    static MatrixXd matrix(const double x[ACTIVE][ACTIVE], Eigen::Index n)
    {
        MatrixXd m(n, n);
        for (int a = 0; a < n; a++) {
            for (int b = 0; b < n; b++) {
                m(a, b) = x[a][b];
            }
        }
        return m;
    }

    winding_point_t at(double theta) const
    {
        winding_point_t point{};
        rotor_t rotor = {std::cos(theta), std::sin(theta)};
        winding_at(&w, rotor, w.active, &point);
        return point;
    }

    plant_winding_t parameters;
    Phases phases;
    winding_t w{};
    MatrixXd from, to; // phase values of the coordinates that carry current, and back
};

constexpr double angles[] = {0.0, 0.3, 1.1, 2.0, 2.9, -2.2, -0.7};

TEST_P(Winding, CountsItsCoordinates)
{
    EXPECT_EQ(w.sets, GetParam().sets);
    EXPECT_EQ(w.legs, GetParam().sets == 2 || GetParam().connection == PLANT_OPEN ? 6 : 3);
    EXPECT_EQ(w.active, from.cols());
    EXPECT_EQ(w.zero, GetParam().connection == PLANT_OPEN ? 2 : -1);
    EXPECT_EQ(w.branch, -1);
    EXPECT_FALSE(w.even);
}

// Legs feed the phases from one end or both; their voltages act by what keeps the power.
TEST_P(Winding, LegsFeedThePhases)
{
    for (int leg = 0; leg < w.legs; leg++) {
        for (int a = 0; a < w.active; a++) {
            double axis = leg < w.phases ? from(leg, a) : -from(leg - 3, a);
            EXPECT_NEAR(w.axis[leg][a], axis, rounding);
            EXPECT_NEAR(w.share[leg][a], leg < w.phases ? to(a, leg) : -to(a, leg - 3), rounding);
            EXPECT_NEAR(w.weight[a] * w.share[leg][a], w.axis[leg][a], rounding);
        }
    }
}

TEST_P(Winding, HasTheInductancesOfItsPhases)
{
    for (double theta : angles) {
        MatrixXd L = matrix(at(theta).L, w.active);
        EXPECT_LT((L - to * phases.inductance(theta) * from).cwiseAbs().maxCoeff(), rounding) << theta;
        EXPECT_GT(L.cwiseAbs().maxCoeff(), 3e-5);
    }
}

TEST_P(Winding, IsReciprocal)
{
    Eigen::Map<const VectorXd> weight(w.weight, w.active);
    for (double theta : angles) {
        MatrixXd L = weight.asDiagonal() * matrix(at(theta).L, w.active);
        EXPECT_LT((L - L.transpose()).cwiseAbs().maxCoeff(), rounding);
    }
}

TEST_P(Winding, HasTheMagnetFluxOfItsPhases)
{
    for (double theta : angles) {
        winding_point_t point = at(theta);
        Eigen::Map<const VectorXd> psi(point.psi, w.active);
        EXPECT_LT((psi - to * phases.flux(theta)).cwiseAbs().maxCoeff(), rounding) << theta;
    }
}

TEST_P(Winding, SlopesAreThoseOfItsPhases)
{
    for (double theta : angles) {
        winding_point_t point = at(theta);
        MatrixXd slope =
            (phases.inductance(theta + step_rad) - phases.inductance(theta - step_rad)) / (2 * step_rad);
        VectorXd emf = (phases.flux(theta + step_rad) - phases.flux(theta - step_rad)) / (2 * step_rad);
        Eigen::Map<const VectorXd> psi_theta(point.psi_theta, w.active);
        EXPECT_LT((matrix(point.L_theta, w.active) - to * slope * from).cwiseAbs().maxCoeff(), difference);
        EXPECT_LT((psi_theta - to * emf).cwiseAbs().maxCoeff(), difference);
    }
}

TEST_P(Winding, HasTheResistancesOfItsPhases)
{
    MatrixXd R = matrix(w.R_ohm, w.active);
    EXPECT_LT((R - to * phases.resistance() * from).cwiseAbs().maxCoeff(), rounding);
}

// METHODS.md 3.6.1.1: the traceless part of the resistance matrix.
TEST_P(Winding, AsymmetryOfResistanceIsThatOfTheBook)
{
    for (int set = 0; set < w.sets; set++) {
        double re = 0.0, im = 0.0;
        for (int k = 0; k < 3; k++) {
            re += parameters.dR_ohm[3 * set + k] * std::cos(4 * pi / 3 * k) / 3.0;
            im += parameters.dR_ohm[3 * set + k] * std::sin(4 * pi / 3 * k) / 3.0;
        }
        int a = 2 * set;
        double traceless = std::hypot(0.5 * (w.R_ohm[a][a] - w.R_ohm[a + 1][a + 1]), w.R_ohm[a][a + 1]);
        EXPECT_GT(traceless, 1e-3);
        EXPECT_NEAR(traceless, std::hypot(re, im), rounding);
    }
}

// The mean of the phase voltages of a set, whose currents add up to nothing.
TEST_P(Winding, ZeroSequenceVoltageIsTheMeanOfThePhases)
{
    if (GetParam().connection == PLANT_OPEN) {
        GTEST_SKIP() << "there the zero sequence is a coordinate like any other";
    }
    double omega = 300.0, theta = 0.8;
    VectorXd i(w.active), di(w.active);
    double i_A[ACTIVE] = {}, i_A_s[ACTIVE] = {};
    for (int a = 0; a < w.active; a++) {
        i_A[a] = i(a) = 3.0 * std::sin(1.0 + a);
        i_A_s[a] = di(a) = 2000.0 * std::cos(2.0 * a);
    }
    MatrixXd slope =
        (phases.inductance(theta + step_rad) - phases.inductance(theta - step_rad)) / (2 * step_rad);
    VectorXd emf = (phases.flux(theta + step_rad) - phases.flux(theta - step_rad)) / (2 * step_rad);
    VectorXd v = phases.resistance() * from * i + phases.inductance(theta) * from * di +
                 omega * (slope * from * i + emf);
    for (int set = 0; set < w.sets; set++) {
        rotor_t rotor = {std::cos(theta), std::sin(theta)};
        double v_zero = winding_zero_V(&w, rotor, omega, i_A, i_A_s, set);
        EXPECT_GT(std::fabs(v_zero), 0.1);
        EXPECT_NEAR(v_zero, v.segment(3 * set, 3).mean(), omega * difference);
    }
}

TEST_P(Winding, BranchIsACoordinateOfItsOwn)
{
    winding_point_t before = at(0.4);
    MatrixXd R = matrix(w.R_ohm, w.active);
    int active = w.active;
    const double axis[PLANT_LEGS] = {1.0, -1.0, 0.0};
    const double other[PLANT_LEGS] = {0.0, 0.0, 1.0};
    winding_branch(&w, axis, 2.5);
    winding_branch(&w, other, 3.5); // instead of the first
    ASSERT_EQ(w.branch, active);
    ASSERT_EQ(w.active, active + 1);
    EXPECT_EQ(w.R_ohm[active][active], 3.5);
    EXPECT_NEAR(at(1.0).L[active][active], 1e-6, rounding);
    for (int a = 0; a < active; a++) {
        EXPECT_EQ(w.R_ohm[a][active], 0.0);
        EXPECT_EQ(w.R_ohm[active][a], 0.0);
        EXPECT_EQ(at(1.0).L[a][active], 0.0);
        EXPECT_EQ(at(1.0).L[active][a], 0.0);
    }
    for (int leg = 0; leg < w.legs; leg++) {
        EXPECT_EQ(w.axis[leg][active], other[leg]);
        EXPECT_EQ(w.share[leg][active], other[leg]); // power is v i
    }
    winding_branch(&w, axis, -1.0);
    winding_branch(&w, axis, -1.0); // not there any more
    ASSERT_EQ(w.active, active);
    EXPECT_EQ(w.branch, -1);
    EXPECT_EQ(matrix(at(0.4).L, active), matrix(before.L, active));
    EXPECT_EQ(matrix(w.R_ohm, active), R);
}

INSTANTIATE_TEST_SUITE_P(Connections, Winding,
                         testing::Values(Case{"star", 1, PLANT_STAR}, Case{"open", 1, PLANT_OPEN},
                                         Case{"two_sets", 2, PLANT_STAR}),
                         [](const testing::TestParamInfo<Case> &test) { return test.param.name; });

TEST(PlainWinding, AddsNothing)
{
    plant_winding_t parameters{};
    parameters.L_0_H = 1e-3; // which a star does not see
    winding_t w;
    winding_init(&w, &parameters, R_s, psi_m, psi_m, 1.0);
    winding_point_t point;
    rotor_t rotor = {std::cos(0.5), std::sin(0.5)};
    winding_at(&w, rotor, w.active, &point);
    EXPECT_EQ(w.active, 2);
    EXPECT_TRUE(w.even);
    EXPECT_EQ(w.flux_terms, 0);
    for (int a = 0; a < 2; a++) {
        EXPECT_EQ(point.psi[a], 0.0);
        for (int b = 0; b < 2; b++) {
            EXPECT_EQ(point.L[a][b], 0.0);
            EXPECT_EQ(w.R_ohm[a][b], a == b ? R_s : 0.0);
        }
    }
}

TEST(PlainWinding, CoggingIsTheSlopeOfItsEnergy)
{
    plant_winding_t parameters{};
    parameters.cogging[0] = {6, 0.05, 0.3};
    parameters.cogging[2] = {12, -0.02, -1.0};
    winding_t w;
    winding_init(&w, &parameters, R_s, psi_m, psi_m, 1.0);
    auto rotor = [](double theta) { return rotor_t{std::cos(theta), std::sin(theta)}; };
    for (double theta : angles) {
        double torque = 0.05 * std::sin(6 * theta + 0.3) - 0.02 * std::sin(12 * theta - 1.0);
        EXPECT_NEAR(winding_cogging_Nm(&w, rotor(theta)), torque, rounding);
        double slope = (winding_cogging_J(&w, rotor(theta + step_rad)) -
                        winding_cogging_J(&w, rotor(theta - step_rad))) /
                       (2 * step_rad);
        EXPECT_NEAR(slope, -torque, difference);
    }
}

// METHODS-ADDENDUM.md E2, from three equal phases: self-inductance L_m cos(m theta + phase) of A, mutual
// inductance M_m cos(m theta + phase) of B and C, and the others a third of a turn on.
MatrixXd equal_phases(int m, double L_m, double M_m, double phase, double theta)
{
    MatrixXd L(3, 3);
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
            int third = (6 - a - b) % 3; // the phase that a pair leaves out
            L(a, b) = a == b ? L_m * std::cos(m * (theta - 2 * pi / 3 * a) + phase)
                             : M_m * std::cos(m * (theta - 2 * pi / 3 * third) + phase);
        }
    }
    return L;
}

// In coordinates alpha, beta, zero
MatrixXd clarke_of(const MatrixXd &phases)
{
    MatrixXd from(3, 3);
    for (int k = 0; k < 3; k++) {
        from.row(k) << std::cos(2 * pi / 3 * k), std::sin(2 * pi / 3 * k), 1.0;
    }
    return from.inverse() * phases * from;
}

TEST(SaliencyOrder, IsThatOfEqualPhases)
{
    constexpr double L_m = 0.3e-3, M_m = -0.04e-3, phase = 0.7;
    for (int m : {1, 2, 4, 5, 7, 8, 10, 11}) {
        int order = m % 3 == 2 ? m : -m;
        double own_phase = m % 3 == 2 ? phase : -phase;
        plant_winding_t p{};
        p.connection = PLANT_OPEN; // so that the zero sequence shows
        p.saliency[0] = {order, 0.5 * L_m + M_m, own_phase};
        p.zero_saliency[0] = {order, L_m - M_m, own_phase};
        winding_t w;
        winding_init(&w, &p, R_s, psi_m, psi_m, 1.0);
        for (double theta : angles) {
            MatrixXd expected = clarke_of(equal_phases(m, L_m, M_m, phase, theta));
            winding_point_t point{};
            winding_at(&w, rotor_t{std::cos(theta), std::sin(theta)}, w.active, &point);
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) {
                    EXPECT_NEAR(point.L[a][b], expected(a, b), rounding) << m << " " << a << b;
                }
            }
        }
    }
}

// What orders 3, 6, 9 of the phases make is alike in every direction, and does not reach the zero sequence.
TEST(SaliencyOrder, OfThreeIsNone)
{
    for (int m : {3, 6, 9}) {
        for (double theta : angles) {
            MatrixXd L = clarke_of(equal_phases(m, 0.3e-3, -0.04e-3, 0.7, theta));
            EXPECT_NEAR(L(0, 0), L(1, 1), rounding);
            EXPECT_NEAR(L(0, 1), 0.0, rounding);
            EXPECT_NEAR(L.row(2).head(2).norm() + L.col(2).head(2).norm(), 0.0, rounding);
        }
    }
}

// dL_0 and L_c0 are the second order of the list, with the signs of METHODS.md E3.
TEST(SaliencyOrder, SecondOfTheZeroSequenceIsThatOfTheBook)
{
    for (int sets : {1, 2}) {
        plant_winding_t book{}, list{};
        book.sets = list.sets = sets;
        book.connection = list.connection = sets == 1 ? PLANT_OPEN : PLANT_STAR;
        book.dL_0_H = 0.4e-3;
        book.L_c0_H = -0.15e-3;
        list.zero_saliency[0] = {2, std::hypot(0.4e-3, 0.15e-3), std::atan2(-0.15e-3, -0.4e-3)};
        winding_t one, other;
        winding_init(&one, &book, R_s, psi_m, psi_m, 1.0);
        winding_init(&other, &list, R_s, psi_m, psi_m, 1.0);
        const double i_A[ACTIVE] = {3.0, -2.0, 1.0, 0.5}, i_A_s[ACTIVE] = {700.0, 900.0, -400.0, 100.0};
        for (double theta : angles) {
            for (int set = 0; set < sets; set++) {
                rotor_t rotor = {std::cos(theta), std::sin(theta)};
                double v_V = winding_zero_V(&one, rotor, 200.0, i_A, i_A_s, set);
                EXPECT_GT(std::fabs(v_V), 1e-3);
                EXPECT_NEAR(winding_zero_V(&other, rotor, 200.0, i_A, i_A_s, set), v_V, 1e-12);
            }
        }
    }
}

// What moves with the currents, from psi_0 of its definition along a path of currents and angle: theta = 0.8 + 200 t.
TEST(ZeroSequence, MovesWithTheCurrentsOfAStar)
{
    constexpr double dL_0 = 2e-3, by_d = -0.04, by_q = -0.01, L_c0 = 0.2e-3, cross = -75e-6;
    plant_winding_t still{}, moving{};
    still.sets = moving.sets = 2;
    still.dL_0_H = moving.dL_0_H = dL_0;
    still.L_c0_H = moving.L_c0_H = L_c0;
    moving.dL_0_d_1_A = by_d;
    moving.dL_0_q_1_A2 = by_q;
    moving.L_c0_q_H_A = cross;
    winding_t one, other;
    winding_init(&one, &still, R_s, psi_m, psi_m, 1.0);
    winding_init(&other, &moving, R_s, psi_m, psi_m, 1.0);
    const double i_A[ACTIVE] = {3.0, -2.0, 1.0, 0.5}, i_A_s[ACTIVE] = {700.0, 900.0, -400.0, 100.0};
    const double omega = 200.0;
    for (double theta : angles) {
        for (int set = 0; set < 2; set++) {
            const auto added_Wb = [&](double t) {
                const Complex at = std::polar(1.0, theta + omega * t);
                const Complex i =
                    Complex(i_A[2 * set] + i_A_s[2 * set] * t, i_A[2 * set + 1] + i_A_s[2 * set + 1] * t) /
                    at;
                const double more = dL_0 * (by_d * i.real() + by_q * i.imag() * i.imag());
                const Complex c(more, -cross * i.imag());
                return -0.5 * (c * i * at * at * at * std::polar(1.0, -3.0 * set * pi / 6.0)).real();
            };
            const double step_s = 1e-7;
            const double expected_V = (added_Wb(step_s) - added_Wb(-step_s)) / (2.0 * step_s);
            const rotor_t rotor = {std::cos(theta), std::sin(theta)};
            const double v_V = winding_zero_V(&other, rotor, omega, i_A, i_A_s, set) -
                               winding_zero_V(&one, rotor, omega, i_A, i_A_s, set);
            EXPECT_GT(std::fabs(expected_V), 1e-4);
            EXPECT_NEAR(v_V, expected_V, 1e-8);
        }
    }
}

TEST(PlainWinding, MultiplesOfAnAngle)
{
    for (int n : {1, 2, 3, 7, 36, 1000}) {
        rotor_t r = winding_multiple(rotor_t{std::cos(0.7), std::sin(0.7)}, n);
        EXPECT_NEAR(r.c, std::cos(n * 0.7), 1e-12);
        EXPECT_NEAR(r.s, std::sin(n * 0.7), 1e-12);
    }
}

} // namespace
