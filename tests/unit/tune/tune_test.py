"""tools/tune.py: what it refuses, what it keeps, and motors of many kinds that start with what it chooses.

usage: tune_test.py PMSIM
"""
import math
import random
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
TOOL = ROOT / "tools" / "tune.py"
SCENARIO = Path(__file__).with_name("start.yaml")
SATURATED = Path(__file__).with_name("saturated.yaml")
BRAKE = Path(__file__).with_name("brake.yaml")
BRAKE_LIGHT = Path(__file__).with_name("brake_light.yaml")
OUTRUN = Path(__file__).with_name("outrun.yaml")
PMSIM = None
sys.path.insert(0, str(ROOT / "tools"))
import tune  # noqa: E402

# Name: R_s, L_d, L_q, psi_m, pole pairs, J, rated current, speed, link
MOTORS = {
    "hub motor": (0.11, 0.18e-3, 0.2e-3, 0.022, 15, 0.02, 20, 40, 36),
    "circulator pump on the mains": (285, 0.17, 0.18, 0.08, 4, 4e-5, 0.13, 314, 320),
    "gimbal": (8.0, 3e-3, 3e-3, 14.3e-3, 11, 3e-5, 1.0, 30, 24),
    "2212 drone motor": (0.1, 20e-6, 20e-6, 1.2e-3, 7, 12e-6, 10, 700, 12),
    "scooter": (0.05, 0.11e-3, 0.13e-3, 0.02, 15, 0.06, 35, 70, 48),
    "e-bike, mid drive": (0.06, 80e-6, 100e-6, 8e-3, 8, 2e-4, 25, 250, 36),
    "NEMA-23": (0.4, 0.5e-3, 0.5e-3, 8.2e-3, 4, 1.73e-5, 9, 419, 36),
    "48 V pump": (0.04, 60e-6, 75e-6, 6e-3, 5, 4e-5, 14, 628, 48),
    "60,000 r/min spindle": (0.3, 0.8e-3, 0.8e-3, 0.02, 1, 2e-5, 6, 6283, 310),
    "near round": (0.8, 5e-3, 5.35e-3, 0.1, 3, 6e-4, 8, 314, 310),
    "inverse saliency": (0.9, 7e-3, 5e-3, 0.12, 3, 8e-4, 7, 260, 310),
    "PM-SyRM, saturated": (0.6, 10e-3, 60e-3, 0.15, 2, 4e-3, 10, 157, 310),
    "servo": (1.2, 4e-3, 4.4e-3, 0.06, 4, 1e-4, 4, 314, 160),
    "compressor": (0.35, 6e-3, 11e-3, 0.09, 3, 8e-4, 12, 377, 310),
    "traction, linear": (0.02, 0.2e-3, 0.6e-3, 0.08, 4, 0.05, 150, 300, 350),
    "servo light": (0.23, 0.15e-3, 0.245e-3, 7.4e-3, 10, 1.75e-4, 42, 555, 170),
    "washer, direct drive": (3.0, 16e-3, 18e-3, 0.09, 24, 0.05, 3, 30, 310),
}
C_A_WB5 = {"PM-SyRM, saturated": 1316}  # L_q at rated current is 0.55 of that without


def motor(name):
    R, L_d, L_q, psi, poles, J, i, speed, v = MOTORS[name]
    return {
        "name": name,
        "electrical": {"R_s_ohm": R, "L_d0_H": L_d, "L_q0_H": L_q, "psi_m_Wb": psi, "pole_pairs": poles,
                       **({"c_A_Wb5": C_A_WB5[name]} if name in C_A_WB5 else {})},
        "mechanics": {"J_kgm2": J},
        "rated": {"i_rated_A": i, "speed_rated_rad_s": speed, "v_dc_V": v},
    }


def round_at_rated_current(friction):
    """A PM-SyRM of 6.1 Nm whose rated current leaves L_qh below L_dh; friction in Nm."""
    return {
        "name": "PM-SyRM, round at rated current",
        "electrical": {"R_s_ohm": 0.575, "L_d0_H": 14.29e-3, "L_q0_H": 36.07e-3, "psi_m_Wb": 0.182, "pole_pairs": 2, "c_A_Wb5": 2791},
        "mechanics": {"J_kgm2": 2.6e-3, "T_coulomb_Nm": friction},
        "rated": {"i_rated_A": 11.2, "speed_rated_rad_s": 222, "v_dc_V": 496},
    }


# A PM-SyRM of little magnet: rated current leaves a third of L_q, and the EMF at 27 % of speed is twice what dead time takes.
BRAKES = {
    "name": "PM-SyRM without a load",
    "electrical": {"R_s_ohm": 0.96, "L_d0_H": 3.457e-3, "L_q0_H": 16.77e-3, "psi_m_Wb": 0.0593, "pole_pairs": 4, "c_A_Wb5": 115612},
    "mechanics": {"J_kgm2": 1.054e-3, "T_coulomb_Nm": 0.013},
    "rated": {"i_rated_A": 12, "speed_rated_rad_s": 397, "v_dc_V": 541},
}


