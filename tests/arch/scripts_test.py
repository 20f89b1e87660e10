"""Scripts of tools refuse words that make no sense before they install or build anything.

usage: scripts_test.py FOLDER_OF_THE_PROJECT
"""
import subprocess
import sys
import unittest

ROOT = None
REFUSED = (
    ("coverage", "foo"), ("coverage", "--branch"), ("demo", "a", "b"), ("demo", "--what"), ("campaign",), ("campaign", "rum"),
    ("campaign", "run", "nofile"), ("campaign", "show", "nofolder"), ("campaign", "run", "README.md", "--jobs", "0"),
    ("campaign", "run", "README.md", "--he"),
)
HELP = (("coverage", "--help"), ("demo", "-h"), ("campaign", "--help"), ("campaign", "run", "--help"))


class Scripts(unittest.TestCase):
    def run_tool(self, name, *words):
        return subprocess.run([f"{ROOT}/tools/{name}", *words], cwd=ROOT, capture_output=True, text=True, timeout=20)

    def test_refused(self):
        for words in REFUSED:
            with self.subTest(words):
                done = self.run_tool(*words)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.assertIn("usage: ", done.stderr)

    def test_help(self):
        for words in HELP:
            with self.subTest(words):
                done = self.run_tool(*words)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertTrue(done.stdout.startswith(f"usage: tools/{words[0]}"), done.stdout)


if __name__ == "__main__":
    ROOT = sys.argv.pop(1)
    unittest.main()
