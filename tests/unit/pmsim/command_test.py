"""pmsim as a user meets it: exit codes, what it prints, what it writes."""

import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

PMSIM = sys.argv[1]
PARAMETER_VALUES = pathlib.Path(__file__).parents[3] / "tools/pmsim/parameter_values.def"
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
    for command in ("run", "plant", "params", "metrics", "keys", "methods", "bench", "record"):
        assert command in text, command
        expect_exit(0, command, "--help")
    expect_exit(2)
    assert 'unknown command "rum"; did you mean "run"?' in expect_exit(2, "rum").stderr
    wrong = expect_exit(2, "frobnicate", "x.yaml").stderr
    assert wrong.startswith('pmsim: unknown command "frobnicate"; known: run, board,'), wrong
    assert 'pmsim: unknown option "--versoin"; --help lists all\n' == expect_exit(2, "--versoin").stderr
    expect_exit(2, "run")
    expect_exit(2, "run", "--no-such-option", "x.yaml")


def check_tables():
    assert "152 implemented" in expect_exit(0, "methods").stdout
    assert len(expect_exit(0, "methods", "--class", "pwm").stdout.splitlines()) == 3  # head, row 48, sum
    assert "persistent" in expect_exit(0, "methods", "--classes").stdout
    wrong = expect_exit(2, "methods", "--class", "pusles").stderr
    assert wrong.startswith('--class: "pusles" is none of benchmark, freewheeling, fundamental,'), wrong
    assert 'did you mean "pulses"?' in wrong, wrong
    params = expect_exit(0, "params").stdout
    assert "flux_bandwidth" in params
    values = params.split("\ninjection ")[1].split("\n")[1:16]  # of the parameter injection
    assert values[4] == "    4  sine along d, its own phase measured: quiet, little moved by the inverter", values
    assert values[13].startswith("   13  voltages at the neutrals") and not values[14].startswith(" "), values
    indented = [line for line in params.splitlines() if line.startswith(" ")]
    assert len(indented) == PARAMETER_VALUES.read_text().count("\nPM_VALUE(")
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
    for command, option, value in (("run", "--seeds", 0), ("run", "--jobs", -3), ("run", "--decimate", 0), ("bench", "--repeat", 0),
                                   ("record", "--periods", 0), ("record", "--periods", -1), ("node", "--duration", 0),
                                   ("node", "--duration", "nan")):
        message = expect_exit(2, command, scenario, option, value).stderr
        assert message.startswith(f"{option}: {value} must be a number above 0\n"), message


def check_full_output(scenario):
    """What was printed did not arrive: not the exit code of success."""
    for arguments in (("params",), ("--help",), ("run", scenario, "--set", "angle=30"), ("run", scenario, "--set", "angle=30", "--json")):
        with open("/dev/full", "w", encoding="utf-8") as full:
            result = subprocess.run([PMSIM, *map(str, arguments)], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        assert result.returncode == 2 and "standard output cannot be written" in result.stderr, (arguments, result)


def check_no_sample(folder, scenario):
    few = folder / "no_sample.yaml"
    few.write_text(scenario.read_text() + "  - {metric: angle_error_mean_deg, window_s: [0, 0.001], max: 30, book: \"5.9\"}\n")
    result = expect_exit(1, "run", few, "--set", "angle=30")
    assert re.search(r"FAIL  angle_error_mean_deg\S* +no sample  <= 30", result.stdout), result.stdout


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


def check_page(folder):
    """For the board that its images are for: what that refuses is said, and shunts that it has not."""
    whole = pathlib.Path("sim_plant/machines/teknic_m2310p.yaml").resolve()
    page = folder / "page.bin"
    board = [word for value in ("sensor.shunt=low_side", "sensor.settle_s=1.3e-6", "v_dc_derate=30") for word in ("--set", value)]
    assert expect_exit(0, "params", "--machine", whole, *board, "--set", "v_dc_max=31.9", "--page", page).stderr == ""
    message = expect_exit(0, "params", "--machine", whole, *board, "--set", "v_dc_max=32.1", "--page", page).stderr
    assert "B-G431B-ESC1 refuses parameter v_dc_max: beyond what the board bears" in message, message
    assert "t_settle" not in message, message
    message = expect_exit(0, "params", "--machine", whole, *board[4:], "--set", "v_dc_max=31.9", "--page", page).stderr
    assert "t_settle is 0" in message and "shunt: low_side" in message and "refuses" not in message, message
    shown = expect_exit(0, "params", "--machine", whole, "--set", "R_s=0.4").stdout.splitlines()
    values = {line.split()[0]: line.split()[3] for line in shown if line.split()[1] in ("ohm", "Wb")}
    assert values["R_s"] == "0.4" and values["psi_m"] == "0.006395", values
    few = folder / "few.yaml"
    few.write_text(whole.read_text().replace("torque_rated_Nm", "# torque_rated_Nm"))
    message = expect_exit(2, "params", "--machine", few, "--page", page).stderr
    assert "is missing; complete it first: pmsim tune FILE -o tuned.yaml" in message, message


def check_node_examples():
    """The examples of the help: their scenario takes what they set. A recording needs no bus."""
    examples = [line.split() for line in expect_exit(0, "node", "--help").stdout.splitlines() if "pmsim node tests/" in line]
    assert len(examples) == 2, examples
    for words in examples:
        given = [word for n, word in enumerate(words) if "--set" in words[n - 1:n + 1]]
        expect_exit(0, "record", words[2], *given, "--periods", 1, "--out", "/dev/null")


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
        check_full_output(scenario)
        check_no_sample(folder, scenario)
        check_page(folder)
        check_node_examples()
        record = folder / "small.rec"
        expect_exit(0, "record", scenario, "--set", "angle=30", "--periods", 50, "--out", record)
        assert record.read_bytes().startswith(b"PMREC003")
        assert "plant alone" in expect_exit(0, "bench", scenario, "--repeat", 1).stdout


if __name__ == "__main__":
    main()
