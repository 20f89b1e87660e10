#!/usr/bin/env python3
"""tools/mutate on a small source: which mutants it finds, that each is alive by its number alone, and that those which
tests/mutants.yaml accepts are still in the sources."""
import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "mutation"))
try:
    import clang.cindex  # noqa: F401  pylint: disable=unused-import
except ImportError:
    print("skipped: no python3-clang; tools/setup all installs it")
    sys.exit(77)
import page  # noqa: E402
import sites  # noqa: E402
import tree  # noqa: E402
import yaml  # noqa: E402

SOURCE = """
#define LIMIT 40
#define pm_max(a, b) ((a) > (b) ? (a) : (b))
enum { EIGHT = 4 + 4 };
static const int table[2] = {5 + 1, 7};
typedef struct { int d, q; } pair_t;
static int pm_min(int a, int b) { return a < b ? a : b; }
int f(int a, int b)
{
    int x = a;
    if (a > b && b != 0) {
        x += 2;
    }
    pair_t p = {x, b};
    p.q = p.d * 3;
    switch (a) {
    case 2 + 1:
        return table[0];
    default:
        break;
    }
    return pm_min(p.q, LIMIT) - EIGHT;
}
"""
MAIN = """
#include <stdio.h>
int f(int a, int b);
int main(void) { printf("%d %d %d %d\\n", f(5, 4), f(4, 4), f(3, 0), f(90, 1)); return 0; }
"""


class Mutation(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "small.c"
        self.path.write_text(SOURCE)
        self.found = sites.find(self.path, ["-x", "c", "-std=c11"])

    def tearDown(self):
        self.folder.cleanup()

    def names(self, function="f"):
        return sorted(name for site in self.found if site.function == function for name, _ in site.what)

    def test_files_that_are_none_of_ours(self):
        for word in ("nofile", "firmware/no*.c", "/nowhere/a.c", "/usr/include", str(self.path)):
            done = subprocess.run([sys.executable, str(ROOT / "tools" / "mutation"), "--list", word], capture_output=True, text=True,
                                  check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
            self.assertIn(f"no source of this project is {word}", done.stderr)
        done = subprocess.run([sys.executable, str(ROOT / "tools" / "mutation"), "--list", "firmware/params/st*.c"],
                              capture_output=True, text=True, check=True)
        self.assertIn("mutants in 1 files", done.stdout)

    def test_finds_what_can_change(self):
        self.assertEqual(self.names("pm_min"), ["< -> <=", "< -> >="])
        names = self.names()
        for name in ("> -> >=", "> -> <=", "&& -> ||", "!= -> ==", "+= -> -=", "2 -> 3", "* -> +", ".d -> .q",
                     "pm_min -> pm_max", "LIMIT -> 3/4 of it - 1", "- -> +", "left out"):
            self.assertIn(name, names)

    def test_leaves_constants_of_the_compiler_alone(self):
        lines = SOURCE.split("\n")
        for site in self.found:
            line = lines[SOURCE[:site.start].count("\n")]
            for word in ("case", "enum", "table[2]", "#define"):
                self.assertNotIn(word, line)

    def test_one_program_has_them_all(self):
        numbered, names = [], []
        for site in self.found:
            numbered.append((site, list(range(len(names), len(names) + len(site.what)))))
            names += [name for name, _ in site.what]
        text = sites.render(self.path.read_bytes(), numbered)
        changed = self.path.with_name("changed.c")
        changed.write_text('#include "chosen.h"\n' + text)
        (self.path.with_name("main.c")).write_text(MAIN)
        program = self.path.with_name("program")
        subprocess.run(["gcc", "-w", f"-I{tree.HERE}", str(changed), str(self.path.with_name("main.c")),
                        str(tree.HERE / "chosen.c"), "-o", str(program)], check=True)

        def output(**variables):
            return subprocess.run([program], env={**os.environ, **variables}, capture_output=True, text=True,
                                  check=True).stdout

        # by hand: min(3 x, 40) - 8 with x = a, and 2 more where a > b and b != 0; 3 is a case of its own
        plain = "13 4 6 32\n"
        self.assertEqual(output(), plain)
        alike = [name for n, name in enumerate(names) if output(PM_MUTANT_ALIVE=str(n)) == plain]
        # equal numbers have one minimum; that b is not 1 is never asked of an a between 1 and 40
        self.assertEqual(sorted(alike), ["0 -> 1", "< -> <="])
        by_name = {name: output(PM_MUTANT_ALIVE=str(n)) for n, name in enumerate(names)}
        self.assertEqual(by_name["LIMIT -> 3/4 of it - 1"], "13 4 6 21\n")
        self.assertEqual(by_name["2 -> 3"], "16 4 6 32\n")
        reached = self.path.with_name("reached")
        reached.write_bytes(bytes(len(names)))
        self.assertEqual(output(PM_MUTANT_REACHED=str(reached)), plain)
        self.assertEqual(set(reached.read_bytes()), {1})  # each place


class Accepted(unittest.TestCase):
    def test_are_in_the_sources(self):
        spec = importlib.util.spec_from_file_location("driver", ROOT / "tools" / "mutation" / "__main__.py")
        driver = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(driver)
        rows = yaml.safe_load(page.ACCEPTED.read_text())
        mutants, _ = driver.survey(sorted({row["file"] for row in rows}))
        accepted, stale = page.read_accepted(mutants)
        self.assertEqual(stale, [])
        self.assertGreaterEqual(len(accepted), len(rows))
        for row in rows:
            self.assertTrue(row["reason"].strip(), row)


if __name__ == "__main__":
    unittest.main()