class Tune(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.told = Path(self.folder.name) / "motor.yaml"

    def tune(self, told, *words):
        if told is not None:  # else what stands there
            self.told.write_text(told if isinstance(told, str) else yaml.safe_dump(told), encoding="utf-8")
        return subprocess.run([sys.executable, str(TOOL), str(self.told), *words], capture_output=True, text=True, check=False)

    def run_seeds(self, machine, scenario):
        """Three; the exit code and what pmsim says."""
        self.told.write_text(yaml.safe_dump(machine), encoding="utf-8")
        result = subprocess.run([PMSIM, "run", str(scenario), "--set", f"machine={self.told}", "--seeds", "3", "--quiet"],
                                capture_output=True, text=True, check=False)
        return result.returncode, result.stdout + result.stderr

    def runs_into(self, machine, fault):
        """Each of three seeds; NONE: and within all bounds."""
        code, text = self.run_seeds(machine, SCENARIO)
        self.assertEqual(code, 0 if fault == "NONE" else 1, text)
        self.assertRegex(text, rf"fault +{fault} .*median of 3 seeds {fault}")

    def refused(self, told, *what):
        result = self.tune(told)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertEqual(result.stdout, "")
        for word in what:
            self.assertIn(word, result.stderr)
        self.assertLessEqual(len(result.stderr.splitlines()), 2, result.stderr)  # what, and what to do
        self.assertNotIn("Traceback", result.stderr)

    def test_every_value_that_is_needed_is_asked_for(self):
        for section in ("electrical", "mechanics", "rated"):
            for key in motor("servo")[section]:
                for value in (None, 0, -1, "much", float("inf")):
                    told = motor("servo")
                    told[section][key] = value
                    self.refused(told, f"{section}.{key}")
            told = motor("servo")
            del told[section]
            self.refused(told, section)
        told = motor("servo")
        del told["name"]
        self.refused(told, "name")
        self.refused("a: [", "motor.yaml")
        self.refused({**motor("servo"), "drive": 3}, "drive")

    def test_a_mistake_is_named_with_its_place(self):
        """Each is the fifth line of a file that is right without it, or stands in its second."""
        right = ("name: servo\nelectrical: {R_s_ohm: 1.2, L_d0_H: 4e-3, L_q0_H: 4.4e-3, psi_m_Wb: 0.06, pole_pairs: 4}\n"
                 "mechanics: {J_kgm2: 1e-4}\nrated: {i_rated_A: 4, speed_rated_rad_s: 314, v_dc_V: 160}\n")
        self.assertEqual(self.tune(right).returncode, 0)
        for line, what in (("rated: {}", "5:1: key `rated` stands here a second time; first at line 4"),
                           ("drive: {R_s: 1, R_s: 1}", "5:17: key `R_s` stands here a second time; first at line 5"),
                           ("drive: {foo: 1}", "5:14: unknown parameter drive.foo"),
                           ("drive: {flux_bandwith: 1}", "5:24: unknown parameter drive.flux_bandwith; did you mean `flux_bandwidth`?"),
                           ("drive: {R_s: abc}", "5:14: drive.R_s: expected a number, found \"abc\""),
                           ("drive: {commutation: true}", "5:22: drive.commutation: expected a number, found \"true\""),
                           ("drive: {R_s: 1e9}", "5:14: drive.R_s = 1e9 is out of range 0.0001 ... 1000"),
                           ("drive: {pole_pairs: 4.5}", "5:21: drive.pole_pairs = 4.5 cannot be stored: the step is 1"),
                           ("drive: {f_pwm: 20000}", "5:16: drive.f_pwm follows from the inverter: inverter.f_pwm_Hz"),
                           ("drive:", "5:1: drive: a value is missing"),
                           ("sensors: {bits: 12}", "5:10: unknown section `sensors`; did you mean `sensor`?"),
                           ("sensor: {bits: 12.5}", "5:16: sensor.bits = 12.5 is no whole number"),
                           ("---\nname: x", "5:1: expected a single document in the stream")):
            self.refused(right + line + "\n", "motor.yaml:" + what)
        for found, wrong, what in (("pairs: 4}", "pairs: 1.5}", "electrical.pole_pairs = 1.5 is no whole number"),
                                   ("pairs: 4}", "pairs: true}", "electrical.pole_pairs: expected a number, found \"true\""),
                                   ("pairs: 4}", "pairs: 4, c_A_Wb: 3}", "unknown key electrical.c_A_Wb; did you mean `electrical.c_A_Wb5`?"),
                                   ("1.2,", "2e3,", "electrical.R_s_ohm = 2e3 is out of range 0.0001 ... 1000")):
            self.refused(right.replace(found, wrong), "motor.yaml:2:", what)
        self.told.write_bytes(b"name: \xff")
        self.refused(None, "motor.yaml: ", "utf-8")

    def test_kinds_of_numbers_are_those_of_pmsim(self):
        """Each key that is a number here is one there, with the same limits, and all others are refused alike."""
        self.assertEqual(tune.FIELDS["electrical", "pole_pairs"], (1, 50))
        self.assertEqual(tune.FIELDS["winding", "sets"], (1, 2))
        self.assertIsNone(tune.FIELDS["sensor", "shunt"])
        self.assertIsNone(tune.FIELDS["mechanics", "locked"])
        self.assertIn(("sensor", "v_zero_bits"), tune.WHOLE)
        now = subprocess.run([PMSIM, "keys"], stdout=subprocess.PIPE, text=True, check=True).stdout
        self.assertEqual(now, (ROOT / "tools/machine_keys.txt").read_text(encoding="utf-8"), "pmsim keys > tools/machine_keys.txt")

    def test_output_that_is_lost_is_no_success(self):
        self.told.write_text(yaml.safe_dump(motor("servo")), encoding="utf-8")
        with open("/dev/full", "w", encoding="utf-8") as full:
            result = subprocess.run([sys.executable, str(TOOL), str(self.told)], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual((result.returncode, result.stderr), (2, "tools/tune.py: standard output: No space left on device\n"))
        nowhere = Path(self.folder.name) / "none" / "out.yaml"
        result = self.tune(motor("servo"), "-o", str(nowhere))
        self.assertEqual((result.returncode, result.stderr), (2, f"tools/tune.py: {nowhere}: No such file or directory\n"))

    def test_what_cannot_be_is_said(self):
        told = motor("servo")
        told["sensor"] = {"i_full_scale_A": 5}
        self.refused(told, "cannot measure")

    def test_a_link_too_low_for_rated_current_is_warned_of(self):
        """12 ohm and 0.6 A take 7.2 V, 12 V give 6.93. Half of rated current must flow; an open winding has sqrt(3) times the voltage."""
        told = motor("gimbal")
        told["electrical"]["R_s_ohm"] = 12
        told["rated"].update(i_rated_A=0.6, speed_rated_rad_s=20, v_dc_V=12)
        result = self.tune(told)
        self.assertEqual(result.returncode, 0)
        self.assertIn("drive:", result.stdout)
        for word in (f"warning: {self.told}: rated.i_rated_A = 0.6 takes 7.2 V", "rated.v_dc_V = 12 gives 6.93 V, v_dc/sqrt(3)",
                     "drives 0.577 A", "v_dc_V above 12.5"):
            self.assertIn(word, result.stderr)
        told["electrical"]["R_s_ohm"] = 11.5
        self.assertNotIn("at rest", self.tune(told).stderr)
        told["electrical"]["R_s_ohm"] = 23
        self.assertEqual(self.tune(told).returncode, 0)
        told["electrical"]["R_s_ohm"] = 23.2
        self.refused(told, "motor.yaml:", "rated.i_rated_A = 0.6 takes 13.9 V", "v_dc_V above 24.1")
        told["electrical"]["R_s_ohm"], told["winding"] = 19.9, {"connection": "open", "L_0_H": 1e-3}
        self.assertNotIn("at rest", self.tune(told).stderr)

    def test_a_link_too_low_for_rated_speed_is_warned_of(self):
        """EMF 13.2 V at 40 rad/s, 12.12 V with half of rated current against the magnet; 6 V give 3.46, 22 V 12.7."""
        told = motor("hub motor")
        told["rated"]["v_dc_V"] = 6
        result = self.tune(told)
        self.assertEqual(result.returncode, 0)
        self.assertIn("drive:", result.stdout)
        for word in (f"warning: {self.told}: rated.speed_rated_rad_s = 40 has 13.2 V of EMF",
                     "enough for 10.5 rad/s, 11.4 with i_fw_max = 10",
                     "v_dc_V well above 22.9", "speed_rated_rad_s below 10.5"):
            self.assertIn(word, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 2)
        told["rated"]["v_dc_V"] = 22
        self.assertNotIn("EMF", self.tune(told).stderr)
        told["drive"] = {"i_fw_max": 0}
        self.assertIn("enough for 38.5 rad/s", self.tune(told).stderr)

    def test_a_link_too_low_for_rated_torque_at_rated_speed_is_warned_of(self):
        """R i + omega psi of a gimbal motor, whose inductance is small beside R: currents in steps of a twentieth."""
        told = motor("gimbal")
        e, rated = told["electrical"], told["rated"]
        rated["i_rated_A"] = 0.5 * rated["v_dc_V"] / math.sqrt(3) / e["R_s_ohm"]
        for share in (0.5, 0.7):
            rated["speed_rated_rad_s"] = (1 - 0.5 * share) * rated["v_dc_V"] / math.sqrt(3) / (e["pole_pairs"] * e["psi_m_Wb"])
            found = re.search(r"leaves (\d+) % of the torque of rated current\n +v_dc_V of ([\d.]+) for 80%", self.tune(told).stderr)
            self.assertAlmostEqual(float(found[1]), 100 * share, delta=6)
            self.assertAlmostEqual(float(found[2]) / rated["v_dc_V"], 1 - 0.5 * share + 0.4, delta=0.04)
        rated["speed_rated_rad_s"] *= 0.5
        self.assertEqual(self.tune(told).stderr, "")

    def test_motors_on_their_link_have_no_warning(self):
        for name in MOTORS:
            self.assertEqual(self.tune(motor(name)).stderr, "", name)

    def test_the_link_bears_the_energy_of_the_winding(self):
        """3/2 L i^2 with i_max, which a bridge that opens gives back, up to v_dc_max; of most motors the ripple asks for more."""
        told = {"name": "many turns", "electrical": {"R_s_ohm": 1.7, "L_d0_H": 0.052, "L_q0_H": 0.129, "psi_m_Wb": 0.083, "pole_pairs": 20},
                "mechanics": {"J_kgm2": 0.0019}, "rated": {"i_rated_A": 0.52, "speed_rated_rad_s": 21, "v_dc_V": 72}}
        found = yaml.safe_load(self.tune(told).stdout)
        stored_J = 1.5 * 0.129 * found["drive"]["i_max"] ** 2
        borne_J = found["dclink"]["c_F"] * (found["drive"]["v_dc_max"] ** 2 - 72 ** 2)
        self.assertGreater(borne_J, 2 * stored_J)
        self.assertLess(borne_J, 6 * stored_J)

    def drive(self, told, *words):
        return yaml.safe_load(self.tune(told, *words).stdout)["drive"]

    def test_saliency_that_the_tolerance_could_undo_is_not_relied_on(self):
        self.assertEqual(self.drive(motor("compressor"))["start_method"], 0)
        self.assertEqual(self.drive(motor("servo"))["start_method"], 2)
        self.assertEqual(self.drive(motor("servo"), "--tolerance", "0.02")["start_method"], 0)
        self.assertEqual(self.drive(motor("near round"), "--tolerance", "0.1")["start_method"], 2)
        self.assertIn("below L_d", self.tune(motor("inverse saliency")).stdout)
        self.assertEqual(self.tune(motor("servo"), "--tolerance", "2").returncode, 2)

    def test_saturation_is_that_of_the_energy_form(self):
        """IPM-1000's file has the same values from elsewhere."""
        machine = yaml.safe_load((ROOT / "sim_plant" / "machines" / "ipm_1000.yaml").read_text(encoding="utf-8"))
        known = machine.pop("drive")
        found = self.drive(machine)
        for name in ("L_d", "L_q", "L_q_rated", "L_dh_rated", "L_qh_rated", "L_dqh_rated", "cross_half"):
            self.assertAlmostEqual(found[name] / known[name], 1, delta=0.002, msg=name)

    def test_two_bridges_are_told_their_winding(self):
        """The machine files have the same values from elsewhere; pulses and a catch know one bridge."""
        for name, more in (("dtp_400", ("M_d", "M_q")), ("ow_400", ("L_0",))):
            machine = yaml.safe_load((ROOT / "sim_plant" / "machines" / f"{name}.yaml").read_text(encoding="utf-8"))
            known = machine.pop("drive")
            found = self.drive(machine)
            for key in ("R_s", "L_d", "L_q", "L_q_rated", *more):
                self.assertAlmostEqual(found[key] / known[key], 1, delta=0.005, msg=f"{name} {key}")
            self.assertEqual((found["start_method"], found["flying_start"]), (2, 0))
        self.assertNotIn("L_0", self.drive(motor("servo")))

    def test_saturation_that_is_told_gives_the_rest(self):
        told = motor("compressor")
        told["drive"] = {"L_q_rated": 10e-3}
        found = self.drive(told)
        self.assertAlmostEqual(found["L_qh_rated"], 4 * 10e-3 - 3 * 11e-3)
        self.assertEqual(found["flux_gain"], 0.5)
        self.assertLess(found["current_bandwidth"], 10e3 / 10 * 0.65)  # what is left of L_q, 0.64

    def test_a_vector_turns_no_rotor_away(self):
        """psi_m i - (L_q - L_d) i^2, its stiffness, is positive and falls beyond psi_m / (2 (L_q - L_d))."""
        told = motor("PM-SyRM, saturated")
        found, exact = self.drive(told), self.drive(told, "--tolerance", "0")
        self.assertAlmostEqual(found["i_open_loop"], 0.15 / (2 * (exact["L_q"] - exact["L_d"])), places=2)

    def test_of_a_reluctance_machine_no_more_L_q_than_it_has(self):
        for name, share in (("PM-SyRM, saturated", 1.15), ("compressor", 1.0)):
            found, exact = self.drive(motor(name)), self.drive(motor(name), "--tolerance", "0")
            for key in ("L_q", "L_q_rated"):
                self.assertAlmostEqual(exact[key] / found[key], share, delta=0.001, msg=f"{name}, {key}")
            self.assertEqual(found["L_d"], exact["L_d"])
        told = {**motor("PM-SyRM, saturated"), "drive": {"L_q": 60e-3}}
        self.assertEqual(self.drive(told)["L_q"], 60e-3)

    def test_told_more_L_q_than_it_has_a_reluctance_machine_keeps_its_position(self):
        """L_q told 15 % too large, friction 44 % of rated torque. Twin: the drive takes it as told, and loses the position."""
        told = {
            "name": "PM-SyRM with friction",
            "electrical": {"R_s_ohm": 1.128, "L_d0_H": 6.28e-3, "L_q0_H": 1.15 * 24.5e-3, "psi_m_Wb": 0.1164, "pole_pairs": 2,
                           "c_A_Wb5": 8292},
            "mechanics": {"J_kgm2": 1.415e-3, "T_coulomb_Nm": 2.53},
            "rated": {"i_rated_A": 15.7, "speed_rated_rad_s": 217, "v_dc_V": 400},
        }
        careful = yaml.safe_load(self.tune(told).stdout)
        careful["electrical"]["L_q0_H"] = 24.5e-3
        exact = self.drive(told, "--tolerance", "0")
        twin = {**careful, "drive": {**careful["drive"], "L_q": exact["L_q"], "L_q_rated": exact["L_q_rated"]}}
        for machine, fault in ((careful, "NONE"), (twin, "POSITION_LOST")):
            self.runs_into(machine, fault)

    def test_a_machine_that_rated_current_leaves_no_saliency_starts_by_what_less_leaves(self):
        """Friction 47 % of rated torque, L_qh below L_dh at rated current: injection holds the rotor with less. Twin: in open loop
        saliency allows a vector that friction holds."""
        tuned = yaml.safe_load(self.tune(round_at_rated_current(2.88)).stdout)
        self.assertEqual(tuned["drive"]["start_method"], 0)
        self.assertLess(tuned["drive"]["L_qh_rated"], tuned["drive"]["L_dh_rated"])
        twin = {**tuned, "drive": {**tuned["drive"], "start_method": 2}}
        for machine, fault in ((tuned, "NONE"), (twin, "STALL")):
            self.runs_into(machine, fault)

    def test_torque_by_injection_ends_before_the_saliency(self):
        """3.7 degrees. Twin: told 13 mH of L_qh, more than L_dh, it takes 11.7 A in place of 9.5: 7.5 degrees."""
        tuned = yaml.safe_load(self.tune(round_at_rated_current(0.06)).stdout)
        twin = {**tuned, "drive": {**tuned["drive"], "L_qh_rated": 13e-3}}
        code, text = self.run_seeds(tuned, SATURATED)
        self.assertEqual(code, 0, text)
        code, text = self.run_seeds(twin, SATURATED)
        self.assertRegex(text, "FAIL +angle_error_max_deg.* 0 of 3")

    def test_the_emf_at_the_hand_over_is_above_what_is_not_known(self):
        for name in MOTORS:
            tuned = yaml.safe_load(self.tune(motor(name)).stdout)
            d, b, rated = tuned["drive"], tuned["inverter"], tuned["rated"]
            if d["start_method"] == 2 and d["speed_high"] < 0.39 * rated["speed_rated_rad_s"]:
                lost = b["v_switch_V"] + b["dead_time_s"] * b["f_pwm_Hz"] * rated["v_dc_V"]
                emf = d["speed_high"] * d["pole_pairs"] * d["psi_m"]
                self.assertGreater(1.001 * emf, lost + 0.5 * d["R_s"] * d["i_open_loop"], name)

    def test_injection_leads_until_the_emf_stands_out_from_dead_time(self):
        tuned = yaml.safe_load(self.tune(BRAKES).stdout)
        d, b, rated = tuned["drive"], tuned["inverter"], tuned["rated"]
        lost = b["v_switch_V"] + b["dead_time_s"] * b["f_pwm_Hz"] * rated["v_dc_V"]
        self.assertEqual(d["start_method"], 0)
        self.assertAlmostEqual(d["speed_high"] * d["pole_pairs"] * d["psi_m"] / lost, 2.5, delta=0.01)
        self.assertAlmostEqual(d["speed_low"] / d["speed_high"], 0.15 / 0.27, delta=0.001)

    def test_dead_time_leaves_the_emf_of_the_hand_over_to_be_seen(self):
        """A spindle of 310 V and 1 A: 60 kHz would have less ripple, dead time would take more than the EMF at 8 % of the speed."""
        for poles in (1, 2):
            told = motor("60,000 r/min spindle")
            told["electrical"].update(L_d0_H=0.6e-3, L_q0_H=0.6e-3, pole_pairs=poles)
            told["rated"].update(i_rated_A=1.5, speed_rated_rad_s=5300)
            text = self.tune(told).stdout
            board = yaml.safe_load(text)["inverter"]
            self.assertEqual((board["f_pwm_Hz"], board["dead_time_s"]), (40e3, 0.5e-6))
            self.assertGreaterEqual(board["f_pwm_Hz"], 12.6 * 1.5 * poles * 5300 / (2 * math.pi))  # what the drive asks for
            line = next(line for line in text.splitlines() if line.strip().startswith("f_pwm_Hz"))
            self.assertIn("60 kHz would have less ripple, but dead time then takes 19 V", line)

    def test_a_swing_below_dead_time_is_damped_less(self):
        for name in ("hub motor", "60,000 r/min spindle"):
            tuned = yaml.safe_load(self.tune(motor(name)).stdout)
            d, b = tuned["drive"], tuned["inverter"]
            lost = b["v_switch_V"] + b["dead_time_s"] * b["f_pwm_Hz"] * tuned["rated"]["v_dc_V"]
            frequency = math.sqrt(1.5 * d["pole_pairs"] ** 2 * d["psi_m"] * d["i_open_loop"] / d["J"])
            share = d["psi_m"] * frequency / lost
            self.assertEqual(share < 0.4, name != "hub motor")
            self.assertAlmostEqual(d["open_loop_damping"], 0.7 * min(1, share / 0.4), delta=0.001)

    def test_slow_current_control_is_no_swing(self):
        """12 V before 17 mH: 219 Hz, which leave a quarter of a step of the voltage after 1 ms. Twin: with 0.7 the vector yields to what
        is its own."""
        told = {"name": "slow", "electrical": {"R_s_ohm": 0.038, "L_d0_H": 16.6e-3, "L_q0_H": 26.5e-3, "psi_m_Wb": 0.1, "pole_pairs": 1},
                "mechanics": {"J_kgm2": 5.1e-4}, "rated": {"i_rated_A": 1.76, "speed_rated_rad_s": 27.7, "v_dc_V": 11.1}}
        d = self.drive(told)
        self.assertEqual(d["start_method"], 2)
        self.assertLess(d["current_bandwidth"], 250)
        self.assertAlmostEqual(d["open_loop_damping"], 0.4 / 6 * math.exp(2e-3 * math.pi * d["current_bandwidth"]), delta=0.001)
        tuned = yaml.safe_load(self.tune(told).stdout)
        self.runs_into(tuned, "NONE")
        tuned["drive"]["open_loop_damping"] = 0.7
        self.assertEqual(self.run_seeds(tuned, SCENARIO)[0], 1)

    def test_a_field_that_turns_fast_keeps_its_periods(self):
        """13 of a turn at the speed that trips, whatever dead time takes."""
        told = motor("60,000 r/min spindle")
        told["electrical"].update(pole_pairs=2, psi_m_Wb=0.004)
        told["rated"].update(speed_rated_rad_s=6800)
        self.assertEqual(yaml.safe_load(self.tune(told).stdout)["inverter"]["f_pwm_Hz"], 60e3)

    def test_blocks_are_led_by_what_the_terminals_show(self):
        told = motor("2212 drone motor")
        told["drive"] = {"commutation": 1}
        told["inverter"] = {"c_leg_F": 1e-9}
        told["winding"] = {"trapezoid_flat_deg": 120}
        tuned = yaml.safe_load(self.tune(told).stdout)
        d, period_s = tuned["drive"], 1 / tuned["inverter"]["f_pwm_Hz"]
        self.assertEqual((d["start_method"], d["pattern"], d["emf_shape"]), (2, 0, 1))
        self.assertEqual(d["v_terminal_full_scale"], tuned["sensor"]["v_leg_full_scale_V"])
        self.assertEqual(d["six_step_speed"], 70)
        constant_s = 2 * 3 * math.sqrt(1.5 * 20e-6 * 1e-9)  # of the ringing
        self.assertAlmostEqual(d["t_blank"] / constant_s, 4, delta=0.01)
        self.assertLess(d["t_blank"], 0.4 * period_s)
        told["winding"] = {}
        self.assertEqual(self.drive(told)["emf_shape"], 0)
        self.assertNotIn("t_blank", self.drive(motor("2212 drone motor")))

    def test_a_terminal_that_rings_for_long_has_longer_periods(self):
        told = motor("2212 drone motor")
        told["electrical"]["L_d0_H"] = told["electrical"]["L_q0_H"] = 0.1e-3
        told["drive"] = {"commutation": 1}
        for c_leg, f_pwm in ((1e-9, 40e3), (3e-9, 20e3)):
            told["inverter"] = {"c_leg_F": c_leg}
            self.assertEqual(yaml.safe_load(self.tune(told).stdout)["inverter"]["f_pwm_Hz"], f_pwm)

    def test_a_rotor_that_is_there_within_a_few_sectors_is_refused(self):
        told = motor("hub motor")
        told["drive"] = {"commutation": 1}
        told["mechanics"]["J_kgm2"] = 0.05
        self.assertNotEqual(self.tune(told).stdout, "")
        told["mechanics"]["J_kgm2"] = 0.005
        self.refused(told, "sectors", "commutation: 0")

    def test_small_currents_are_whole_steps(self):
        told = motor("gimbal")
        told["rated"]["i_rated_A"] = 0.4
        for name, value in self.drive(told).items():
            if name in ("comp_zone", "i_d_light", "i_open_loop"):
                self.assertAlmostEqual(1000 * value, round(1000 * value), places=6, msg=name)

    def test_five_decades_are_accepted_by_the_drive(self):
        """R_s from milliohms to 1000 ohm, L from microhenries up; with and without saturation to a tenth; a board of the motor's
        own and the drive board, whose channels are 60 A and 34 V."""
        draw = random.Random(5)

        def log(least, most):
            return math.exp(draw.uniform(math.log(least), math.log(most)))

        seen = []
        for n in range(60):
            own = n % 2 == 0
            v, i = (log(12, 800), log(0.1, 600)) if own else (log(12, 24), log(0.5, 24))
            poles, omega = draw.choice((1, 2, 4, 7, 15, 28)), log(60, 6000)
            phase = v / math.sqrt(3)
            R, L_q = phase * log(0.002, 0.2) / i, phase * log(0.03, 0.6) / omega / i
            psi, L_d = phase * log(0.4, 0.9) / omega, L_q * log(0.3, 1.5)
            J = 1.5 * poles * psi * i / (omega / poles) * log(0.003, 0.3)
            told = {
                "name": f"draw {n}",
                "electrical": {"R_s_ohm": R, "L_d0_H": L_d, "L_q0_H": L_q, "psi_m_Wb": psi, "pole_pairs": poles},
                "mechanics": {"J_kgm2": min(J, 900)},
                "rated": {"i_rated_A": i, "speed_rated_rad_s": omega / poles, "v_dc_V": v},
            }
            if n % 4 < 2:
                told["drive"] = {"L_q_rated": max(0.1 * L_q, 1e-6)}
            if not own:
                told["sensor"] = {"i_full_scale_A": 60.16, "v_full_scale_V": 34.28}
            tuned, page = Path(self.folder.name) / f"{n}.yaml", Path(self.folder.name) / f"{n}.bin"
            if psi > 1.4 * 2 or max(L_q, L_d) > 2.2 * 1:  # 2 Wb and 1 H are what the drive stores
                self.refused(told, "and the drive's reaches from")
                continue
            tuned.write_text(self.tune(told).stdout, encoding="utf-8")
            result = subprocess.run([PMSIM, "params", "--machine", str(tuned), "--page", str(page)], capture_output=True, text=True,
                                    check=False)
            with self.subTest(told=told):
                if result.returncode and not own:  # what a board for 34 V and 60 A has no format for is said with the remedy
                    self.assertIn("raise v_dc_min", result.stderr)
                    continue
                self.assertEqual(result.returncode, 0, result.stderr)
                seen += [R, L_q]
        self.assertGreater(len(seen), 2 * 54)
        self.assertGreater(max(seen[0::2]) / min(seen[0::2]), 1e4)
        self.assertGreater(max(seen[1::2]) / min(seen[1::2]), 1e4)

    def test_what_is_told_stands(self):
        told = motor("servo")
        told["inverter"] = {"f_pwm_Hz": 16000, "bootstrap_charge_s": 1e-4}
        told["drive"] = {"current_bandwidth": 321, "L_q": 4.2e-3}
        told["winding"] = {"L_0_H": 1e-5}
        tuned = yaml.safe_load(self.tune(told).stdout)
        for section, keys in told.items():
            if section != "name":
                for key, value in keys.items():
                    self.assertAlmostEqual(float(tuned[section][key]), value, msg=key)
        self.assertEqual(tuned["inverter"]["timer_counts"], round(170e6 / 32000))
        self.assertEqual(tuned["name"], "servo")

    def test_every_choice_has_its_reason(self):
        lines = self.tune(motor("compressor")).stdout.splitlines()
        for line in lines:
            if line.startswith("  "):
                self.assertRegex(line, r"^  \w+: \S+ +# \S")

    def test_no_file_is_written_over(self):
        out = Path(self.folder.name) / "out.yaml"
        self.assertEqual(self.tune(motor("servo"), "-o", str(out)).returncode, 0)
        text = out.read_text(encoding="utf-8")
        again = self.tune(motor("compressor"), "-o", str(out))
        self.assertEqual(again.returncode, 2)
        self.assertIn("already", again.stderr)
        self.assertEqual(out.read_text(encoding="utf-8"), text)

    def test_a_position_is_not_lost_for_braking(self):
        """E-bike: 0.8 of rated torque over J is followed 0.18 rad behind, of which 0.3 counts as lost. Twin: 0.5 rad."""
        tuned = yaml.safe_load(self.tune(motor("e-bike, mid drive")).stdout)
        d = tuned["drive"]
        slope = 0.8 * 1.5 * d["pole_pairs"] ** 2 * d["psi_m"] * d["i_rated"] / d["J"]
        self.assertAlmostEqual(slope / (2 * math.pi * d["flux_bandwidth"]) ** 2, 0.18, delta=0.001)
        code, text = self.run_seeds(tuned, BRAKE)
        self.assertEqual(code, 0, text)
        twin = {**tuned, "drive": {**d, "flux_bandwidth": d["flux_bandwidth"] / math.sqrt(0.5 / 0.18)}}
        code, text = self.run_seeds(twin, BRAKE)
        self.assertRegex(text, "FAIL +angle_error_max_deg.* 0 of 3")

    def test_a_frame_turns_slower_than_saturation_lets_the_current_follow(self):
        """4 degrees. Twin: 43 Hz, for 0.18 rad behind 0.8 of rated torque, in which current control of 275 Hz swings: 26 and more."""
        tuned = yaml.safe_load(self.tune(BRAKES).stdout)
        d = tuned["drive"]
        self.assertLess(d["current_bandwidth"], 0.04 * tuned["inverter"]["f_pwm_Hz"])
        self.assertAlmostEqual(d["flux_bandwidth"], d["current_bandwidth"] / 10, delta=0.01)
        code, text = self.run_seeds(tuned, BRAKE_LIGHT)
        self.assertEqual(code, 0, text)
        code, text = self.run_seeds({**tuned, "drive": {**d, "flux_bandwidth": 42.8}}, BRAKE_LIGHT)
        self.assertRegex(text, "FAIL +angle_error_max_deg.* 0 of 3")

    def test_injection_follows_a_light_rotor_as_far_as_its_noise_lets_it(self):
        """0.8 of rated torque within 0.18 rad, w^2 = 0.8 / 0.18 p T / J, as far as the speed has the noise of the smallest answer that
        leads, of two steps of the converter or four times its noise, with 25 Hz: w^1.5 in proportion to the answer."""
        told = motor("servo light")
        d = self.drive(told)
        needed = math.sqrt(0.8 / 0.18 * 1.5 * 10 ** 2 * 7.4e-3 * 42 / 1.75e-4) / (2 * math.pi)
        self.assertAlmostEqual(d["injection_bandwidth"], d["flux_bandwidth"], delta=0.01)
        self.assertAlmostEqual(d["injection_bandwidth"], min(needed, 120), delta=0.01)
        told["sensor"] = {"noise_lsb": 4.0}
        noisy = self.drive(told)
        board = yaml.safe_load(self.tune(told).stdout)
        answer = noisy["v_injection"] * (1 / noisy["L_d"] - 1 / noisy["L_q"]) / (2 * board["inverter"]["f_pwm_Hz"])
        smallest = 4 * 4.0 * 2 * board["sensor"]["i_full_scale_A"] / 4096
        self.assertAlmostEqual(noisy["injection_bandwidth"], 25 * (answer / smallest) ** (2 / 3), delta=0.1)
        self.assertLess(noisy["injection_bandwidth"], 0.7 * d["injection_bandwidth"])
        told["drive"] = {"injection": 2}  # another source, whose window bounds it
        self.assertEqual(self.drive(told)["injection_bandwidth"], 25)
        del told["drive"]
        told["mechanics"]["J_kgm2"] = 0.2  # which nothing moves so fast
        self.assertEqual(self.drive(told)["injection_bandwidth"], 25)

    def test_a_light_rotor_that_a_load_tears_away_is_lost_at_once(self):
        code, text = self.run_seeds(yaml.safe_load(self.tune(motor("servo light")).stdout), OUTRUN)
        self.assertEqual(code, 0, text)

    def test_a_motor_beyond_what_the_drive_stores_is_refused(self):
        """Two pole pairs for 400 V and 280 r/min: 6.2 Wb, and the drive's parameter ends at 2."""
        told = motor("servo")
        told["electrical"]["psi_m_Wb"] = 6.2
        told["rated"].update(speed_rated_rad_s=30, v_dc_V=650)
        self.refused(told, "psi_m is 6.2 Wb, and the drive's reaches from 0.0001 to 2")

    def test_speed_control_is_as_fast_as_a_light_rotor_needs(self):
        """A sixth of the position's loop, which README names, where that is beyond 10 Hz and the rotor's time asks for it."""
        d = self.drive(motor("NEMA-23"))
        self.assertGreater(d["speed_bandwidth"], 15)
        self.assertAlmostEqual(d["speed_bandwidth"], d["flux_bandwidth"] / 6, places=1)
        self.assertLess(self.drive(motor("scooter"))["speed_bandwidth"], 10)

    def test_a_wire_that_is_off_shows_at_light_load(self):
        """Within twice the zone in which a leg's capacitance turns the edges, 1.7 C v / t, no wire is looked for."""
        told = motor("servo")
        for C, i in ((0.5e-9, 0.4), (2e-9, 1.1 * 2 * 1.7 * 2e-9 * 160 / 2e-6), (5e-9, 0.8)):  # a tenth and a fifth of 4 A
            told["inverter"] = {"dead_time_s": 2e-6, "c_leg_F": C}
            self.assertAlmostEqual(self.drive(told)["i_d_light"], i, delta=0.001)

    def test_what_turns_slowly_is_given_time_and_a_gain_that_fits(self):
        told = motor("scooter")
        self.assertEqual(self.drive(told)["t_align"], 0.5)
        told["mechanics"]["J_kgm2"] = 6.0  # with its rider
        d = self.drive(told)
        swing = math.sqrt(1.5 * 15 ** 2 * 0.02 * d["i_open_loop"] / 6.0)
        self.assertAlmostEqual(d["t_align"], 3 * 2 * math.pi / swing, delta=0.01)
        gain = 2 * math.pi * d["speed_bandwidth"] * 6.0 / (1.5 * 15 ** 2 * 0.02) * 15 * d["speed_trip"] / 100
        self.assertLess(gain, 32)  # the drive's format, in bases of 100 A and speed_trip
        told["drive"] = {**d}
        self.told.write_text(yaml.safe_dump(yaml.safe_load(self.tune(told).stdout)), encoding="utf-8")
        result = subprocess.run([PMSIM, "params", "--machine", str(self.told), "--page", str(self.told.with_suffix(".bin"))],
                                capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_more_than_the_drive_can_turn_is_said(self):
        told = motor("2212 drone motor")
        told["rated"]["speed_rated_rad_s"] = 3000
        self.refused(told, "60 kHz")

    def test_blocks_start_on_terminals_that_ring_as_told(self):
        """Q = 3. Twin: terminals without a loss, which ring on."""
        told = {"name": "EC 45", "electrical": {"R_s_ohm": 0.515, "L_d0_H": 0.28e-3, "L_q0_H": 0.29e-3, "psi_m_Wb": 2.42e-3, "pole_pairs": 8},
                "mechanics": {"J_kgm2": 1.35e-5}, "rated": {"i_rated_A": 2.6, "speed_rated_rad_s": 550, "v_dc_V": 24},
                "drive": {"commutation": 1}}
        tuned = yaml.safe_load(self.tune(told).stdout)
        self.assertAlmostEqual(tuned["winding"]["r_winding_ohm"], 2 * math.sqrt(1.5 * 0.28e-3 / 2e-9), delta=1)
        self.runs_into(tuned, "NONE")
        twin = {key: value for key, value in tuned.items() if key != "winding"}
        code, text = self.run_seeds(twin, SCENARIO)
        self.assertEqual(code, 1, text)

    def test_a_tuned_file_is_tuned_to_itself(self):
        once = yaml.safe_load(self.tune(motor("compressor")).stdout)
        twice = yaml.safe_load(self.tune(once).stdout)
        self.assertEqual(once, twice)

    def test_it_is_a_command_of_pmsim(self):
        self.told.write_text(yaml.safe_dump(motor("servo")), encoding="utf-8")
        result = subprocess.run([PMSIM, "tune", str(self.told), "--tolerance", "0.02"], capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout, self.tune(motor("servo"), "--tolerance", "0.02").stdout)
        result = subprocess.run([PMSIM, "tune", "--help"], capture_output=True, text=True, check=False)
        self.assertIn("--tolerance", result.stdout)

    def test_motors_of_many_kinds_start(self):
        for name in MOTORS:
            with self.subTest(name):
                tuned = Path(self.folder.name) / f"{len(name)}.yaml"
                tuned.write_text(self.tune(motor(name)).stdout, encoding="utf-8")
                result = subprocess.run([PMSIM, "run", str(SCENARIO), "--set", f"machine={tuned}", "--jobs", "1", "--quiet"],
                                        capture_output=True, text=True, check=False)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    PMSIM = sys.argv.pop(1)
    unittest.main()
