"""tests/scenario/demo.yaml fits every machine of sim_plant/machines that the firmware can run, and says which it is.

usage: demo_test.py PMSIM
"""
import re
import subprocess
import sys
import unittest
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
# Block commutation has a demonstration of its own: tests/scenario/bldc_demo.yaml.
MACHINES = sorted(path for path in (ROOT / "sim_plant" / "machines").glob("*.yaml") if "commutation:" not in path.read_text())
DEMO = ROOT / "tests" / "scenario" / "demo.yaml"
CANNOT = re.compile(r"drive\.\w+ is missing")
PMSIM = None


def run(*words):
    return subprocess.run([PMSIM, "run", str(DEMO), "--jobs", "1", *words], capture_output=True, text=True, check=False)


class Demo(unittest.TestCase):
    def test_every_machine_that_can_be_run_passes_under_its_name(self):
        ran = []
        for machine in MACHINES:
            with self.subTest(machine.name):
                result = run("--set", f"machine={machine}")
                if result.returncode == 2:
                    self.assertRegex(result.stderr, CANNOT)
                    continue
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
                self.assertIn(yaml.safe_load(machine.read_text(encoding="utf-8"))["name"], result.stdout.splitlines()[0])
                ran.append(machine.stem)
        self.assertGreaterEqual(len(ran), 8, ran)

    def test_times_of_the_default_machine_are_those_of_the_picture(self):
        result = run()
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("IPM-1000", result.stdout.splitlines()[0])
        self.assertIn("1 run, 5 s simulated", result.stdout)
        self.assertRegex(result.stdout, r"angle_error_max_deg +\S+ +<= 12 deg")

    def test_a_motor_that_accelerates_slowly_is_given_the_time(self):
        estun = ROOT / "sim_plant" / "machines" / "estun_emj04apb22.yaml"
        for acceleration in (2500, 100):
            result = run("--set", f"machine={estun}", "--set", f"acceleration={acceleration}")
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    PMSIM = sys.argv.pop(1)
    unittest.main()
