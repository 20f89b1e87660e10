"""tools/pmdrive/pmdrive/carrier.py: what it predicts is what the scenarios quantisation, safe_area and carrier_choice hold the drive to."""
import math
import sys
import unittest
import unittest.mock
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tools"))
import tune  # noqa: E402

carrier = tune.carrier
SPEED = 0.05  # of rated, in the scenarios


def machine(name):
    return yaml.safe_load((ROOT / "sim_plant" / "machines" / f"{name}.yaml").read_text(encoding="utf-8"))


def scenario(name):
    text = yaml.safe_load((ROOT / "tests" / "scenario" / f"{name}.yaml").read_text(encoding="utf-8"))
    return {case["name"]: case for case in text["cases"]}


def parameters(x, **changes):
    d = {key: float(value) for key, value in x["drive"].items()}
    d.update(tune.from_board(x, {}, {}))
    d.update(f_injection=500.0, speed_bandwidth=2.0)
    return {**d, **changes}


def holds(x, way=1, gain=1.0, **changes):
    d = parameters(x, **changes)
    omega = SPEED * float(x["rated"]["speed_rated_rad_s"]) * d["pole_pairs"]
    return carrier.Holds(d, lambda a, b: tune.current(x, a, b)[0], lambda a, b: tune.flux(x, a, b)[0],
                         float(x["electrical"]["R_s_ohm"]), way * omega, gain, changes["injection"] == carrier.STATIONARY)


class Carrier(unittest.TestCase):
    def test_noise_is_what_the_scenario_is_bounded_by(self):
        x = machine("ipm_1000")
        for name, case in scenario("quantisation").items():
            d = parameters(x, injection=case["injection"], v_injection=case["v"], injection_bandwidth=case["loop"])
            rms = carrier.noise_deg(d, bits=case["bits"])
            self.assertAlmostEqual(case["least"] * 1.3 / rms, 1, delta=0.01, msg=name)
            self.assertAlmostEqual(case["most"] / 1.3 / rms, 1, delta=0.01, msg=name)

    def test_boundaries_lie_15_percent_from_the_scenario(self):
        """Its cases say their current in their name."""
        x = machine("ipm_1000")
        for name, case in scenario("safe_area").items():
            current = float(name.split()[-2])
            for way in (1, -1):
                most = 6.0
                edge = holds(x, way, injection=case["injection"], v_injection=case["v"], injection_bandwidth=case["loop"],
                             injection_filter=case["filter"]).boundary(most, way, 0.05)
                if "twin" in name:
                    self.assertGreater(current, 1.13 * edge, name)
                else:
                    self.assertLess(current, 0.88 * edge, name)

    def test_the_answer_in_steps_of_the_converter_shows_no_boundary(self):
        """I_n of eight steps and more everywhere, also where the position is lost."""
        x = machine("ipm_1000")
        d = parameters(x, injection=4, v_injection=35.0, injection_bandwidth=24.0)
        for i_q in (0.0, 1.0, 2.0, 3.0, 4.0):
            L = tune.flux(x, carrier.i_d_of(d, i_q), i_q)[1]
            I_n = carrier.slope_sequence(L, carrier.flux_of(d)) / 2
            self.assertGreater(I_n / (20 / 4096), 8)
        self.assertFalse(holds(x, injection=4, v_injection=35.0, injection_bandwidth=24.0).run(3.4)[0])

    def test_it_is_the_second_loop_through_the_window(self):
        """It goes away with a slower position loop, with more voltage, with a shorter window of the same flux, and with the low-pass."""
        x = machine("ipm_1000")
        weak = {"injection": 4, "v_injection": 35.0, "injection_bandwidth": 20.0}
        edge = holds(x, **weak).boundary(6.0)
        self.assertGreater(holds(x, **{**weak, "injection_bandwidth": 10.0}).boundary(6.0), 1.5 * edge)
        self.assertGreater(holds(x, **{**weak, "v_injection": 70.0}).boundary(6.0), 1.4 * edge)
        self.assertGreater(holds(x, **{**weak, "v_injection": 70.0, "f_injection": 1000.0}).boundary(6.0), 1.2 * edge)
        self.assertLess(holds(x, gain=2.0, **weak).boundary(6.0), 0.6 * edge)
        self.assertLess(holds(x, injection_filter=1000.0, **weak).boundary(6.0), 0.6 * edge)

    def test_start_values_on_spm_400_are_lost_and_twelve_volts_hold(self):
        x = machine("spm_400")
        weak = {"injection": 4, "v_injection": 4.0, "injection_bandwidth": 28.0}
        self.assertEqual(holds(x, **weak).boundary(4.0), 0.0)
        self.assertTrue(holds(x, **{**weak, "v_injection": 12.0}).run(4.0)[0])

    def test_the_tool_chooses_what_the_scenario_runs_with(self):
        cases = scenario("carrier_choice")
        for injection in (carrier.PULSATING, carrier.ROTATING):
            x = machine("ipm_1000")
            x["drive"] = {"injection": injection}
            chosen = tune.drive(x, tune.complete(x), 0.15)
            case = next(c for c in cases.values() if c["injection"] == injection and c["most"] <= 3)
            self.assertEqual((chosen["v_injection"][0], chosen["f_injection"][0]), (case["v"], case["f"]))
            self.assertEqual(chosen["injection_bandwidth"][0], 15)
            self.assertEqual(chosen["speed_bandwidth"][0], 3.75)
            self.assertIn("predicted", chosen["v_injection"][1])

    def test_a_carrier_that_is_told_is_not_looked_for(self):
        x = machine("ipm_1000")
        told = {"v_injection": 50.0, "f_injection": 500.0, "injection_bandwidth": 9.0}
        x["drive"] = {"injection": carrier.PULSATING, **told}
        with unittest.mock.patch.object(carrier, "grid", side_effect=AssertionError):
            chosen = tune.drive(x, tune.complete(x), 0.15)
            self.assertEqual({name: chosen[name][0] for name in told}, told)
            del x["drive"]["f_injection"]
            with self.assertRaises(AssertionError):
                tune.drive(x, tune.complete(x), 0.15)

    def test_the_second_harmonic_needs_carriers_of_16_periods(self):
        d = parameters(machine("ipm_1000"), injection=4, v_injection=70.0, injection_bandwidth=10.0)
        with unittest.mock.patch.object(carrier, "error_deg", return_value=0.0):
            for polarity, least in ((1, 8), (3, 20)):
                found = carrier.grid(None, {**d, "polarity": polarity}, 100.0)[1]
                self.assertEqual(min(d["f_pwm"] / f for _, f in found), least)

    def test_a_motor_without_a_carrier_is_refused_with_the_remedy(self):
        x = machine("spm_400")
        x["drive"] = {"injection": carrier.PULSATING}
        x["electrical"]["c_A_Wb5"] = 0.0
        x["electrical"]["L_q0_H"] = 1.002 * float(x["electrical"]["L_d0_H"])
        with self.assertRaises(tune.UsageError) as refused:
            tune.drive(x, tune.complete(x), 0.15)
        self.assertIn("no carrier", str(refused.exception))

    def test_currents_of_the_model_are_those_of_the_loop(self):
        """Without a carrier's error the run ends at the position, whatever the current below the boundary."""
        x = machine("ipm_1000")
        held, mean, largest = holds(x, injection=0, v_injection=70.0, injection_bandwidth=25.0).run(3.0)
        self.assertTrue(held)
        self.assertLess(math.degrees(abs(mean)), 0.5)
        self.assertLess(math.degrees(largest), 1.0)


if __name__ == "__main__":
    unittest.main()
