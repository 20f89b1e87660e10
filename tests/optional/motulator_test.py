"""The plant beside the machine model of motulator, a simulator of electric drives by another group.

usage: motulator_test.py PMSIM FOLDER     FOLDER: environment with motulator, made if it is not there

One second of `pmsim plant` and of motulator's Drive (SynchronousMachine with StiffMechanicalSystem or
ExternalRotorSpeed), which see the same phase voltages, held for 100 us each. Motulator's own simulation loop uses
SciPy's default tolerance of 1e-3, so its equations are integrated here, by SciPy's DOP853 at 1e-10. Machines: linear;
the energy form of METHODS.md 0.2 E1; a table sampled from it; a reluctance machine of motulator's examples whose
currents are formulas of its fluxes, given to pmsim as such.

Exit code 0: all within bounds; 1: not; 77: motulator could not be installed (no connection). Optional, because it
installs from the Python registry: `cmake --preset host-release -DPM_MOTULATOR=ON`, then `ctest -L optional`.
"""
import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import python_environment  # noqa: E402

if __name__ == "__main__":
    python_environment.enter("motulator", sys.argv[2])

import numpy as np  # noqa: E402
from motulator.drive import model  # noqa: E402
from motulator.drive.utils import SynchronousMachinePars  # noqa: E402
from scipy.integrate import solve_ivp  # noqa: E402

STEP_S = 100e-6
STEPS = 10000
START_RAD = 0.7
# Bounds of the project for one second beside any reference: currents relative to rated, angle in radians.
BOUND_CURRENT = 1e-4
BOUND_ANGLE = 1e-4
TURN = np.exp(1j * 2 * np.pi / 3)


class Machine:
    """Numbers of a machine, its currents as a function of its fluxes if it saturates, and how pmsim is told."""

    def __init__(self, name, rated_A, pole_pairs, R_s, J, B, electrical, extra=""):
        self.name, self.rated_A, self.pole_pairs, self.R_s, self.J, self.B = name, rated_A, pole_pairs, R_s, J, B
        self.L_d, self.L_q, self.psi_m = None, None, 0.0
        self.current = None
        self.gain_ohm = 0.0  # of the voltages' feedback
        self.electrical, self.extra = electrical, extra

    def yaml(self):
        return (
            f"name: {self.name}\n"
            f"electrical: {{R_s_ohm: {self.R_s}, pole_pairs: {self.pole_pairs}, {self.electrical}}}\n"
            f"mechanics: {{J_kgm2: {self.J}, B_Nms: {self.B}}}\n"
            f"{self.extra}"
        )

    def parameters(self):
        return SynchronousMachinePars(n_p=self.pole_pairs, R_s=self.R_s, L_d=self.L_d, L_q=self.L_q, psi_f=self.psi_m)


def linear():
    """2.2 kW interior machine of motulator's examples."""
    L_d, L_q, psi_m = 36e-3, 51e-3, 0.545
    m = Machine("linear", 6.08, 3, 3.6, 0.015, 1e-3, f"L_d0_H: {L_d}, L_q0_H: {L_q}, psi_m_Wb: {psi_m}")
    m.L_d, m.L_q, m.psi_m, m.gain_ohm = L_d, L_q, psi_m, 45.0
    return m


# IPM-1000, METHODS.md section 14
L_D0, L_Q0, C, PSI_M = 46.3e-3, 76.9e-3, 105.0, 0.236


def energy_form_current(psi):
    saturation = C * abs(psi) ** 4
    i_f = PSI_M * (1 / L_D0 + C * PSI_M**4)
    return psi.real * (1 / L_D0 + saturation) - i_f + 1j * psi.imag * (1 / L_Q0 + saturation)


def energy_form():
    m = Machine(
        "energy_form", 4.0, 3, 6.0, 0.01, 1e-3, f"L_d0_H: {L_D0}, L_q0_H: {L_Q0}, c_A_Wb5: {C}, psi_m_Wb: {PSI_M}"
    )
    m.current, m.psi_m, m.gain_ohm = energy_form_current, PSI_M, 60.0
    return m


