"""The checker of the arrows on small trees with one violation each: every one must be reported, at its line."""
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
from check_arrows import check_tree  # noqa: E402

CLEAN = {
    "firmware/math/fixed.h": "#include <stdint.h>\ntypedef int32_t pm_q_t; /* no float, no double */\n",
    "firmware/control/park.h": '#include "firmware/math/fixed.h"\n',
    "firmware/params/maker.h": '#include "firmware/math/fixed.h"\n',
    "observers/active_flux.h": '#include "firmware/math/fixed.h"\n',
    "observers/active_flux_config.c": '#include "firmware/params/maker.h"\n',
    "injection/pulsating.h": '#include "firmware/math/fixed.h"\n',
    "firmware/drive/drive.h": '#include "firmware/control/park.h"\n#include "observers/active_flux.h"\n',
    "firmware/app/main.c": '#include "firmware/drive/drive.h"\n#include "hal/hal.h"\n',
    "hal/hal.h": '#include "firmware/drive/drive.h"\n',
    "hal/sim/port.c": '#include "hal/hal.h"\n#include "sim_plant/plant.h"\n',
    "sim_plant/plant.h": "#include <math.h>\ntypedef double real;\n",
    "sim_plant/plant.c": '#include "plant.h"\n',
    "tests/unit/math/fixed_test.cpp": '#include "firmware/math/fixed.h"\n#include <cmath>\n#include <gtest/gtest.h>\n',
}


def messages_for(changes):
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for name, text in {**CLEAN, **changes}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        return check_tree(root)[1]


class Arrows(unittest.TestCase):
    def refused(self, file, text, line, *words):
        found = messages_for({file: text})
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(f"{file}:{line}: "), found)
        for word in words:
            self.assertIn(word, found[0])

    def test_clean_tree_is_accepted(self):
        self.assertEqual(messages_for({}), [])

    def test_upwards(self):
        self.refused("firmware/math/x.c", '\n#include "firmware/control/park.h"\n', 2, "math", "control")
        self.refused("firmware/control/x.c", '#include "firmware/drive/drive.h"\n', 1, "control", "drive")
        self.refused("firmware/params/x.h", '#include "observers/active_flux.h"\n', 1, "params", "observers")
        self.refused("observers/x.h", '/* why */\n\n# include "firmware/drive/drive.h"\n', 3, "observers", "drive")

    def test_sideways(self):
        self.refused("observers/x.c", '#include "injection/pulsating.h"\n', 1, "observers", "injection")
        self.refused("injection/x.c", '#include "firmware/control/park.h"\n', 1, "injection", "control")
        self.refused("bldc/x.c", '#include "observers/active_flux.h"\n', 1, "bldc", "observers")

    def test_hal(self):
        self.refused("firmware/drive/x.c", '#include "hal/hal.h"\n', 1, "drive", "hal")
        self.refused("hal/sim/x.c", '#include "observers/active_flux.h"\n', 1, "hal_sim", "observers")
        self.refused("hal/stm32g431/x.c", '#include "sim_plant/plant.h"\n', 1, "hal", "sim_plant")
        self.refused("hal/template/x.c", '#include "observers/active_flux.h"\n', 1, "hal", "observers")
        self.refused("hal/linux/x.c", '#include "sim_plant/plant.h"\n', 1, "hal", "sim_plant")

    def test_plant_shares_nothing(self):
        self.refused("sim_plant/x.c", '#include "firmware/math/fixed.h"\n', 1, "sim_plant", "math")
        self.refused("sim_plant/x.c", '#include "../hal/hal.h"\n', 1, "sim_plant", "hal")

    def test_source_file_included(self):
        self.refused("tests/unit/x_test.cpp", '#include "sim_plant/plant.c"\n', 1, "source file")

    def test_paths_start_at_the_root(self):
        self.refused("firmware/math/x.c", '#include "fixed.h"\n', 1, "firmware/math/fixed.h")
        self.refused("observers/x.c", '#include "nowhere.h"\n', 1, "nowhere.h")

    def test_floating_point(self):
        self.refused("firmware/math/x.c", "#include <stdint.h>\n#include <math.h>\n", 2, "math.h")
        self.refused("observers/x.c", "// float\nstatic float f;\n", 2, "float")
        self.refused("injection/x.c", 'const char *s = "double"; /* double\n */ double d;\n', 2, "double")

    def test_shifts(self):
        self.refused("observers/x.c", "/* << */\nint f(int x) { return x >> 1; }\n", 2, "shifts")
        self.assertEqual(messages_for({"firmware/drive/x.h": "enum {\n    LIMIT_A = 1 << 0,\n    LIMIT_B = 1 << 1,\n};\n"}), [])
        self.assertEqual(messages_for({"firmware/math/x.c": "int f(int x) { return x >> 1; }\n"}), [])

    def test_unknown_folder(self):
        self.refused("firmware/other/x.c", "\n", 1, "no module")

    def test_commented_include_is_not_one(self):
        self.assertEqual(messages_for({"observers/x.c": '/*\n#include "injection/pulsating.h"\n*/\n'}), [])


if __name__ == "__main__":
    unittest.main()
