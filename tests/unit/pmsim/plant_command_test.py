"""`pmsim plant` as a user meets it: exit codes, files, messages with the line."""

import csv
import pathlib
import subprocess
import sys
import tempfile

PMSIM = sys.argv[1]
MACHINE = "sim_plant/machines/teknic_m2310p.yaml"
ROWS = "t_s,va_V,vb_V,vc_V\n0,1,0,0\n1e-4,1,0,0\n2e-4,0,0,0\n"


def pmsim(*arguments):
    return subprocess.run([PMSIM, *map(str, arguments)], capture_output=True, text=True, check=False)


def expect_exit(code, *arguments):
    result = pmsim(*arguments)
    assert result.returncode == code, f"{arguments}: exit {result.returncode}\n{result.stdout}{result.stderr}"
    return result


class Folder:
    """Input and output of one run after the other; `refused` also sees that nothing was written."""

    def __init__(self, folder):
        self.input, self.out = folder / "in.csv", folder / "out.csv"

    def run(self, text, machine=MACHINE, *more):
        self.input.write_text(text)
        expect_exit(0, "plant", machine, "--input", self.input, "--out", self.out, *more)
        with self.out.open(encoding="ascii") as file:
            return list(csv.DictReader(file))

    def refused(self, text, message, machine=MACHINE, *more):
        self.out.unlink(missing_ok=True)
        self.input.write_text(text)
        result = expect_exit(2, "plant", machine, "--input", self.input, "--out", self.out, *more)
        assert message in result.stderr, f"{message}\nis not in\n{result.stderr}"
        assert not self.out.exists(), "an output was written"


def check_runs(folder):
    rows = folder.run(ROWS)
    assert [float(row["t_s"]) for row in rows] == [0, 1e-4, 2e-4], rows
    assert list(rows[0]) == ["t_s", "ia_A", "ib_A", "ic_A", "theta_e_rad", "omega_mech_rad_s", "torque_Nm",
                             "psi_d_Vs", "psi_q_Vs", "v_neutral_V"], list(rows[0])
    assert float(rows[1]["ia_A"]) > 0 and float(rows[0]["ia_A"]) == 0
    turned = folder.run(ROWS, MACHINE, "--set", "start.theta_e_deg=90")
    assert abs(float(turned[0]["theta_e_rad"]) - 1.5707963267948966) < 1e-15
    again = folder.out.read_bytes()
    folder.run(ROWS, MACHINE, "--set", "start.theta_e_deg=90")
    assert folder.out.read_bytes() == again, "two runs differ"


def check_floats(folder):
    rows = folder.run("t_s,va_V,vb_V\n0,1,0\n1e-4,1,0\n2e-4,0,0\n", MACHINE, "--float", "c")
    assert list(rows[0])[-2:] == ["v_neutral_V", "vc_V"], list(rows[0])
    assert all(abs(float(row["ic_A"])) < 1e-9 for row in rows), rows
    assert float(rows[1]["ia_A"]) > 0 and 0 < float(rows[1]["vc_V"]) < 1, rows
    folder.refused(ROWS, "--float d: no terminal of this machine; one of: a, b, c", MACHINE, "--float", "d")
    folder.refused(ROWS, "--float x: no terminal of this machine; one of: a, b, c", MACHINE, "--float", "x")


def check_table_errors(folder):
    place = str(folder.input)
    folder.refused(ROWS.replace("va_V", "va_mV"), f"{place}:1: unknown column \"va_mV\": wrong unit; did you mean "
                   "\"va_V\"?")
    folder.refused(ROWS.replace(",vc_V", ""), f"{place}:1: column \"vc_V\" is missing")
    folder.refused(ROWS.replace("vb_V", "va_V"), f"{place}:1: column \"va_V\" stands here a second time")
    folder.refused(ROWS.replace("t_s,", "t_s,speed,"), f"{place}:1: unknown column \"speed\"")
    folder.refused(ROWS.replace("1e-4,1,0,0", "1e-4,1,0"), f"{place}:3: expected 4 values, found 3")
    folder.refused(ROWS.replace("1e-4,1", "1e-4,one"), f"{place}:3: expected a number for va_V, found \"one\"")
    folder.refused(ROWS.replace("2e-4,0", "2e-4,nan"), f"{place}:4: \"nan\" for va_V is not a finite number")
    folder.refused(ROWS.replace("2e-4", "1e-4"), f"{place}:4: t_s must ascend")
    folder.refused(ROWS.replace("0,1,0,0", "0,1e9,0,0"), f"{place}:2: va_V = 1e+09 is out of range")
    folder.refused("", f"{place}: cannot be read, or is empty")
    folder.refused("t_s,va_V,vb_V,vc_V\n", f"{place}: there are no rows")


