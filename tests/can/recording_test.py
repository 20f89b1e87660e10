"""What `pmdrive trace` writes, as others read it: MDF4 by asammdf, the picture by matplotlib, the table by csv."""
import csv
import math
import sys
import tempfile
import unittest
from pathlib import Path

import asammdf
from matplotlib import image

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "pmdrive"))
from pmdrive import names, trace, watch  # noqa: E402

COUNT, PERIOD_S, BEFORE = 500, 50e-6, 50


class Recording(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.time_s = [(n - BEFORE) * PERIOD_S for n in range(COUNT)]
        self.columns = [[3.0 * math.sin(1e3 * t) for t in self.time_s],
                        [math.fmod(40.0 * n / COUNT, 1.0) for n in range(COUNT)]]
        entries = [names.find("i_q"), names.find("theta")]
        self.recording = trace.Recording(entries, self.time_s, self.columns)

    def written(self, name):
        path = str(Path(self.folder.name) / name)
        self.recording.write(path)
        return path

    def test_mdf4(self):
        with asammdf.MDF(self.written("a.mf4")) as file:
            for name, unit, column in zip(("i_q", "theta"), ("A", "turn"), self.columns):
                signal = file.get(name)
                self.assertEqual(signal.unit, unit)
                self.assertEqual(signal.comment, names.find(name).help)
                self.assertEqual(list(signal.samples), column)
                self.assertEqual(list(signal.timestamps), self.time_s)

    def test_picture(self):
        pixels = image.imread(self.written("a.png"))
        self.assertGreater(min(pixels.shape[:2]), 300)
        colours = {tuple(pixel) for row in pixels[::2, ::2, :3] for pixel in row.tolist()}
        self.assertGreater(len(colours), 10)  # axes, text and curves
        self.assertGreater((pixels[:, :, 2] > pixels[:, :, 0] + 0.3).sum(), 500, "no blue curve")

    def test_picture_of_what_was_watched(self):
        history = watch.History(self.recording.entries)
        for n in range(50):
            history.time_s.append(0.1 * n)
            for entry, column in zip(history.entries, self.columns):
                history.values[entry].append(column[10 * n])
        path = str(Path(self.folder.name) / "watched.png")
        watch.picture(history, path)
        self.assertGreater((image.imread(path)[:, :, 2] > image.imread(path)[:, :, 0] + 0.3).sum(), 300, "no blue curve")
        terminal = watch.Terminal()
        terminal.plot.show = lambda: None
        terminal.plot.clear_terminal = lambda: None
        terminal.draw(history)
        self.assertIn("i_q", terminal.plot.build())

    def test_table(self):
        with open(self.written("a.csv"), encoding="ascii") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]), ["t_s", "i_q_A", "theta_turn"])
        for row, t, i, theta in zip(rows, self.time_s, *self.columns):
            for text, value in ((row["t_s"], t), (row["i_q_A"], i), (row["theta_turn"], theta)):
                self.assertAlmostEqual(float(text), value, delta=1e-8 * max(1.0, abs(value)))


if __name__ == "__main__":
    unittest.main()
