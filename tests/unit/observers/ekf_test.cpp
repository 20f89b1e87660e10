#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "observers/ekf_noise_config.h"
#include "tests/contract/bench.h"
#include "tests/contract/observers.h"
#include "tests/unit/observers/closed.h"
#include "tests/unit/observers/ekf_bench.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::kDegree;
using bench::Machine;
using bench::real;
using bench::Rotation;

constexpr double kRated_pu = 0.582; // 1000 r/min of IPM-1000, 400 r/min of SPM-400

constexpr Complex kRated_A = {-1.75, 4.0};

// Measured 2.9e-4 rad with gains that are quotients of 16 bits and held at a half, and 4e-4 of the standard
// deviations in the covariance, whose steps lose up to 10 LSB.
constexpr double kRounding_rad = 5e-4;
constexpr double kCovariance = 1e-3;

// Noise of the converter through loops of 25 Hz.
constexpr double kIdeal_deg = 0.2;

// With the noise of a converter.
class Full : public bench::Closed
{
  public:
    Full(const ekf_full_config_t &filter, const Base &b, const Rotation &truth)
        : Closed(b, of(filter), truth, bench::kConverterNoise_A)
    {
    }

  private:
    static observer_config_t of(const ekf_full_config_t &filter)
    {
        observer_config_t c = {};
        c.id = OBSERVER_ekf_full;
        c.ekf_full = filter;
        return c;
    }
};

class Reduced : public bench::Closed
{
  public:
    Reduced(const ekf_reduced_config_t &filter, const Base &b, const Rotation &truth)
        : Closed(b, of(filter), truth, bench::kConverterNoise_A)
    {
    }

  private:
    static observer_config_t of(const ekf_reduced_config_t &filter)
    {
        observer_config_t c = {};
        c.id = OBSERVER_ekf_reduced;
        c.ekf_reduced = filter;
        return c;
    }
};

struct FullFunctions {
    using State = ekf_full_t;
    static constexpr auto reset = ekf_full_reset;
    static constexpr auto step = ekf_full_step;
    static constexpr auto slow = ekf_full_slow;
};

struct ReducedFunctions {
    using State = ekf_reduced_t;
    static constexpr auto reset = ekf_reduced_reset;
    static constexpr auto step = ekf_reduced_step;
    static constexpr auto slow = ekf_reduced_slow;
};

// The filters in double precision, in the form of the literature: both currents at once through the inverse
// of a matrix, P = (I - K H) P. Units of the headers.
class FullReference
{
  public:
    FullReference(const ekf_full_config_t &c, const obs_in_t &in) : c_(c)
    {
        const observer_model_t &m = c.model;
        t_ = real(m.t_s, 32);
        psi_m_ = real(m.psi_m);
        const Complex i = bench::complex(in.i_dq);
        dir_ = direction(in);
        L_d_ = real(m.L_d);
        L_q_ = real(m.L_q) + real(m.L_q2) * i.imag() * i.imag();
        psi_a_ = psi_m_ + (L_d_ - L_q_) * i.real();
        eta_ = (L_d_ - L_q_) * i.imag();
        u_ = psi_m_ * t_;
        half_drop_ = real(m.R) * t_ / 2;
        omega_ = real(in.omega);
        const Complex now = bench::complex(in.i) / dir_;
        keep({(L_d_ + half_drop_) * now.real(), (L_q_ + half_drop_) * now.imag()});
        P = Eigen::Vector4d(bits(c.r_d), bits(c.r_q), 0.0064, 0.16).asDiagonal();
    }

