"""Formulas, draws and intervals of campaigns, and what a campaign file is told when it is wrong."""

import math
import statistics
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "tools"))

from campaigns import draw, judge  # noqa: E402
from campaigns.formula import FormulaError, evaluate  # noqa: E402
from campaigns.plan import Campaign, SourceError, machine_text  # noqa: E402

SCENARIO = """title: t
machine: m.yaml
expect:
  - {metric: fault, equals: NONE, book: "5.9"}
  - {name: angle, metric: angle_error_max_deg, max: 10, book: "5.9"}
"""
CAMPAIGN = """title: Small
scenario: s.yaml
runs: 4
draw:
  L: {log: [1.0e-4, 1.0e-3]}
  told_R: {uniform: [0.85, 1.15]}
machine:
  electrical: {R_s_ohm: 0.1, L_d0_H: L, L_q0_H: L, psi_m_Wb: 0.02, pole_pairs: 10}
  mechanics: {J_kgm2: 0.01}
  rated: {i_rated_A: 20, speed_rated_rad_s: 40, v_dc_V: 36}
told:
  electrical: {R_s_ohm: electrical.R_s_ohm * told_R}
variables: {t_end: 1 + 2 * drive.t_align}
classes:
  - {class: lost, fails: [fault]}
bounds:
  - {class: ok, min: 0.5}
"""


class Formulas(unittest.TestCase):
    def test_arithmetic(self):
        names = {"x": 3.0, "drive.J": 2.0, "load": "fan"}
        for text, value in (
            ("2 + 3 * x ** 2", 29),
            ("-x / drive.J", -1.5),
            ("sqrt(16)", 4),
            ("max(1, x) % 2", 1),
            ("5 if load == 'fan' else 6", 5),
            ("1 if x > 2 and not x > 4 else 0", 1),
            ("2.0e-3", 0.002),
            ("pi", math.pi),
        ):
            self.assertAlmostEqual(evaluate(text, names), value, msg=text)

    def test_nothing_else(self):
        for text in (
            "__import__('os')",
            "x.__class__",
            "[1]",
            "(lambda: 1)()",
            "open(x)",
            "x[0]",
            "y",
            "1 +",
            "1 / 0",
            "sqrt(-1)",
            "10.0 ** 999",
            "x < 2 < 3",
            "max(x, key=abs)",
            "f'{x}'",
            "None",
        ):
            with self.assertRaises(FormulaError, msg=text):
                evaluate(text, {"x": 1.0})


class Draws(unittest.TestCase):
    def drawn(self, text, count=4000):
        source = draw.Source("f", yaml.compose(text))
        return [source.value({}, 1, n, "x") for n in range(count)]

    def test_distributions(self):
        values = self.drawn("{uniform: [2, 4]}")
        self.assertTrue(all(2 <= x <= 4 for x in values))
        self.assertAlmostEqual(statistics.mean(values), 3, delta=0.05)
        values = self.drawn("{log: [0.01, 100]}")
        self.assertAlmostEqual(statistics.median(values), 1, delta=0.2)
        self.assertAlmostEqual(sum(x < 0.1 for x in values) / len(values), 0.25, delta=0.03)
        values = self.drawn("{integer: [3, 5]}")
        self.assertEqual(set(values), {3, 4, 5})
        values = self.drawn("{normal: [5, 2]}")
        self.assertAlmostEqual(statistics.stdev(values), 2, delta=0.1)
        self.assertEqual(set(self.drawn("{one_of: [none, 3, 0.5, true]}")), {"none", 3, 0.5, True})
        a, b = zip(*self.drawn("[{uniform: [0, 1]}, {uniform: [0, 1]}]"))
        self.assertLess(abs(statistics.correlation(a, b)), 0.1)

    def test_a_value_depends_on_its_own_name_alone(self):
        source = draw.Source("f", yaml.compose("{uniform: [0, 1]}"))
        self.assertEqual(source.value({}, 1, 7, "x"), source.value({"y": 3}, 1, 7, "x"))
        self.assertEqual(len({source.value({}, seed, n, name) for seed in (1, 2) for n in (1, 2) for name in "xy"}), 8)

    def test_what_cannot_be_drawn(self):
        for text in (
            "{log: [0, 1]}",
            "{log: [2, 1]}",
            "{integer: [1.5, 2]}",
            "{uniform: [1]}",
            "{uniform: 3}",
            "{one_of: []}",
            "{unifrom: [1, 2]}",
            "{uniform: [a, 2]}",
            "{uniform: [1, 2], log: [1, 2]}",
            "word",
        ):
            with self.assertRaises(SourceError, msg=text):
                self.drawn(text, 1)


