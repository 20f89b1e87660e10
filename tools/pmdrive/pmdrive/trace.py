"""The drive's oscilloscope: set up, wait, fetch, write."""
import csv
import importlib.util
import struct
import time
from dataclasses import dataclass

from . import dictionary, names
from .drive import Drive
from .errors import NotDone, UsageError

SIGNALS = 8
OFF, ARM, NOW = 0, 1, 2
COMPLETE = 4
SHEET_MEMORY = 64 << 20  # bytes, that unpacking a data sheet may take
EDGES = {"rising": 0, "falling": 1, "both": 2}


@dataclass
class Recording:
    """Columns of physical values, with the time relative to the trigger."""

    entries: list
    time_s: list
    columns: list

    def write_csv(self, path):
        heads = [f"{e.name}_{e.unit.replace('/', '_').replace(' ', '')}" if e.unit not in ("", "1") else e.name
                 for e in self.entries]
        with open(path, "w", encoding="ascii", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["t_s", *heads])
            writer.writerows([f"{t:.9g}", *(f"{c[n]:.9g}" for c in self.columns)] for n, t in enumerate(self.time_s))

    def write_png(self, path):
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
        figure, axes = pyplot.subplots(len(self.entries), 1, sharex=True, squeeze=False,
                                       figsize=(9, 1.0 + 1.8 * len(self.entries)))
        for axis, entry, column in zip(axes[:, 0], self.entries, self.columns):
            axis.plot([1e3 * t for t in self.time_s], column, linewidth=0.8)
            axis.set_ylabel(f"{entry.name} / {entry.unit}" if entry.unit not in ("", "1") else entry.name)
            axis.axvline(0.0, color="grey", linewidth=0.5)
            axis.grid(True, alpha=0.3)
        axes[-1, 0].set_xlabel("t / ms")
        figure.tight_layout()
        figure.savefig(path, dpi=120)
        pyplot.close(figure)

    def write_mf4(self, path):
        import numpy
        from asammdf import MDF, Signal

        with MDF(version="4.10") as file:
            time_s = numpy.array(self.time_s)
            file.append([Signal(numpy.array(column), time_s, name=entry.name, unit=entry.unit, comment=entry.help)
                         for entry, column in zip(self.entries, self.columns)])
            file.save(path, overwrite=True)

    def write(self, path):
        """In the format that the name ends with."""
        writers = {".csv": self.write_csv, ".png": self.write_png, ".mf4": self.write_mf4}
        writers[check_path(path)](path)


def check_path(path):
    """The end of a file's name, if it can be written: known before something is recorded."""
    for end, package in ((".csv", None), (".png", "matplotlib"), (".mf4", "asammdf")):
        if str(path).endswith(end):
            if package and importlib.util.find_spec(package) is None:
                raise UsageError(f"a file of the kind {end} needs {package}",
                                 f"pip install 'pmdrive[{'plot' if end == '.png' else 'mdf'}]'")
            return end
    raise UsageError(f"`{path}` is neither .csv, .png nor .mf4")


def set_up(drive: Drive, signals, divider=1, pre=0.1, trigger=None, level=None, edge="rising"):
    """The signals by name; a trigger by the name of one of them and its level, as users write it."""
    entries = [names.find(name) for name in signals]
    if not 1 <= len(entries) <= SIGNALS:
        raise UsageError(f"{len(entries)} signals: 1 to {SIGNALS} are possible")
    for entry in entries:
        if entry.map not in ("tx", "both"):
            raise UsageError(f"{entry.label} cannot be recorded", "choose objects marked t in docs/object-dictionary.md")
    if trigger is None and level is not None:
        raise UsageError("a level without a trigger", "--trigger SIGNAL")
    if edge not in EDGES:
        raise UsageError(f"`{edge}` is no edge", ", ".join(EDGES))
    drive.write("trace.command", OFF)
    for n in range(SIGNALS):
        word = entries[n].index * 0x10000 + entries[n].sub * 0x100 if n < len(entries) else 0
        drive.write(f"trace_signal.{n + 1}", word)
    drive.set("trace.divider", divider)
    drive.set("trace.pretrigger", pre)
    drive.write("trace.trigger", 0)
    if trigger is not None:
        source = names.find(trigger)
        if source not in entries:
            raise UsageError(f"{source.label} triggers but is not among the signals")
        drive.write("trace.level", source.parse(0 if level is None else level))
        drive.write("trace.edge", EDGES[edge])
        drive.write("trace.trigger", entries.index(source) + 1)
    return entries


def record(drive: Drive, seconds=10.0, progress=None):
    """Arms and waits until all is recorded."""
    drive.write("trace.command", ARM)
    end = time.monotonic() + seconds
    while True:
        state = drive.read("trace.state")
        if state == COMPLETE:
            return
        if progress:
            progress(names.find("trace.state").values.get(state, str(state)))
        if time.monotonic() > end:
            drive.write("trace.command", OFF)
            raise NotDone(f"nothing was recorded in {seconds:g} s: {names.find('trace.state').values.get(state, state)}",
                          "check level and edge of the trigger, or record without one")
        time.sleep(0.02)


def fetch(drive: Drive, entries):
    """What was recorded, by block upload."""
    count, at = drive.read("trace.length"), drive.read("trace.at")
    scales = [drive.read(f"trace_scale.{n + 1}") for n in range(len(entries))]
    period_s = drive.read("trace.divider") / drive.read("f_pwm")
    data = upload_block(drive, names.find("trace_data"))
    if len(data) != 2 * count * len(entries):
        raise NotDone(f"{len(data)} bytes came, {2 * count * len(entries)} were expected", "record again")
    return unpack(data, entries, scales, period_s, at)


def unpack(data, entries, scales, period_s, at):
    samples = struct.unpack(f"<{len(data) // 2}h", data)
    columns = []
    for n, (entry, scale) in enumerate(zip(entries, scales)):
        factor = float(entry.scale) * (2.0**31 if entry.exp2 else scale) / 32768.0
        column = [factor * x for x in samples[n :: len(entries)]]
        columns.append([x % 1.0 for x in column] if entry.exp2 else column)
    time_s = [(n - at) * period_s for n in range(len(columns[0]))]
    return Recording(entries, time_s, columns)


def upload_block(drive: Drive, entry):
    def read(index, sub):
        with drive.node.sdo.open(index, sub, "rb", block_transfer=True) as file:
            return file.read()

    return drive._call(entry.label, entry.index, entry.sub, read)


def data_sheet(drive: Drive):
    """The text of the electronic data sheet that the device holds."""
    import lzma

    data = drive.read("stored_eds")
    if drive.read("stored_eds_format") != dictionary.EDS_FORMAT:
        raise NotDone("the data sheet in the device has a format that this tool does not know", "update this tool")
    try:
        return lzma.decompress(data, format=lzma.FORMAT_ALONE, memlimit=SHEET_MEMORY).decode("ascii")
    except (lzma.LZMAError, UnicodeDecodeError) as error:
        raise NotDone(f"the data sheet in the device cannot be read: {error}", "flash the board again") from None