    double step(const obs_in_t &in)
    {
        const Complex dir = direction(in);
        const Complex psi = (psi_ + t_ * bench::complex(in.v)) / dir;
        const double turn = std::arg(dir / dir_), frame = real(in.omega);
        dir_ = dir;
        delta_ += t_ * omega_ - turn;
        const Complex i = bench::complex(in.i) / dir;
        Complex lambda = psi - magnet();
        const Eigen::Vector2d y(((L_d_ + half_drop_) * i.real() - lambda.real()) / u_,
                                ((L_q_ + half_drop_) * i.imag() - lambda.imag()) / u_);
        const double b = psi_a_ / psi_m_ / 4;
        Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
        F(0, 1) = frame * t_;
        F(1, 0) = -F(0, 1);
        F(0, 3) = frame * b;
        F(1, 2) = -b;
        F(3, 2) = t_;
        const Eigen::Vector4d Q(bits(c_.q_lambda), bits(c_.q_lambda), bits(c_.q_omega), bits(c_.q_delta));
        P = F * P * F.transpose();
        P += Q.asDiagonal();
        Eigen::Matrix<double, 2, 4> H = Eigen::Matrix<double, 2, 4>::Identity();
        const Eigen::Vector2d R(bits(c_.r_d), bits(c_.r_q));
        const Eigen::Matrix2d S = H * P * H.transpose() + Eigen::Matrix2d(R.asDiagonal());
        K = P * H.transpose() * S.inverse();
        const Eigen::Vector4d x = K * y;
        P = (Eigen::Matrix4d::Identity() - K * H) * P;
        lambda += u_ * Complex{x(0), x(1)};
        omega_ += x(2) / 4;
        delta_ += x(3) / 4;
        keep(lambda);
        return delta_;
    }

    Eigen::Matrix4d P;
    Eigen::Matrix<double, 4, 2> K;

  private:
    static double bits(int32_t x)
    {
        return real(x, PM_KALMAN_BITS);
    }
    static Complex direction(const obs_in_t &in)
    {
        return {real(in.dir.cos, 31), real(in.dir.sin, 31)};
    }
    Complex magnet() const
    {
        return {psi_m_ * std::cos(delta_) + eta_ * std::sin(delta_), psi_a_ * std::sin(delta_)};
    }
    void keep(Complex lambda)
    {
        const Complex i = {lambda.real() / (L_d_ + half_drop_), lambda.imag() / (L_q_ + half_drop_)};
        psi_ = (lambda - 2 * half_drop_ * i + magnet()) * dir_;
    }

    ekf_full_config_t c_;
    double t_, psi_m_, L_d_, L_q_, psi_a_, eta_, u_, half_drop_, omega_, delta_ = 0;
    Complex psi_, dir_;
};

class ReducedReference
{
  public:
    ReducedReference(const ekf_reduced_config_t &c, const obs_in_t &in) : c_(c)
    {
        const observer_model_t &m = c.model;
        const Complex i = bench::complex(in.i_dq);
        t_ = real(m.t_s, 32);
        psi_m_ = real(m.psi_m);
        dir_ = direction(in);
        L_d_ = real(m.L_d);
        L_q_ = real(m.L_q) + real(m.L_q2) * i.imag() * i.imag();
        axis_ = {(L_d_ - L_q_) * i.imag(), psi_m_ + (L_d_ - L_q_) * i.real()}; // eta + j psi_a
        half_drop_ = real(m.R) * t_ / 2;
        speed_ = omega_ = real(in.omega);
        r_ = bits(c.r) * psi_m_ * psi_m_ / std::norm(axis_) / (omega_ * omega_);
        psi_ = (flux(bench::complex(in.i) / dir_, -1)) * dir_;
        P = Eigen::Vector2d(0.0004, 0.01).asDiagonal();
    }

