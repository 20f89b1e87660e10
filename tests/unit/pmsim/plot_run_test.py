"""plot_run.py draws a trace, short or long, and refuses what is none."""

import math
import pathlib
import subprocess
import sys
import tempfile

SCRIPT = "tools/plot_run.py"
COLUMNS = ("t_s", "angle_error_deg", "omega_mech_rad_s", "omega_hat_mech_rad_s", "omega_ref_mech_rad_s", "ia_A",
           "ib_A", "ic_A", "id_A", "iq_A", "torque_Nm", "load_Nm", "v_dc_V", "loads_Nm", "open_loop", "weight", "state", "fault")


def write_trace(folder, rows):
    lines = [",".join(COLUMNS)]
    for k in range(rows):
        t = 0.001 * k
        state = "finding" if t < 0.1 else ("running" if t < 0.9 else "fault")
        numbers = [t] + [math.sin(0.05 * k + n) for n in range(len(COLUMNS) - 4)]
        weight = min(1.0, max(0.0, t - 0.3) / 0.2)
        fault = "STALL" if t >= 0.9 else "NONE"
        lines.append(",".join([f"{x:.6g}" for x in numbers + [weight]] + [state, fault]))
    (folder / "trace.csv").write_text("\n".join(lines) + "\n")


def run(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True, check=False)


def refused(reason, *arguments):
    result = run(*arguments)
    assert (result.returncode, reason in result.stderr, "Traceback" in result.stderr) == (2, True, False), result.stderr


def check_marks(folder):
    """The open loop is shaded, a fault marked with its name, link and all loads drawn; an older trace has neither."""
    sys.path.insert(0, "tools")
    import plot_run

    write_trace(folder, 1000)
    run_data = plot_run.read_trace(folder / "trace.csv")
    figure = plot_run.plot(run_data, "A title")
    axes = figure.axes
    assert "Link (V)" in [axis.get_ylabel() for axis in axes]
    assert "STALL" in [text.get_text() for text in axes[0].texts]
    assert all(any(line.get_color() == plot_run.RED and list(line.get_xdata()) == [0.9, 0.9] for line in axis.lines) for axis in axes)
    assert "open loop" in [text.get_text() for text in axes[1].get_legend().get_texts()]
    assert "all loads" in [text.get_text() for text in axes[3].get_legend().get_texts()]
    for name in ("open_loop", "loads_Nm"):
        del run_data[name]
    legend = plot_run.plot(run_data, "").axes[1].get_legend()
    assert "open loop" not in [text.get_text() for text in legend.get_texts()]


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        assert run(folder).returncode != 0, "there is no trace yet"
        check_marks(folder)
        for rows in (1, 1000):
            write_trace(folder, rows)
            (folder / "summary.txt").write_text("A title\nPASS x\n")
            result = run(folder, "-o", folder / "demo.png")
            assert result.returncode == 0, result.stderr
            picture = (folder / "demo.png").read_bytes()
            assert picture.startswith(b"\x89PNG"), "not a picture"
            assert len(picture) > 20000, "nothing drawn"
        for words, reason in ((("-o", folder / "a.foo"), "a.foo is no picture"), (("-o", folder / "no" / "a.png"), "No such file"),
                              (("--dpi", "0"), "--dpi 0 is not 1 to")):
            refused(reason, folder, *words)
        trace = folder / "trace.csv"
        rows = trace.read_text().splitlines()
        for wrong, reason in (("a,b\n1,2\n", "it has no t_s"), ("\n".join(rows[:2] + ["x" + rows[2]]), "trace.csv:3: "),
                              ("\n".join(rows[:2] + [rows[2][:9]]), "trace.csv:3: "), ("\n".join(rows[:2]) + ",7\n", "trace.csv:2: "),
                              (rows[0], "no data")):
            trace.write_text(wrong)
            refused(reason, trace)
        trace.write_bytes(b"\x89PNG\r\n\xff\xfe")
        refused("not a row of a trace", trace)


if __name__ == "__main__":
    main()
