"""A small campaign from end to end: its classes, stopped and gone on with, replayed, on a Dask cluster, and what a wrong
file says.

usage: smoke_test.py PMSIM       in the environment `campaign` of tools/python_environment.py
"""

import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import pyarrow.parquet as pq

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent
CAMPAIGN = HERE / "smoke.yaml"
TUNED = ROOT / "tests/campaign/exact.yaml"  # which is like another
PMSIM = None
FATES = {"healthy": "ok", "broken": "lost with fault", "overhauled": "wrong direction", "wrong": "refused"}


def command(*words):
    return [sys.executable, str(ROOT / "tools/campaigns"), "--pmsim", str(PMSIM), *map(str, words)]


def tool(*words):
    return subprocess.run(command(*words), capture_output=True, text=True, check=False)


def rows(folder):
    """Without what depends on the clock."""
    table = pq.read_table(folder / "runs.parquet").drop_columns(["wall_s"])
    return table.to_pylist()


class Smoke(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.root.cleanup)
        cls.folder = Path(cls.root.name)
        cls.whole = cls.folder / "whole"
        cls.first = tool("run", CAMPAIGN, "--out", cls.whole, "--chunk", 2)

    def test_classes_are_what_was_done_to_the_machines(self):
        self.assertEqual(self.first.returncode, 0, self.first.stdout + self.first.stderr)
        for row in rows(self.whole):
            self.assertEqual(row["class"], FATES[row["group"]], row)
            self.assertEqual(row["cause"] == "HARDWARE", row["group"] == "broken", row["cause"])
            self.assertEqual("i_trip" in row["error"], row["group"] == "wrong", row["error"])
        figures = json.loads((self.whole / "summary.json").read_text(encoding="utf-8"))
        self.assertEqual(figures["classes"]["ok"]["runs"], 3)
        self.assertTrue(figures["pass"])
        text = (self.whole / "summary.md").read_text(encoding="utf-8")
        self.assertIn("| ok | 3 | 25.0 % | 5.5 % to 57.2 % |", text)
        self.assertIn("lost with fault: HARDWARE", text)
        self.assertGreater((self.whole / "page.png").stat().st_size, 20000)
        self.assertIn("PASS  ok ", self.first.stdout)

    def test_a_reader_that_has_enough_does_not_change_the_verdict(self):
        for words, code in ((("show", self.whole), 0), (("replay", self.whole, 0, "--out", self.folder / "read"), 0)):
            process = subprocess.Popen(command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            process.stdout.close()
            self.assertEqual((process.stderr.read(), process.wait()), ("", code))
            process.stderr.close()

    def test_a_bound_that_fails_fails(self):
        text = (
            CAMPAIGN.read_text(encoding="utf-8")
            .replace("min: 0.2", "min: 0.9")
            .replace("../../../sim_plant", str(ROOT / "sim_plant"))
        )
        path = self.folder / "bound.yaml"
        path.write_text(text.replace("smoke_start.yaml", str(HERE / "smoke_start.yaml")), encoding="utf-8")
        done = tool("run", path, "--runs", 4, "--out", self.folder / "bound")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("FAIL  ok ", done.stdout)

    def test_stopped_it_goes_on_to_the_same_results(self):
        folder = self.folder / "stopped"
        words = "run", CAMPAIGN, "--out", folder, "--chunk", 1, "--jobs", 1
        process = subprocess.Popen(command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        until = time.monotonic() + 120
        while len(list(folder.glob("parts/*.parquet"))) < 3 and time.monotonic() < until:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, errors)
        self.assertNotIn("Traceback", errors)
        kept = {path.name: path.stat().st_mtime_ns for path in folder.glob("parts/*.parquet")}
        self.assertIn("runs are kept", errors)
        self.assertTrue(3 <= len(kept) < 12, kept)
        self.assertFalse((folder / "runs.parquet").exists())
        shown = tool("show", folder)  # of what is there
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertIn(f"of {len(kept)} ", shown.stdout)
        again = tool(*words)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(rows(folder), rows(self.whole))
        self.assertFalse((folder / "parts").exists())
        third = tool(*words)  # nothing is left to be done
        self.assertEqual(third.returncode, 0, third.stderr)
        self.assertNotIn("simulated s per wall s", third.stdout)

    def test_killed_it_goes_on_too(self):
        folder = self.folder / "killed"
        words = "run", CAMPAIGN, "--out", folder, "--chunk", 1
        process = subprocess.Popen(command(*words), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 120
        while len(list(folder.glob("parts/*.parquet"))) < 2 and time.monotonic() < until:
            time.sleep(0.01)
        process.kill()
        process.wait()
        (folder / "parts" / "00000099.partial").write_bytes(b"half of a file")
        self.assertEqual(tool(*words).returncode, 0)
        self.assertEqual(rows(folder), rows(self.whole))

    def test_other_results_are_not_mixed_in(self):
        other = self.folder / "other.yaml"
        text = (
            CAMPAIGN.read_text(encoding="utf-8")
            .replace("seed: 3", "seed: 4")
            .replace("../../../sim_plant", str(ROOT / "sim_plant"))
        )
        other.write_text(text.replace("smoke_start.yaml", str(HERE / "smoke_start.yaml")), encoding="utf-8")
        done = tool("run", other, "--out", self.whole)
        self.assertEqual(done.returncode, 2)
        self.assertIn("another campaign", done.stderr)
        self.assertIn("--fresh", done.stderr)

    def test_a_run_is_replayed_with_its_trace(self):
        for number, fate in ((0, "NONE"), (1, "HARDWARE")):
            row = rows(self.whole)[number]
            out = self.folder / f"replay {number}"
            done = tool("replay", self.whole / "runs.parquet", number, "--out", out)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertNotIn("another build", done.stdout)
            items = json.loads((out / "result.json").read_text(encoding="utf-8"))["expectations"]
            self.assertEqual(
                {item["name"]: item["value"] for item in items}, {item["name"]: row[item["name"]] for item in items}
            )
            self.assertEqual(items[0]["value"], fate)
            with (out / "trace.csv").open(encoding="utf-8") as file:
                trace = list(csv.DictReader(file))
            self.assertGreater(len(trace), 1000)
            self.assertAlmostEqual(max(float(line["load_Nm"]) for line in trace), 4.0 * row["drawn.hoist"], places=3)
        refused = tool("replay", self.whole, 3, "--out", self.folder / "refused")
        self.assertEqual(refused.returncode, 0, refused.stderr)
        self.assertIn("i_trip", refused.stdout)
        unknown = tool("replay", self.whole, 99, "--out", self.folder / "unknown")
        self.assertEqual(unknown.returncode, 2)
        self.assertIn("0 to 11", unknown.stderr)

    def test_on_a_cluster_it_is_the_same(self):
        address, processes = self.folder / "scheduler.json", []
        quiet = {
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
            "env": {**os.environ, "PYTHONPATH": ""},
            "cwd": self.folder,
        }
        dask = Path(sys.executable).with_name("dask")
        try:
            processes.append(
                subprocess.Popen(
                    [
                        dask,
                        "scheduler",
                        "--host",
                        "127.0.0.1",
                        "--port",
                        "0",
                        "--no-dashboard",
                        "--scheduler-file",
                        address,
                    ],
                    **quiet,
                )
            )
            until = time.monotonic() + 60
            while not address.exists() and time.monotonic() < until:
                time.sleep(0.05)
            processes.append(
                subprocess.Popen(
                    [
                        dask,
                        "worker",
                        "--scheduler-file",
                        address,
                        "--nworkers",
                        "2",
                        "--nthreads",
                        "1",
                        "--no-dashboard",
                        "--local-directory",
                        self.folder,
                    ],
                    **quiet,
                )
            )
            scheduler = json.loads(address.read_text(encoding="utf-8"))["address"]
            folder = self.folder / "cluster"
            done = tool("run", CAMPAIGN, "--out", folder, "--scheduler", scheduler)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertEqual(rows(folder), rows(self.whole))
        finally:
            for process in reversed(processes):
                process.terminate()
            for process in processes:
                process.wait()

    def test_a_cluster_that_is_not_there_is_said(self):
        done = tool("run", CAMPAIGN, "--out", self.folder / "nowhere", "--scheduler", "tcp://127.0.0.1:9")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("127.0.0.1:9", done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        done = tool("run", CAMPAIGN, "--out", self.folder / "nowhere", "--scheduler", "foo")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("foo: ", done.stderr)
        self.assertNotIn("Traceback", done.stderr)

    def test_a_tuned_machine_runs(self):
        folder = self.folder / "tuned"
        done = tool("run", TUNED, "--runs", 1, "--out", folder, "--jobs", 1)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        (row,) = rows(folder)
        self.assertEqual(row["group"], "hub motor")
        self.assertGreater(row["simulated_s"], 0.5)
        shown = tool("show", folder)
        self.assertEqual(shown.returncode, done.returncode, shown.stderr)
        self.assertIn(f"{row['class']} ", shown.stdout)

    def test_what_pmsim_refuses_has_its_place_in_the_campaign(self):
        text = CAMPAIGN.read_text(encoding="utf-8").replace("../../../sim_plant", str(ROOT / "sim_plant"))
        text = text.replace("smoke_start.yaml", str(HERE / "smoke_start.yaml"))
        path = self.folder / "bad.yaml"
        for old, new, words in (
            ("psi_m_Wb: 0.236", "psi_m_mWb: 236", ("psi_m_mWb", "psi_m_Wb")),
            ("{i_trip: trip_A}", "{i_trap: 9}", ("i_trap",)),
            ("drive: {i_trip", "drove: {i_trip", ("drove",)),
            ("gain_error:", "gain_eror:", ("gain_eror",)),
            ("0.236 *", "-0.236 *", ("out of range",)),
        ):
            self.assertIn(old, text)
            path.write_text(text.replace(old, new, 1), encoding="utf-8")
            line = next(k for k, one in enumerate(text.splitlines(), 1) if old in one)
            done = tool("run", path, "--out", self.folder / "bad", "--jobs", 1)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertIn(f"bad.yaml:{line}: ", done.stderr)
            self.assertNotIn("Traceback", done.stderr)
            for word in words:
                self.assertIn(word, done.stderr)
        path.write_text(text.replace("variables: {hoist", "variables: {hosit: 1, hoist"), encoding="utf-8")
        done = tool("run", path, "--out", self.folder / "bad", "--jobs", 1)
        self.assertEqual(done.returncode, 2)
        self.assertIn("hosit", done.stderr)


if __name__ == "__main__":
    PMSIM = Path(sys.argv.pop(1)).absolute()
    unittest.main()