    double step(const obs_in_t &in)
    {
        const Complex dir = direction(in), i = bench::complex(in.i) / dir;
        const Complex rho = (psi_ + t_ * bench::complex(in.v)) / dir - flux(i, 1);
        psi_ = flux(i, -1) * dir;
        const Complex seen = rho / (t_ * speed_ * axis_);
        const double turn = std::arg(dir / dir_);
        dir_ = dir;
        Eigen::Vector2d x(omega_, delta_ + t_ * omega_ - turn);
        Eigen::Matrix2d F;
        F << 1, 0, t_, 1;
        P = F * P * F.transpose();
        P += Eigen::Vector2d(bits(c_.q_omega), bits(c_.q_delta)).asDiagonal();
        const Eigen::RowVector2d H(0, 1);
        const Eigen::Vector2d K = P * H.transpose() / (H * P * H.transpose() + r_);
        x += K * (seen.imag() - x(1));
        P = (Eigen::Matrix2d::Identity() - K * H) * P;
        omega_ = x(0);
        delta_ = x(1);
        return delta_;
    }

    Eigen::Matrix2d P;

  private:
    static double bits(int32_t x)
    {
        return real(x, PM_KALMAN_BITS);
    }
    static Complex direction(const obs_in_t &in)
    {
        return {real(in.dir.cos, 31), real(in.dir.sin, 31)};
    }
    Complex flux(Complex i, int drop) const
    {
        return Complex{L_d_ * i.real() + psi_m_, L_q_ * i.imag()} + drop * half_drop_ * i;
    }

    ekf_reduced_config_t c_;
    double t_, psi_m_, L_d_, L_q_, half_drop_, speed_, omega_, r_, delta_ = 0;
    Complex psi_, dir_, axis_;
};

struct Deviation {
    double angle = 0, covariance = 0;
};

// Seen from a position that is 0.1 rad behind, with noise. The covariance once the gains are below what they
// are held at; the angle once the start, which that prolongs, is forgotten.
template <class Reference, class Functions, class Config>
Deviation deviation(const Config &config, const Machine &m, const Base &b, double omega_pu, Complex i_A)
{
    Rotation rotation(m, b, omega_pu, i_A, 1.0);
    const obs_in_t first = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
    typename Functions::State state;
    Functions::reset(&state, &config, &first);
    Reference reference(config, first);
    samples::Random random;
    Deviation worst;
    for (int k = 0; k < 20000; ++k) {
        rotation.advance();
        const Complex noise = {random.within(-5e-3, 5e-3), random.within(-5e-3, 5e-3)};
        const obs_in_t in = rotation.seen(rotation.theta_rad - 0.1, rotation.omega_rad_s, 0, noise);
        obs_out_t out;
        Functions::step(&state, &config, &in, &out);
        const double expected = reference.step(in);
        if (k < 5000) {
            continue;
        }
        worst.angle = std::max(worst.angle, std::abs(real(out.eps) - expected));
        for (unsigned r = 0; r < reference.P.rows(); ++r) {
            for (unsigned c = 0; c <= r; ++c) {
                const double size = std::sqrt(reference.P(r, r) * reference.P(c, c));
                const double P = real(pm_kalman_at(state.P, r, c), PM_KALMAN_BITS);
                worst.covariance = std::max(worst.covariance, std::abs(P - reference.P(r, c)) / size);
            }
        }
    }
    return worst;
}

TEST(Ekf, FollowsTheReferenceInDoublePrecision)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    for (const double share : {0.05, -0.3, 1.0}) {
        for (const Complex i : {Complex{0, 0}, kRated_A, std::conj(kRated_A)}) {
            const Deviation f = deviation<FullReference, FullFunctions>(bench::ekf_full_config(m, b), m, b,
                                                                        share * kRated_pu, i);
            const Deviation r = deviation<ReducedReference, ReducedFunctions>(bench::ekf_reduced_config(m, b),
                                                                              m, b, share * kRated_pu, i);
            EXPECT_LE(f.angle, kRounding_rad) << share << ' ' << i;
            EXPECT_LE(f.covariance, kCovariance) << share << ' ' << i;
            EXPECT_LE(r.angle, kRounding_rad) << share << ' ' << i;
            EXPECT_LE(r.covariance, kCovariance) << share << ' ' << i;
        }
    }
}

