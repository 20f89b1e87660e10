"""pmsim as a user meets it: exit codes, what it prints, what it writes."""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile

PMSIM = sys.argv[1]
SCENARIO = """title: small
machine: {machine}
start: {{theta_e_deg: $angle}}
duration_s: 0.3
sweep: {{angle: [30, 60]}}
profile:
  - {{t_s: 0, mode: speed, speed_rel: 0.1, enable: true}}
expect:
  - {{metric: fault, equals: NONE, book: "1.1"}}
  - {{metric: current_peak_A, max: 8, book: "9.2"}}
  - {{metric: angle_error_max_deg, max: 30, book: "5.9"}}
"""


def pmsim(*arguments):
    return subprocess.run([PMSIM, *map(str, arguments)], capture_output=True, text=True, check=False)


def expect_exit(code, *arguments):
    result = pmsim(*arguments)
    assert result.returncode == code, f"{arguments}: exit {result.returncode}\n{result.stdout}{result.stderr}"
    return result


def check_help():
    text = expect_exit(0, "--help").stdout
    for command in ("run", "plant", "params", "metrics", "methods", "bench", "record"):
        assert command in text, command
        expect_exit(0, command, "--help")
    expect_exit(2)
    expect_exit(2, "rum")
    expect_exit(2, "run")
    expect_exit(2, "run", "--no-such-option", "x.yaml")


def check_tables():
    assert "152 implemented" in expect_exit(0, "methods").stdout
    assert "flux_bandwidth" in expect_exit(0, "params").stdout
    assert "angle_error_mean_deg" in expect_exit(0, "metrics").stdout


def check_run(folder, scenario):
    out = folder / "out"
    result = expect_exit(0, "run", scenario, "--out", out)
    assert "PASS  fault" in result.stdout and "2 of 2" in result.stdout, result.stdout
    for name in ("trace.csv", "summary.txt", "runs.csv"):
        assert (out / name).stat().st_size > 0, name
    again = folder / "again"
    expect_exit(0, "run", scenario, "--out", again, "--jobs", 1)
    for name in ("trace.csv", "summary.txt", "runs.csv"):
        assert (out / name).read_bytes() == (again / name).read_bytes(), name

    one = json.loads(expect_exit(0, "run", scenario, "--json", "--set", "angle=45").stdout)
    assert one["pass"] is True and one["runs"] == 1 and one["expectations"][0]["value"] == "NONE"
    seeds = json.loads(expect_exit(0, "run", scenario, "--json", "--seeds", 3).stdout)
    assert seeds["runs"] == 6 and seeds["expectations"][2]["seeds"] == 3
    shown = seeds["expectations"][2]
    assert shown["best"] <= shown["median"] <= shown["value"] and shown["best"] < shown["value"], shown
    expect_exit(0, "run", scenario, "--seeds", 2, "--set", "angle=30", "--out", folder / "seeds")
    rows = list(csv.DictReader((folder / "seeds" / "runs.csv").open()))
    assert [row["seed"] for row in rows] == ["1", "2"] and rows[0]["angle_error_max_deg"] != rows[1]["angle_error_max_deg"], rows
    assert json.loads((folder / "seeds" / "result.json").read_text())["runs"] == 2
    expect_exit(2, "run", scenario, "--seeds", 0)
    failed = expect_exit(1, "run", scenario, "--set", "sensor.offset_A=[1, 0, 0]")
    assert "FAIL  " in failed.stdout, failed.stdout


def check_refusals(folder, scenario):
    wrong = folder / "wrong.yaml"
    wrong.write_text(scenario.read_text().replace("duration_s", "duration_ms"))
    message = expect_exit(2, "run", wrong).stderr
    assert f"{wrong}:4:1: unknown key" in message and 'did you mean "duration_s"?' in message, message
    expect_exit(2, "run", folder / "none.yaml")
    expect_exit(2, "run", scenario, "--set", "no_such=1")
    expect_exit(2, "run", scenario, "--set", "flux_bandwidth")
    expect_exit(2, "record", scenario, "--out", folder / "x.rec")


def check_inputs_are_safe(folder, scenario):
    """Neither trace.csv, summary.txt nor runs.csv lands on the scenario or the machine."""
    text = scenario.read_text()
    machine = folder / "machine.yaml"
    machine.write_text(pathlib.Path("sim_plant/machines/ipm_1000.yaml").read_text())
    for name in ("trace.csv", "summary.txt", "runs.csv"):
        for kind in ("scenario", "machine", "link"):
            out = folder / f"safe_{kind}_{name}"
            out.mkdir()
            target = out / name
            given = scenario
            if kind == "scenario":
                target.write_text(text)
                given = target
            elif kind == "machine":
                target.write_bytes(machine.read_bytes())
                given = out / "s.yaml"
                given.write_text(text.replace(str(pathlib.Path("sim_plant/machines/ipm_1000.yaml").resolve()), name))
            else:
                target.symlink_to(scenario)
            before = sorted(path.name for path in out.iterdir())
            message = expect_exit(2, "run", given, "--out", out).stderr
            assert f"{target}: would overwrite an input" in message, message
            assert sorted(path.name for path in out.iterdir()) == before, "something was written"
            assert target.read_bytes() == (machine.read_bytes() if kind == "machine" else text.encode())
    # one run writes no runs.csv
    expect_exit(0, "run", folder / "safe_scenario_runs.csv" / "runs.csv", "--set", "angle=30", "--out",
                folder / "safe_scenario_runs.csv")
    message = expect_exit(2, "record", scenario, "--set", "angle=30", "--periods", 5, "--out", scenario).stderr
    assert "would overwrite an input" in message and scenario.read_text() == text, message
    message = expect_exit(2, "params", "--machine", machine, "--page", machine).stderr
    assert "would overwrite an input" in message, message


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scenario = folder / "small.yaml"
        scenario.write_text(SCENARIO.format(machine=pathlib.Path("sim_plant/machines/ipm_1000.yaml").resolve()))
        check_help()
        check_tables()
        check_run(folder, scenario)
        check_refusals(folder, scenario)
        check_inputs_are_safe(folder, scenario)
        record = folder / "small.rec"
        expect_exit(0, "record", scenario, "--set", "angle=30", "--periods", 50, "--out", record)
        assert record.read_bytes().startswith(b"PMREC003")
        assert "plant alone" in expect_exit(0, "bench", scenario, "--repeat", 1).stdout


if __name__ == "__main__":
    main()
