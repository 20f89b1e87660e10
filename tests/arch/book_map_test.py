"""tools/book_map.py on small trees: what it makes of a whole one, and each orphan must be refused."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TOOL = Path(__file__).resolve().parents[2] / "tools/book_map.py"
METHODS = """PM_METHOD(12, "2.2.1", "Flux linkage", FUNDAMENTAL, IMPLEMENTED, "observer", "spm")
PM_METHOD(13, "2.2.2", "Active flux", FUNDAMENTAL | MODEL, IMPLEMENTED, "", "observers/active")
PM_METHOD(14, "2.3.1", "Back-EMF", FUNDAMENTAL, NOT_YET, "", "")
"""
SCENARIO = """duration_s: 4
cases:
- {name: slow, most: 2}
- {name: "twin: off", most: 9}
expect:
- {metric: angle_error_max_deg, window_s: [2, 3], max: $most, book: "2.2.1"}
- {metric: fault, equals: NONE, book: "2.2.1"}
"""
ASKED = """12:
- {asks: largest, metric: angle_error_max_deg, max: 2, scenario: spm, not: twin}
- {asks: no fault, metric: fault, equals: NONE, scenario: spm}
13:
- {asks: largest, measured: active_, max: 2, test: observers/active}
- {asks: all, bound: 3 deg, test: observers/active, is: Active.IsRight}
"""
WHOLE = {
    "tools/pmsim/methods.def": METHODS,
    "observers/flux.h": "/* Flux (METHODS.md 2.2, rows 12 and\n * 13). */\n",
    "tests/scenario/spm.yaml": SCENARIO,
    "tests/unit/observers/active_test.cpp": 'TEST(Active, IsRight) { measured("active_error", 1, 2, "deg", "2.2.2"); }',
    "tests/acceptance.yaml": ASKED,
    "docs/results/tests.json": '{"active_error": [1, 2]}',
    "docs/methods_notes.md": "# Notes\n\n## Why three\n",
}


def plant(folder, changes):
    for name, text in {**WHOLE, **changes}.items():
        if text is not None:
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


def run_only(changes):
    """What is refused before a page is made."""
    with tempfile.TemporaryDirectory() as folder:
        plant(folder, changes)
        return subprocess.run([sys.executable, TOOL, "--root", folder], capture_output=True, text=True, check=False)


def run(changes, check_again=False):
    with tempfile.TemporaryDirectory() as folder:
        plant(folder, changes)
        command = [sys.executable, TOOL, "--root", folder]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if check_again:
            (Path(folder) / "observers/flux.h").write_text(check_again)
            done = subprocess.run([*command, "--check"], capture_output=True, text=True, check=False)
        return done.returncode, done.stderr, (Path(folder) / "docs/book.md").read_text()


class BookMap(unittest.TestCase):
    def test_a_whole_tree_is_mapped(self):
        code, message, page = run({})
        self.assertEqual((code, message), (0, ""))
        self.assertIn("| 2.2.1 | 12 | Flux linkage | [flux.h](../observers/flux.h) | `observer` | "
                      "[spm.yaml](../tests/scenario/spm.yaml) | [results.md](results.md) |", page)
        self.assertIn("| 2.2.2 | 13 | Active flux | [flux.h](../observers/flux.h) | always | "
                      "[active_test.cpp](../tests/unit/observers/active_test.cpp) | in the test |", page)
        self.assertIn("| 2.3.1 | 14 | Back-EMF | not yet |", page)
        self.assertIn("2 of 3 rows, 0 of them in no image yet.", page)

    def test_a_method_of_a_list_claims_its_rows(self):
        claim = {"observers/x.yaml": "# X.\nbook:\n- {row: 14, parameter: \"\", proof: spm}\nknows: R\n",
                 "observers/x.h": "/* row 14 */",
                 "tests/acceptance.yaml": ASKED + "14:\n- {asks: x, metric: fault, equals: NONE, scenario: spm, also: [2.2.1]}\n"}
        code, message, page = run(claim)
        self.assertEqual((code, message), (0, ""))
        self.assertIn("| 2.3.1 | 14 | Back-EMF | [x.h](../observers/x.h) | always | [spm.yaml]", page)
        self.assertIn("3 of 3 rows, 0 of them in no image yet.", page)
        library = {**claim, "observers/x.yaml": claim["observers/x.yaml"].replace('""', "none")}
        _, _, page = run(library)
        self.assertIn("| in no image yet | [spm.yaml]", page)
        self.assertIn("3 of 3 rows, 1 of them in no image yet.", page)
        code, message, _ = run({**claim, "tests/acceptance.yaml": ASKED})
        self.assertEqual(code, 1)
        self.assertIn("row 14 is implemented, but tests/acceptance.yaml asks nothing of it", message)

    def test_a_claim_that_cannot_be_meant_is_refused_with_its_line(self):
        for text, reason in (("- {row: 14}", "observers/x.yaml:2: not {row: N"),
                             ("- {row: 14, parameter: a, proof: spm}\n- {row: 14, parameter: a, proof: spm}",
                              "observers/x.yaml:3: row 14 is claimed already"),
                             ("- {row: 99, parameter: a, proof: spm}", "row 99 of a method's `book` is not one"),
                             ("- {row: 12, parameter: a, proof: spm}", "row 12 of a method's `book` is not one")):
            done = run_only({"observers/x.yaml": f"book:\n{text}\n"})
            self.assertEqual(done.returncode, 1)
            self.assertIn(reason, done.stderr)

    def test_a_range_names_its_rows(self):
        for text in "/* rows\n * 12 to\n * 13 */", "/* rows 12\n * to 13 */":
            self.assertEqual(run({"observers/flux.h": text})[0], 0)

    def test_a_method_without_a_source_is_refused(self):
        code, message, _ = run({"observers/flux.h": "/* row 12 */"})
        self.assertEqual(code, 1)
        self.assertIn("row 13, Active flux: no source names it", message)

    def test_a_method_without_its_proof_is_refused(self):
        for missing in "tests/scenario/spm.yaml", "tests/unit/observers/active_test.cpp":
            code, message, _ = run({missing: None})
            self.assertEqual(code, 1)
            self.assertIn(f"{missing} is missing", message)

    def test_a_source_of_a_method_that_is_not_there_is_refused(self):
        code, message, _ = run({"observers/emf.h": "/* back-EMF, row 14 */"})
        self.assertEqual(code, 1)
        self.assertIn("observers/emf.h: row 14 is not implemented", message)

    def test_a_proof_that_does_not_have_what_is_asked_is_refused(self):
        for old, new, reason in (
                ("max: 2, scenario", "max: 1, scenario", "the bound of angle_error_max_deg is looser than asked"),
                (", not: twin", "", "is looser than asked"),
                ("not: twin", "case: fast", "spm.yaml has no such case"),
                ("metric: angle_error_max_deg", "metric: angle_error_mean_deg", "spm.yaml expects no angle_error_mean_deg for 2.2.1"),
                ("max: 2, scenario: spm,", "max: 2, scenario: spm, window_s: 2,", "expects no angle_error_max_deg for 2.2.1"),
                ("equals: NONE", "equals: STALL", "the bound of fault is looser than asked"),
                ("scenario: spm}", "scenario: none}", "tests/scenario/none.yaml is missing"),
                ("measured: active_", "measured: passive_", "observers/active measures no passive_"),
                ("measured: active_, max: 2", "measured: active_, max: 1", "the bound of active_ is looser than asked"),
                ("max: 2, scenario: spm,", "max: 2, scenario: spm, window_s: [1, 2],", "expects no angle_error_max_deg for 2.2.1"),
                ("Active.IsRight", "Active.IsWrong", "observers/active has no test Active.IsWrong"),
                ("asks: largest, metric", "asked: largest, metric", "unknown asked"),
                ("13:\n", "14:\n", "row 14 is not implemented"),
                ("max: 2, scenario", "max: 1, looser: {to: 2, why: Why four}, scenario", 'no heading "Why four"')):
            self.assertIn(old, ASKED)
            code, message, _ = run({"tests/acceptance.yaml": ASKED.replace(old, new, 1)})
            self.assertEqual(code, 1, old)
            self.assertIn(reason, message)

    def test_a_looser_bound_may_stand_with_its_reason(self):
        asked = ASKED.replace("max: 2, scenario", "max: 1, looser: {to: 2, why: Why three}, scenario")
        self.assertEqual(run({"tests/acceptance.yaml": asked})[:2], (0, ""))

    def test_a_page_that_is_not_up_to_date_is_refused(self):
        code, message, _ = run({}, check_again="/* rows 12, 13: here */")
        self.assertEqual((code, message), (0, ""))
        code, message, _ = run({}, check_again="/* row 12 */")
        self.assertEqual(code, 1)
        self.assertIn("not up to date", message)


if __name__ == "__main__":
    unittest.main()