// METHODS.md 12.4.3 and 12.4.4 (e), 5 to 100 % speed, with the noise of the converter alone.
TEST(Ekf, HoldsThePosition)
{
    for (const bool salient : {true, false}) {
        const Machine m = salient ? bench::kIpmLinear : bench::kSpmLinear;
        const Base b = salient ? bench::kIpmBase : bench::kSpmBase;
        for (const double share : {0.05, 0.1, -0.1, 0.3, 1.0, -1.0}) {
            for (const Complex i : {Complex{0, 0}, kRated_A, std::conj(kRated_A)}) {
                const Rotation truth(m, b, share * kRated_pu, i, 1.0);
                EXPECT_LE(Full(bench::ekf_full_config(m, b), b, truth).settled().max, kIdeal_deg)
                    << salient << ' ' << share << ' ' << i;
                EXPECT_LE(Reduced(bench::ekf_reduced_config(m, b), b, truth).settled().max, kIdeal_deg)
                    << salient << ' ' << share << ' ' << i;
            }
        }
    }
}

// Far beyond rated current the flux along d is half a base, against the magnet.
TEST(Ekf, HoldsThePositionWithALargeFluxAlongD)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    for (const Complex i : {Complex{-9.5, 1}, Complex{-9.5, -1}}) {
        EXPECT_GT(std::abs(m.L_d0_H * i.real() / (b.v_V / b.omega_rad_s)), 0.45);
        const Rotation truth(m, b, 0.3 * kRated_pu, i, 1.0);
        EXPECT_LE(Full(bench::ekf_full_config(m, b), b, truth).settled().max, kIdeal_deg) << i;
        EXPECT_LE(Reduced(bench::ekf_reduced_config(m, b), b, truth).settled().max, kIdeal_deg) << i;
    }
}

// The variance of what is measured, in the units of the covariance and within what its arithmetic bears.
TEST(Ekf, MeasurementNoiseIsTheSquareWithinItsLimits)
{
    const auto told = [](int32_t sigma_permille) {
        return ekf_measurement(pm_num_ratio(sigma_permille, 1000), pm_num(1));
    };
    EXPECT_NEAR(real(told(100), PM_KALMAN_BITS), 0.01, 1e-6);
    EXPECT_EQ(told(0), PM_KALMAN_LEAST_R);
    EXPECT_EQ(told(5000), PM_KALMAN_MOST_R);
}

// ekf_reduced.h: from the speed on at which the EMF of a period is the noise, and not below 0.02.
TEST(Ekf, TheReducedFilterSeesFromTheSpeedOfItsNoise)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    drive_params_t p = bench::parameters(m, b);
    p.observer = OBSERVER_ekf_reduced;
    const auto unit = [](drive_param_id_t id) { return std::pow(10, drive_param_exp10[id]); };
    const drive_param_info_t &range = drive_param_table[DRIVE_PARAM_ekf_voltage_noise];
    for (const int32_t told : {range.min, p.ekf_voltage_noise, range.max}) {
        drive_params_t louder = p;
        louder.ekf_voltage_noise = told;
        louder.i_noise = told == range.min ? 1 : p.i_noise;
        drive_config_t c = {};
        const drive_result_t result = drive_configure(&c, &louder, PM_CHANNELS);
        ASSERT_TRUE(result.ok) << drive_param_table[result.param].name << ' ' << result.reason;
        const double v = louder.ekf_voltage_noise * unit(DRIVE_PARAM_ekf_voltage_noise) *
                         louder.v_dc_nominal * unit(DRIVE_PARAM_v_dc_nominal) / b.period_s / 1e4;
        const double i = louder.i_noise * unit(DRIVE_PARAM_i_noise) * m.L_d0_H;
        const double rho = std::sqrt(std::pow(v * b.period_s, 2) + 2 * i * i);
        const double noise = rho / (m.psi_m_Wb * b.omega_rad_s * b.period_s);
        EXPECT_NEAR(real(c.position.observer.ekf_reduced.omega_min), std::max(0.02, noise), 1e-4) << told;
    }
}