def energy_form_flux(i, psi):
    """The flux of a current by Newton's method, from a flux nearby."""
    for _ in range(100):
        miss = i - energy_form_current(psi)
        square, d, q = abs(psi) ** 2, psi.real, psi.imag
        cross = 4 * C * square * d * q
        tangent = [
            [1 / L_D0 + C * square * (square + 4 * d * d), cross],
            [cross, 1 / L_Q0 + C * square * (square + 4 * q * q)],
        ]
        step = complex(*np.linalg.solve(tangent, [miss.real, miss.imag]))
        psi += step * min(1.0, 0.1 / max(abs(step), 1e-300))
        if abs(step) < 1e-15:
            break
    assert abs(i - energy_form_current(psi)) < 1e-10, f"no flux found for {i} A"
    return psi


def write_table(path):
    """Fluxes of the energy form over currents of -8 ... 8 A."""
    grid = np.linspace(-8.0, 8.0, 33)
    rows = ["i_d_A,i_q_A,psi_d_Vs,psi_q_Vs"]
    for i_d in grid:
        psi = complex(PSI_M)
        for i_q in grid:
            psi = energy_form_flux(complex(i_d, i_q), psi)
            rows.append(",".join(repr(float(x)) for x in (i_d, i_q, psi.real, psi.imag)))
    path.write_text("\n".join(rows) + "\n", encoding="ascii")


def table(folder):
    write_table(folder / "map.csv")
    m = energy_form()
    m.name, m.electrical, m.extra = "table", "", "flux_map: {table: map.csv}\n"
    return m


def reluctance_current(psi):
    """6.7 kW synchronous reluctance machine of motulator's examples."""
    d, q = abs(psi.real), abs(psi.imag)
    i_d = (17.4 + 373.0 * d**5 + 560.0 * d * q**2) * psi.real
    i_q = (52.1 + 658.0 * q + 1120.0 / 3.0 * d**3) * psi.imag
    return i_d + 1j * i_q


def closed_form():
    # With the inertia of a load, so that a second at rated current does not take it beyond its rated speed.
    m = Machine("closed_form", 21.9, 2, 0.54, 0.05, 1e-3, "", (
        "flux_map:\n"
        '  i_d_A: "(17.4 + 373*abs(psi_d)^5 + 560*abs(psi_d)*psi_q^2)*psi_d"\n'
        '  i_q_A: "(52.1 + 658*abs(psi_q) + 1120/3*abs(psi_d)^3)*psi_q"\n'
        "  i_max_A: 45\n"
    ))
    m.current, m.gain_ohm = reluctance_current, 12.0
    return m


def target(t_s):
    """d and q current of the run, relative to rated."""
    if t_s < 0.3:
        return 0.75j - 0.25
    return 0.25 - 1.0j if t_s < 0.6 else 0.6j - 0.6


def imposed_speed(t_s):
    return 20.0 + 150.0 * t_s if t_s < 0.5 else 95.0 - 200.0 * (t_s - 0.5)


class Motulator:
    """Motulator's drive on given voltages: with a link of 1 V the switching vector is the voltage."""

    def __init__(self, machine, free):
        self.machine, self.free = machine, free
        self.load_Nm = 0.0
        converter = model.VoltageSourceConverter(u_dc=1.0)
        motor = model.SynchronousMachine(machine.parameters(), i_s=machine.current, psi_s0=machine.psi_m)
        motor.state.exp_j_theta_m = np.exp(1j * START_RAD)
        if free:
            mechanics = model.StiffMechanicalSystem(J=machine.J, B_L=machine.B, tau_L=lambda t: self.load_Nm)
        else:
            mechanics = model.ExternalRotorSpeed(w_M=imposed_speed)
        self.drive = model.Drive(converter, motor, mechanics)

    def speed(self, t_s):
        return complex(self.drive.mechanics.state.w_M).real if self.free else imposed_speed(t_s)

    def voltage(self, t_s):
        """Brings the currents near their target, in the stator's frame."""
        motor = self.drive.machine
        omega = self.machine.pole_pairs * self.speed(t_s)
        error = self.machine.rated_A * target(t_s) - motor.i_s
        u = self.machine.gain_ohm * error + self.machine.R_s * motor.i_s + 1j * omega * motor.state.psi_s
        return u * motor.state.exp_j_theta_m

    def advance(self, t_s, u):
        self.drive.converter.inp.q_cs = u
        run = solve_ivp(self.drive.rhs, (t_s, t_s + STEP_S), self.drive.get_initial_values(), method="DOP853",
                        rtol=1e-10, atol=1e-12)
        assert run.success, run.message
        self.drive.set_states(run.y[:, -1])

    def row(self):
        motor = self.drive.machine
        i = motor.i_s * motor.state.exp_j_theta_m
        return [(i / TURN**k).real for k in range(3)] + [np.angle(motor.state.exp_j_theta_m), motor.tau_M]


