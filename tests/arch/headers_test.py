"""Every header of the firmware is usable alone, from C and from C++, with the warnings of the project.

    headers_test.py ROOT CC CXX FLAG...        FLAG: warnings, those of one language as c:FLAG or c++:FLAG

A header that forgets an include, or has a compound literal in an inline function (which C++ does not know), is
an error that names it.
"""
import re
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDERS = ("firmware", "observers", "injection", "bldc", "hal")
STANDARD = {"c": "c11", "c++": "c++17"}
PROTOTYPE = re.compile(r"^(?!static\b|typedef\b|else\b)[a-z]\w*[ *]+(\w+[ *]+)*\w+\(", re.MULTILINE)  # has a linkage
ROOT = Path(sys.argv[1])
COMPILER = {"c": sys.argv[2], "c++": sys.argv[3]}
FLAGS = sys.argv[4:]


def public_headers(root):
    found = [path for folder in FOLDERS for path in (root / folder).rglob("*.h")]
    return sorted(path.relative_to(root).as_posix() for path in found)


def flags_of(language):
    return [flag.split(":", 1)[-1] for flag in FLAGS if ":" not in flag or flag.startswith(language + ":")]


def errors_of(root, header, language):
    """What the compiler says of a file with nothing but the header, and a type: C wants a file not to be empty."""
    command = [COMPILER[language], f"-std={STANDARD[language]}", *flags_of(language), "-Werror", "-fsyntax-only",
               f"-I{root}", "-x", language, "-"]
    source = f'#include "{header}"\ntypedef int pm_file_is_not_empty;\n'
    done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


class Headers(unittest.TestCase):
    def test_each_compiles_alone_in_both_languages(self):
        headers = public_headers(ROOT)
        self.assertGreater(len(headers), 50)
        jobs = [(header, language) for header in headers for language in STANDARD]
        with ThreadPoolExecutor(2) as pool:
            errors = list(pool.map(lambda job: errors_of(ROOT, *job), jobs))
        bad = [f"{header} as {language}:\n{text}" for (header, language), text in zip(jobs, errors) if text]
        self.assertEqual(bad, [], "\n".join(bad))

    def test_functions_have_the_linkage_of_c(self):
        for header in public_headers(ROOT):
            text = (ROOT / header).read_text()
            if PROTOTYPE.search(text):
                with self.subTest(header=header):
                    self.assertIn('extern "C"', text)

    def refused(self, text, language):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "bad.h").write_text(text)
            return errors_of(folder, "bad.h", language) != ""

    def test_a_missing_include_is_refused(self):
        self.assertTrue(self.refused("static const int32_t x = 0;\n", "c"))

    def test_a_compound_literal_is_refused_in_cpp(self):
        text = ("typedef struct {\n    int a, b;\n} pair_t;\n"
                "static inline pair_t pair(int x)\n{\n    return (pair_t){x, x};\n}\n")
        self.assertFalse(self.refused(text, "c"))
        self.assertTrue(self.refused(text, "c++"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