// From half a radian, at a tenth of rated speed, whichever way.
TEST(Ekf, FindsThePositionFromFarAway)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    for (const double error : {0.5, -0.5}) {
        const auto found = [&](auto closed) {
            closed.loop.theta_rad -= error;
            return closed.settled(0.3, 0.1).max;
        };
        const Rotation truth(m, b, 0.1 * kRated_pu, kRated_A, 1.0);
        EXPECT_LE(found(Full(bench::ekf_full_config(m, b), b, truth)), 1.0) << error;
        EXPECT_LE(found(Reduced(bench::ekf_reduced_config(m, b), b, truth)), 1.0) << error;
    }
}

// The covariance stays positive definite, whatever the measurements are and however badly the noise is
// chosen: what Joseph's form and the least process noise are for.
template <class Functions, unsigned N, class Config> double least_eigenvalue(Config config)
{
    samples::Random random;
    double least = 1;
    typename Functions::State state;
    obs_in_t in = {};
    in.dir = bench::direction(0);
    Functions::reset(&state, &config, &in);
    for (int k = 0; k < 20000; ++k) {
        const double wild = k % 3000 < 1500 ? 1 : 0.01;
        in.v = bench::ab({random.within(-0.7, 0.7) * wild, random.within(-0.7, 0.7) * wild});
        in.i = bench::ab({random.within(-1.3, 1.3) * wild, random.within(-1.3, 1.3) * wild});
        in.dir = bench::direction(k * random.within(-0.2, 0.2) * wild);
        in.omega = bench::fixed(random.within(-1.9, 1.9) * wild, 28);
        in.i_dq = bench::dq({random.within(-1.3, 1.3) * wild, random.within(-1.3, 1.3) * wild});
        obs_out_t out;
        Functions::step(&state, &config, &in, &out);
        if (k % 10 == 0) {
            Functions::slow(&state, &config, &in, &out, PM_ONE);
        }
        Eigen::Matrix<double, N, N> P;
        for (unsigned r = 0; r < N; ++r) {
            for (unsigned c = 0; c < N; ++c) {
                P(r, c) = pm_kalman_at(state.P, r, c); // in LSB
            }
        }
        if (P.maxCoeff() > 0x1.8p30) {
            return -1;
        }
        least = std::min(least, P.template selfadjointView<Eigen::Lower>().eigenvalues().minCoeff());
    }
    return least;
}

// The state is scaled by 3/4 where its variance is a half or more: the covariances by as much, the variance by its square.
TEST(Ekf, AVarianceThatHasGrownIsHeld)
{
    const int32_t half = 1 << (PM_KALMAN_BITS - 1);
    for (const int32_t variance : {half - 4, half, half + half / 2}) {
        int32_t P[6] = {};
        for (unsigned r = 0; r < 3; ++r) {
            for (unsigned c = 0; c <= r; ++c) {
                P[PM_KALMAN_AT(r, c)] = r == c ? half / 4 : static_cast<int32_t>(1000 + 100 * r + c);
            }
        }
        P[PM_KALMAN_AT(1, 1)] = variance;
        pm_kalman_hold(P, 3, 1);
        const double share = variance < half ? 1 : 0.75;
        EXPECT_NEAR(pm_kalman_at(P, 1, 1), share * share * variance, 2);
        EXPECT_NEAR(pm_kalman_at(P, 1, 0), share * 1100, 1);
        EXPECT_NEAR(pm_kalman_at(P, 2, 1), share * 1201, 1);
        EXPECT_EQ(pm_kalman_at(P, 2, 0), 1200);
        EXPECT_EQ(pm_kalman_at(P, 0, 0), half / 4);
        EXPECT_EQ(pm_kalman_at(P, 2, 2), half / 4);
    }
}

