// The machine of a plant_config_t in the terms of METHODS.md 1.3.1.1.
#include "tests/reference/phase_machine.h"

#include <utility>

namespace reference
{

namespace
{

std::vector<Harmonic> listed(const plant_harmonic_t from[], int count)
{
    std::vector<Harmonic> to;
    for (int n = 0; n < count; n++) {
        if (from[n].order != 0) {
            to.push_back({from[n].order, from[n].amplitude, from[n].phase_rad});
        }
    }
    return to;
}

// L_d = L_s0 - M_s0 - (L_s2/2 + M_s2), L_q with +, L_0 = L_s0 + 2 M_s0, dL_0 = L_s2 - M_s2, and alike for the
// sine terms, which leave L_dq alone: L_c/2 + M_c = 0.
void set_inductances(PhaseParameters &p, double L_d_H, double L_q_H, const plant_winding_t &w)
{
    double mean_H = 0.5 * (L_d_H + L_q_H);
    double half_H = 0.5 * (L_q_H - L_d_H);
    p.L_s0_H = (w.L_0_H + 2.0 * mean_H) / 3.0;
    p.M_s0_H = (w.L_0_H - mean_H) / 3.0;
    p.L_s2_H = (half_H + w.dL_0_H) / 1.5;
    p.M_s2_H = p.L_s2_H - w.dL_0_H;
    p.L_c_H = w.L_c0_H * 2.0 / 3.0;
    p.M_c_H = p.L_c_H - w.L_c0_H;
}

void set_asymmetry(PhaseParameters &p, double R_s_ohm, const plant_winding_t &w)
{
    p.R_ohm.resize(p.phases);
    p.emf_gain.resize(p.phases);
    p.emf_shift_rad.resize(p.phases);
    p.L_added_H = Matrix::Zero(p.phases, p.phases);
    for (int k = 0; k < p.phases; k++) {
        int set = k / 3;
        int next = 3 * set + (k + 1) % 3;
        p.R_ohm(k) = R_s_ohm + w.dR_ohm[k];
        p.emf_gain(k) = w.emf_gain[k];
        p.emf_shift_rad(k) = w.emf_shift_rad[k];
        p.L_added_H(k, k) += w.dL_H[k];
        p.L_added_H(k, next) += w.dM_H[set][k % 3]; // AB, BC, CA
        p.L_added_H(next, k) += w.dM_H[set][k % 3];
    }
}

} // namespace

PhaseParameters phase_parameters(const plant_config_t &config, std::optional<FluxMap> core)
{
    const plant_winding_t &w = config.winding;
    PhaseParameters p;
    p.phases = w.sets == 2 ? 6 : 3;
    p.open = w.connection == PLANT_OPEN;
    p.pole_pairs = config.machine.pole_pairs;
    p.M_d_H = w.M_d_H;
    p.M_q_H = w.M_q_H;
    p.magnet = listed(w.emf, PLANT_HARMONICS);
    p.saliency = listed(w.saliency, PLANT_HARMONICS);
    p.zero_saliency = listed(w.zero_saliency, PLANT_HARMONICS);
    p.cogging = listed(w.cogging, PLANT_HARMONICS);
    if (core) {
        set_inductances(p, 0.0, 0.0, w);
        p.core_psi_m_Wb = (*core)(Eigen::Vector2d::Zero(), 0.0).psi_Wb(0);
        p.core = std::move(core);
    } else {
        set_inductances(p, config.machine.L_d0_H, config.machine.L_q0_H, w);
        p.magnet.push_back({1, config.machine.psi_m_Wb, 0.0});
    }
    set_asymmetry(p, config.machine.R_s_ohm, w);
    p.L_eddy_d_H = w.L_eddy_d_H;
    p.L_eddy_q_H = w.L_eddy_q_H;
    p.R_eddy_ohm = w.R_eddy_ohm;
    p.J_kgm2 = config.mech.J_kgm2;
    p.B_Nms = config.mech.B_Nms;
    return p;
}

} // namespace reference