def run_motulator(machine, free):
    """The inputs for pmsim, and phase currents, angle and torque at the rows."""
    other = Motulator(machine, free)
    inputs, rows = [], []
    for k in range(STEPS + 1):
        t_s = k * STEP_S
        if free and k == STEPS * 4 // 5:
            other.load_Nm = 0.5
        u = other.voltage(t_s)
        phases = [(u / TURN**n).real for n in range(3)]
        inputs.append([t_s, *phases, other.load_Nm if free else imposed_speed(t_s)])
        rows.append(other.row())
        if k < STEPS:
            other.advance(t_s, u)
    rows = np.array(rows, dtype=float)
    rows[:, 3] = np.unwrap(rows[:, 3])
    return inputs, rows


def run_pmsim(pmsim, folder, machine, free, inputs):
    (folder / "machine.yaml").write_text(machine.yaml(), encoding="utf-8")
    with (folder / "in.csv").open("w", encoding="ascii", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", "va_V", "vb_V", "vc_V", "load_Nm" if free else "omega_mech_rad_s"])
        writer.writerows([[repr(float(x)) for x in row] for row in inputs])
    command = [pmsim, "plant", folder / "machine.yaml", "--input", folder / "in.csv", "--out", folder / "out.csv",
               "--set", f"start.theta_e_deg={float(np.degrees(START_RAD))!r}"]
    result = subprocess.run([str(x) for x in command], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"pmsim plant failed:\n{result.stderr}")
    with (folder / "out.csv").open(encoding="ascii") as file:
        names = ("ia_A", "ib_A", "ic_A", "theta_e_rad", "torque_Nm", "omega_mech_rad_s")
        return np.array([[float(row[name]) for name in names] for row in csv.DictReader(file)])


def report(name, value, bound, unit):
    """One figure; also as a line for docs/plant.md, as tests/reference/measured.h does it."""
    held = value <= bound
    print(f"{'PASS' if held else 'FAIL'}  {name:40s} {value:9.2e}  bound {bound:g} {unit}", flush=True)
    file = os.environ.get("PMDRIVE_MEASURED")
    if file:
        with open(file, "a", encoding="utf-8") as lines:
            lines.write(f"{name},{value:.3g},{bound:g},{unit},0.1\n")
    return held


def compare(pmsim, folder, machine, free):
    inputs, theirs = run_motulator(machine, free)
    ours = run_pmsim(pmsim, folder, machine, free, inputs)
    off = np.max(np.abs(ours[:, :5] - theirs), axis=0)
    assert np.max(np.abs(theirs[:, :3])) > 0.75 * machine.rated_A, "there was hardly any current"
    assert np.ptp(theirs[:, 3]) > 6.0 and np.max(np.abs(ours[:, 5])) > 20.0, "the rotor hardly turned"
    name = f"motulator_{machine.name}_{'free' if free else 'imposed'}"
    held = report(f"{name}_current", np.max(off[:3]) / machine.rated_A, BOUND_CURRENT, "of_rated")
    return report(f"{name}_angle", off[3], BOUND_ANGLE, "rad") and held


def main():
    pmsim = Path(sys.argv[1]).absolute()
    held = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for machine in (linear(), energy_form(), table(folder), closed_form()):
            for free in (False, True):
                held = compare(pmsim, folder, machine, free) and held
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    main()