// In a filter: the speed's is not measured.
template <class Functions, class Config>
double after_a_step(const Config &config, unsigned omega, double variance)
{
    typename Functions::State state;
    obs_in_t in = {};
    in.dir = bench::direction(0);
    Functions::reset(&state, &config, &in);
    state.P[PM_KALMAN_AT(omega, omega)] = bench::fixed(variance, PM_KALMAN_BITS);
    obs_out_t out;
    Functions::step(&state, &config, &in, &out);
    return bench::real(pm_kalman_at(state.P, omega, omega), PM_KALMAN_BITS);
}

TEST(Ekf, SpeedThatIsNotSeenKeepsAVarianceBelowAHalf)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    for (const double variance : {0.55, 0.6, 0.66, 0.9, 0.99}) {
        const double most = std::max(0.5, 0.75 * 0.75 * variance);
        EXPECT_LT(after_a_step<FullFunctions>(bench::ekf_full_config(m, b), EKF_OMEGA, variance), most);
        EXPECT_LT(
            after_a_step<ReducedFunctions>(bench::ekf_reduced_config(m, b), EKF_REDUCED_OMEGA, variance),
            most);
    }
}

// The misfit of the reduced filter is how far its speed is from the loop's.
TEST(Ekf, MisfitOfTheReducedFilterIsItsSpeedError)
{
    const ekf_reduced_config_t config = bench::ekf_reduced_config(bench::kIpmLinear, bench::kIpmBase);
    ekf_reduced_t self;
    obs_in_t in = {};
    in.dir = bench::direction(0);
    in.omega = bench::fixed(0.3, 28);
    ekf_reduced_reset(&self, &config, &in);
    for (const double omega : {0.3, 0.35, 0.1, -0.2}) {
        const obs_out_t out = ekf_reduced_last(&self);
        in.omega = bench::fixed(omega, 28);
        self.omega = bench::fixed(0.3, 28);
        ekf_reduced_slow(&self, &config, &in, &out, PM_ONE);
        EXPECT_NEAR(bench::real(ekf_reduced_last(&self).misfit), std::abs(0.3 - omega), 1e-7);
    }
}

TEST(Ekf, TheCovarianceStaysPositive)
{
    const Machine m = bench::kIpmLinear;
    const Base b = bench::kIpmBase;
    for (const double r : {0.0, 1e-3, 0.5}) {       // A
        for (const double q : {0.0, 1.0, 1000.0}) { // times the default; 0: as little as is allowed
            bench::EkfNoise noise;
            noise.current_A = r;
            noise.voltage_V *= q;
            noise.speed_rad_s *= q;
            noise.angle_rad *= q;
            EXPECT_GT((least_eigenvalue<FullFunctions, 4>(bench::ekf_full_config(m, b, noise))), 0.0)
                << r << ' ' << q;
            EXPECT_GT((least_eigenvalue<ReducedFunctions, 2>(bench::ekf_reduced_config(m, b, noise))), 0.0)
                << r << ' ' << q;
        }
    }
}

// A wrong magnet flux: the full filter believes the speed that the EMF's length gives, against the angle; the
// reduced one does not look at it, but for the saliency's part of rho_q.
TEST(Ekf, AWrongMagnetFlux)
{
    const Machine m = bench::kSpmLinear;
    const Base b = bench::kSpmBase;
    for (const double factor : {0.9, 1.1}) {
        auto full = bench::ekf_full_config(m, b);
        auto reduced = bench::ekf_reduced_config(m, b);
        full.model.psi_m = static_cast<pm_q_t>(full.model.psi_m * factor);
        reduced.model.psi_m = full.model.psi_m;
        const Rotation truth(m, b, 0.5 * kRated_pu, {0, 4}, 1.0);
        EXPECT_GT(std::abs(Full(full, b, truth).settled().mean), 3.0); // measured 5.3 and 5.7
        EXPECT_NEAR(Reduced(reduced, b, truth).settled().mean, 0, kIdeal_deg);
    }
}

} // namespace
