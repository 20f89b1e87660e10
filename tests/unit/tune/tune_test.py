"""tools/tune.py: what it refuses, what it keeps, and motors of many kinds that start with what it chooses.

usage: tune_test.py PMSIM
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
TOOL = ROOT / "tools" / "tune.py"
SCENARIO = Path(__file__).with_name("start.yaml")
PMSIM = None

# Name: R_s, L_d, L_q, psi_m, pole pairs, J, rated current, speed, link
MOTORS = {
    "hub motor": (0.11, 0.18e-3, 0.2e-3, 0.022, 15, 0.02, 20, 40, 36),
    "2212 drone motor": (0.1, 20e-6, 20e-6, 1.2e-3, 7, 12e-6, 10, 700, 12),
    "servo": (1.2, 4e-3, 4.4e-3, 0.06, 4, 1e-4, 4, 314, 160),
    "compressor": (0.35, 6e-3, 11e-3, 0.09, 3, 8e-4, 12, 377, 310),
    "traction, linear": (0.02, 0.2e-3, 0.6e-3, 0.08, 4, 0.05, 150, 300, 350),
    "washer, direct drive": (3.0, 16e-3, 18e-3, 0.09, 24, 0.05, 3, 30, 310),
}


def motor(name):
    R, L_d, L_q, psi, poles, J, i, speed, v = MOTORS[name]
    return {
        "name": name,
        "electrical": {"R_s_ohm": R, "L_d0_H": L_d, "L_q0_H": L_q, "psi_m_Wb": psi, "pole_pairs": poles},
        "mechanics": {"J_kgm2": J},
        "rated": {"i_rated_A": i, "speed_rated_rad_s": speed, "v_dc_V": v},
    }


class Tune(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.told = Path(self.folder.name) / "motor.yaml"

    def tune(self, told, *words):
        self.told.write_text(told if isinstance(told, str) else yaml.safe_dump(told), encoding="utf-8")
        return subprocess.run([sys.executable, str(TOOL), str(self.told), *words], capture_output=True, text=True, check=False)

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

    def test_what_cannot_be_is_said(self):
        told = motor("servo")
        told["electrical"]["L_q0_H"] = 3e-3
        self.refused(told, "L_q is below L_d", "mean")
        told = motor("servo")
        told["sensor"] = {"i_full_scale_A": 5}
        self.refused(told, "cannot measure")

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

    def test_a_tuned_file_is_tuned_to_itself(self):
        once = yaml.safe_load(self.tune(motor("compressor")).stdout)
        twice = yaml.safe_load(self.tune(once).stdout)
        self.assertEqual(once, twice)

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
