"""The check for floating point must find it: small C files, cross-compiled, each with one use or none."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).parents[1] / "no_float.py"
CORE = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-O2"]
SOFT = [*CORE, "-mfloat-abi=soft"]
HARD = [*CORE, "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
FPU_ADD = "vadd.f32"
if "--riscv" in sys.argv:
    sys.argv.remove("--riscv")
    CORE = ["riscv64-unknown-elf-gcc", "-O2"]
    SOFT = [*CORE, "-march=rv32imac", "-mabi=ilp32", "--specs=picolibc.specs"]
    HARD = [*CORE, "-march=rv32imafc", "-mabi=ilp32f"]
    FPU_ADD = "fadd.s"

FLOATING = {
    "float add": "float f(float a, float b) { return a + b; }",
    "double multiply": "double f(double a, double b) { return a * b; }",
    "float compare": "int f(float a, float b) { return a < b; }",
    "int to float": "float f(int a) { return a; }",
    "unsigned long long to double": "double f(unsigned long long a) { return a; }",
    "double to unsigned": "unsigned f(double a) { return a; }",
    "float to double": "double f(float a) { return a; }",
    "long long to float": "float f(long long a) { return a; }",
    "libm": "double sin(double); void f(double *a) { *a = sin(*a); }",
}
CLEAN = {
    "fixed point": "long long f(int a, int b) { return (long long)a * b; }",
    "constant folded": "int f(int a) { return a * (int)(0.5 * 65536.0); }",
    "64-bit division": "long long f(long long a, long long b) { return a / b; }",
    "memcpy": "#include <string.h>\nvoid f(void *a, const void *b, unsigned n) { memcpy(a, b, n); }",
}


def check(source, compiler):
    with tempfile.TemporaryDirectory() as folder:
        c, o = Path(folder) / "x.c", Path(folder) / "x.o"
        c.write_text(source + "\n")
        subprocess.run([*compiler, "-c", c, "-o", o], check=True)
        return subprocess.run([sys.executable, CHECK, o], capture_output=True, text=True)


class NoFloat(unittest.TestCase):
    def test_helpers_are_found(self):
        for name, source in FLOATING.items():
            with self.subTest(name):
                result = check(source, SOFT)
                self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
                self.assertIn("floating point: x.o", result.stdout)

    def test_fpu_instructions_are_found(self):
        result = check(FLOATING["float add"], HARD)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn(FPU_ADD, result.stdout)

    def test_helpers_are_found_in_an_image(self):
        for name, source, status in (("float", "int f(float a); int main(void) { return f(1); }"
                                               "int f(float a) { return (int)(a * 3.0f + a); }", 1),
                                     ("integer", "int main(void) { return 0; }", 0)):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                c, elf = Path(folder) / "x.c", Path(folder) / "x.elf"
                c.write_text(source + "\n")
                subprocess.run([*SOFT, "-fno-inline", "-fno-ipa-cp", "-nostdlib", "-e", "main", c,
                                "-lgcc", "-o", elf], check=True)
                result = subprocess.run([sys.executable, CHECK, elf], capture_output=True, text=True)
                self.assertEqual(result.returncode, status, result.stdout + result.stderr)

    def test_integer_code_passes(self):
        for name, source in CLEAN.items():
            with self.subTest(name):
                result = check(source, SOFT)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_division_is_noted(self):
        self.assertIn("note: 64-bit division", check(CLEAN["64-bit division"], SOFT).stdout)

    def test_nothing_looked_at_is_not_a_pass(self):
        self.assertEqual(check("int x;", SOFT).returncode, 1)


if __name__ == "__main__":
    unittest.main()