def check_other_errors(folder):
    folder.refused(ROWS, "none.yaml: cannot be read", "none.yaml")
    folder.refused(ROWS, "--set electrical.R_s_mohm", MACHINE, "--set", "electrical.R_s_mohm=1")
    for parameter in ("R_s", "drive.R_s"):
        folder.refused(ROWS, f"--set {parameter}: a parameter of the drive has no effect on the plant alone; did you mean "
                       "\"electrical.R_s_ohm\"?", MACHINE, "--set", f"{parameter}=50")
    folder.refused(ROWS, "vx_V\" is missing", "sim_plant/machines/dtp_400.yaml")
    folder.input.unlink()
    result = expect_exit(2, "plant", MACHINE, "--input", folder.input, "--out", folder.out)
    assert f"{folder.input}: cannot be read" in result.stderr, result.stderr
    folder.input.write_text(ROWS)
    nowhere = folder.out.parent / "none" / "out.csv"
    result = expect_exit(2, "plant", MACHINE, "--input", folder.input, "--out", nowhere)
    assert "there is no such folder" in result.stderr, result.stderr
    result = expect_exit(2, "plant", MACHINE, "--input", folder.input, "--out", folder.input)
    assert "would overwrite an input" in result.stderr and folder.input.read_text() == ROWS, result.stderr
    expect_exit(2, "plant", MACHINE, "--input", folder.input)


def check_inputs_are_safe(folder):
    """No output lands on a file that was read: machine, table, input, by whatever path."""
    place = folder.out.parent
    table, machine = place / "map.csv", place / "m.yaml"
    points = [(i_d, i_q) for i_d in (-2, -1, 0, 1) for i_q in (-2, -1, 0, 1)]
    table.write_text("i_d_A,i_q_A,psi_d_Vs,psi_q_Vs\n" +
                     "".join(f"{d},{q},{0.1 + 0.004 * d},{0.006 * q}\n" for d, q in points))
    machine.write_text("name: m\nelectrical: {R_s_ohm: 1, pole_pairs: 4}\nmechanics: {J_kgm2: 1.0e-5}\n"
                       "flux_map: {table: map.csv}\n")
    folder.input.write_text(ROWS)
    link, hard = place / "link.csv", place / "hard.csv"
    link.symlink_to(table)
    hard.hardlink_to(folder.input)
    indirect = place / ".." / place.name
    for out, read in ((folder.input, folder.input), (indirect / "in.csv", folder.input), (hard, folder.input),
                      (machine, machine), (table, table), (link, table)):
        before = read.read_bytes()
        message = expect_exit(2, "plant", machine, "--input", folder.input, "--out", out).stderr
        assert f"{out}: would overwrite an input" in message, message
        assert read.read_bytes() == before and link.is_symlink(), out
    link.unlink()
    hard.unlink()
    expect_exit(0, "plant", machine, "--input", folder.input, "--out", folder.out)


def check_run_refuses(folder):
    """The closed loop needs what the plant alone does not."""
    for machine in ("dtp_400", "ow_400", "bldc_fan"):
        text = pathlib.Path(f"sim_plant/machines/{machine}.yaml").read_text().split("\ndrive:")[0] + "\n"
        path = folder.out.parent.resolve() / f"{machine}.yaml"
        path.write_text(text)
        scenario = folder.out.parent / "s.yaml"
        scenario.write_text(f"title: t\nmachine: {path}\nstart: {{theta_e_deg: 0}}\nduration_s: 0.1\nprofile: []\n")
        message = expect_exit(2, "run", scenario).stderr
        assert f"{path}: drive.pole_pairs is missing" in message, message


def main():
    assert "Example" in expect_exit(0, "plant", "--help").stdout
    with tempfile.TemporaryDirectory() as name:
        folder = Folder(pathlib.Path(name))
        check_runs(folder)
        check_floats(folder)
        check_table_errors(folder)
        check_other_errors(folder)
        check_inputs_are_safe(folder)
        check_run_refuses(folder)


if __name__ == "__main__":
    main()