class Intervals(unittest.TestCase):
    def test_known_ones(self):
        # Of 0 of n and n of n in closed form; 8 of 20 as tables of the exact binomial interval have it.
        low, high = judge.interval(0, 50)
        self.assertEqual(low, 0)
        self.assertAlmostEqual(high, 1 - 0.025 ** (1 / 50), places=9)
        low, high = judge.interval(1000, 1000)
        self.assertEqual(high, 1)
        self.assertAlmostEqual(low, 0.025 ** (1 / 1000), places=9)
        low, high = judge.interval(8, 20)
        self.assertAlmostEqual(low, 0.1912, places=4)
        self.assertAlmostEqual(high, 0.6395, places=4)

    def test_it_holds_as_often_as_it_says(self):
        n, share = 40, 0.9
        inside = sum(
            math.comb(n, k) * share**k * (1 - share) ** (n - k)
            for k in range(n + 1)
            if judge.interval(k, n)[0] <= share <= judge.interval(k, n)[1]
        )
        self.assertGreaterEqual(inside, judge.CONFIDENCE)


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def campaign(self, text=CAMPAIGN, scenario=SCENARIO):
        folder = Path(self.folder.name)
        (folder / "s.yaml").write_text(scenario, encoding="utf-8")
        (folder / "c.yaml").write_text(text, encoding="utf-8")
        return Campaign(folder / "c.yaml")

    def refused(self, old, new, line, *words, number=0):
        self.assertIn(old, CAMPAIGN)
        with self.assertRaises(SourceError) as caught:
            self.campaign(CAMPAIGN.replace(old, new, 1)).run(number)
        self.assertIn(f"c.yaml:{line}: ", str(caught.exception))
        for word in words:
            self.assertIn(word, str(caught.exception))

    def test_what_is_wrong_has_its_line(self):
        self.refused("runs: 4", "runs: 4\nrusn: 5", 4, "rusn", "runs")
        self.refused("runs: 4", "runs: few", 3, "few")
        self.refused("runs: 4", "runs: 0", 3)
        self.refused("title: Small\n", "", 1, "title")
        self.refused("scenario: s.yaml", "scenario: none.yaml", 2, "none.yaml")
        self.refused("{log: [1.0e-4, 1.0e-3]}", "{log: [1.0e-3, 1.0e-4]}", 5, "low")
        self.refused("{uniform: [0.85, 1.15]}", "{uniform: [1.15, 0.85]}", 6, "low")
        self.refused("L_d0_H: L,", "L_d0_H: L_d,", 8, "L_d", "told_R")
        self.refused("J_kgm2: 0.01", "J_gcm2: 0.01", 9, "mechanics.J_kgm2")
        self.refused("rated: {i_rated_A: 20, ", "rated: {", 10, "rated.i_rated_A")
        self.refused("drive.t_align", "drive.t_aling", 13, "t_aling")
        self.refused("fails: [fault]", "fails: [falut]", 15, "falut", "fault, angle")
        self.refused("fails: [fault]", "empty: [falut]", 15, "falut")
        self.refused(", fails: [fault]", "", 15, "fails")
        self.refused("class: lost,", "class: ok,", 15, "ok")
        self.refused("{class: ok, min: 0.5}", "{class: good, min: 0.5}", 17, "good")
        self.refused("min: 0.5", "min: 50", 17, "share")
        self.refused(", min: 0.5", "", 17, "`min` or `max`")
        self.refused("told:\n", "base: s.yaml\ntold:\n", 13, "told")

    def test_names_of_expectations_are_there_once(self):
        with self.assertRaises(SourceError) as caught:
            self.campaign(scenario=SCENARIO + '  - {metric: fault, equals: NONE, book: "5.9"}\n')
        self.assertIn("s.yaml:6: ", str(caught.exception))

    def test_the_plant_is_the_truth_and_the_drive_is_told(self):
        run = self.campaign().run(2)
        machine = yaml.safe_load(run.machine)
        self.assertEqual(machine["electrical"]["R_s_ohm"], 0.1)
        self.assertAlmostEqual(machine["electrical"]["L_d0_H"], run.drawn["L"], delta=1e-8 * run.drawn["L"])
        switch = machine["inverter"]["r_on_ohm"]
        self.assertAlmostEqual(machine["drive"]["R_s"], 0.1 * run.drawn["told_R"] + switch, delta=1e-4)
        self.assertNotAlmostEqual(run.drawn["told_R"], 1, delta=1e-3)
        self.assertAlmostEqual(float(run.settings["t_end"]), 1 + 2 * machine["drive"]["t_align"], places=6)

    def test_what_is_untold_is_chosen(self):
        def told(value):
            text = CAMPAIGN.replace("told:\n", f"told:\n  drive: {{i_pulse: {value}}}\n")
            return yaml.safe_load(self.campaign(text).run(0).machine)["drive"]["i_pulse"]

        self.assertEqual(told("7 if L > 0 else untold"), 7)
        self.assertEqual(told("untold if L > 0 else 7"), 20)  # rated current

    def test_what_is_untold_the_truth_does_not_tell(self):
        text = CAMPAIGN.replace("psi_m_Wb: 0.02,", "psi_m_Wb: 0.02, c_A_Wb5: 1.0e+9,")
        untold = text.replace("electrical.R_s_ohm * told_R}", "electrical.R_s_ohm * told_R, c_A_Wb5: untold}")
        machine = yaml.safe_load(self.campaign(untold).run(0).machine)
        self.assertEqual(machine["electrical"]["c_A_Wb5"], 1.0e9)
        self.assertEqual(machine["drive"]["L_q_rated"], machine["drive"]["L_q"])
        told = yaml.safe_load(self.campaign(text).run(0).machine)["drive"]
        self.assertLess(told["L_q_rated"], told["L_q"])

    def test_a_run_does_not_depend_on_others(self):
        campaign = self.campaign()
        forwards = [campaign.run(n) for n in range(4)]
        self.assertEqual([campaign.run(n) for n in (3, 1, 0, 2)], [forwards[n] for n in (3, 1, 0, 2)])
        self.assertEqual(len({run.seed for run in forwards}), 4)
        more = self.campaign(CAMPAIGN.replace("draw:\n", "draw:\n  new: {uniform: [0, 1]}\n"))
        self.assertEqual(more.run(1).machine, forwards[1].machine)

    def test_what_no_machine_file_can_be_made_of_is_refused(self):
        run = self.campaign(CAMPAIGN.replace("v_dc_V: 36}", "v_dc_V: 36}\n  sensor: {i_full_scale_A: 5}")).run(0)
        self.assertIn("cannot measure what the name plate says", run.refusal)

    def test_a_campaign_may_be_like_another(self):
        folder = Path(self.folder.name)
        first = self.campaign().run(1)

        def like(text):
            (folder / "l.yaml").write_text("title: Like\nlike: c.yaml\n" + text, encoding="utf-8")
            return Campaign(folder / "l.yaml")

        exact = like("draw: {told_R: 1}\nbounds:\n  - {class: lost, max: 0.1}\n")
        run = exact.run(1)
        self.assertEqual((run.drawn["L"], run.seed, run.drawn["told_R"]), (first.drawn["L"], first.seed, 1))
        self.assertEqual([bound.name for bound in exact.bounds], ["lost"])
        self.assertEqual([rule.name for rule in exact.rules], ["lost"])
        machine = yaml.safe_load(like("machine: {mechanics: {locked: true}}\n").run(1).machine)
        self.assertEqual(machine["mechanics"], {"J_kgm2": 0.01, "locked": True})
        for text, place in (("draw: {L: M}\n", "l.yaml:3: "), ("draw: {told_R: 1}\nlike: c.yaml\n", "l.yaml:4: ")):
            with self.assertRaises(SourceError) as caught:
                like(text).run(0)
            self.assertIn(place, str(caught.exception))
        (folder / "m.yaml").write_text("title: Like like\nlike: l.yaml\n", encoding="utf-8")
        like("")
        with self.assertRaises(SourceError) as caught:
            Campaign(folder / "m.yaml")
        self.assertIn("l.yaml:2: ", str(caught.exception))

    def test_classes(self):
        campaign = self.campaign()

        def said(fault, angle):
            return {
                "expectations": [
                    {"name": "fault", "pass": fault == "NONE", "value": fault},
                    {"name": "angle", "pass": angle is not None and angle < 10, "value": angle},
                ]
            }

        self.assertEqual(judge.class_of(campaign, said("NONE", 3)), ("ok", ""))
        self.assertEqual(judge.class_of(campaign, said("STALL", 90)), ("lost", "STALL"))
        self.assertEqual(judge.class_of(campaign, said("NONE", 90)), ("other", "angle"))
        self.assertEqual(judge.class_of(campaign, said("NONE", None)), ("other", "angle"))
        empty = self.campaign(CAMPAIGN.replace("bounds:", "  - {class: unseen, empty: [angle]}\nbounds:"))
        self.assertEqual(judge.class_of(empty, said("NONE", None)), ("unseen", "angle"))
        self.assertEqual(judge.class_of(empty, said("NONE", 90)), ("other", "angle"))
        kind, cause = judge.class_of(
            campaign, {"error": "pmsim: /x/y/m.yaml:3:4: drive refuses parameter i_trip: 3.5 A is too small"}
        )
        self.assertEqual((kind, cause), ("refused", "drive refuses parameter i_trip: # A is too small"))

    def test_numbers_are_numbers_for_every_reader(self):
        text = machine_text(
            {"name": "n: 3", "a": {"x": 1e-5, "y": 2.5e12, "z": True, "w": "1e3", "l": [1e-7, 2], "t": [{"k": 1e-6}]}}
        )
        self.assertEqual(
            yaml.safe_load(text),
            {"name": "n: 3", "a": {"x": 1e-5, "y": 2.5e12, "z": True, "w": 1000.0, "l": [1e-7, 2], "t": [{"k": 1e-6}]}},
        )

    def test_the_project_s_own_campaigns_can_be_read(self):
        for path in [*(ROOT / "tests/campaign").glob("*.yaml"), HERE / "smoke.yaml"]:
            if "\nscenario:" in path.read_text(encoding="utf-8"):
                campaign = Campaign(path)
                groups = len(campaign.groups)
                for number in range(groups):  # a machine may be refused, not each of a group
                    self.assertTrue(any(campaign.run(number + k * groups).machine for k in range(5)), f"{path}: {number}")


if __name__ == "__main__":
    unittest.main()
