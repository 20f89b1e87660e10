"""A campaign file, and what its runs are made of: run n depends on the file and n alone."""

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

import yaml

import tune
from dictionary.source import SourceError

from .draw import stream
from .reader import FILES, CampaignFile


@dataclass
class Run:
    number: int
    group: str
    seed: int
    drawn: dict  # name -> number, flag or word
    machine: str  # text of its machine file; of a refused one empty
    settings: dict  # name -> value, as --set takes them
    refusal: str = ""  # why tools/tune.py makes no machine file of it

    def job(self):
        return {"machine": self.machine, "settings": self.settings}


def number_text(value):
    """As YAML 1.1 and pmsim both take it for a number."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    text = f"{value:.9g}"
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def flow(value):
    """A value in one line of YAML."""
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(x)}" for key, x in value.items()) + "}"
    if isinstance(value, str):
        try:
            return number_text(float(value))  # 1e3, a word of YAML 1.1
        except ValueError:
            return yaml.safe_dump(value, default_flow_style=True, width=1000).strip().removesuffix("...").strip()
    return number_text(value)


def machine_text(machine):
    """One key a line, so that a line says which key is meant."""
    lines = []
    for section, entries in machine.items():
        if isinstance(entries, dict):
            lines.append(f"{section}:")
            lines += [f"  {key}: {flow(value)}" for key, value in entries.items()]
        else:
            lines.append(f"{section}: {flow(entries)}")
    return "\n".join(lines) + "\n"


def laid_over(machine, sections):
    """The sections of a machine file with others above them, key by key."""
    result = {name: dict(entries) if isinstance(entries, dict) else entries for name, entries in machine.items()}
    for name, entries in sections.items():
        result[name] = {**result.get(name, {}), **entries}
    return result


def chosen(sections):
    """Without what is `untold`, nor sections that have nothing else."""
    left = {name: {key: x for key, x in entries.items() if x is not None} for name, entries in sections.items()}
    return {name: entries for name, entries in left.items() if entries}


class Campaign(CampaignFile):
    """A file, and its runs."""

    @classmethod
    def stored(cls, what):
        """As it was when the results were made, of their record (store.record)."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / what["campaign_file"]
            path.write_text(what["campaign"], encoding="utf-8")
            files = {}
            for key in FILES:
                if key in what:
                    files[key] = Path(folder) / (what["scenario_file"] if key == "scenario" else f"{key}.yaml")
                    files[key].write_text(what[key], encoding="utf-8")
            return cls(path, files)

    def group_of(self, number):
        names = list(self.groups)
        return names[number % len(names)]

    def run(self, number):
        group = self.group_of(number)
        drawn = self._drawn(number, self.groups[group])
        machine, refusal = self._machine(number, group, drawn)
        seed = stream(self.seed, number, "seed").getrandbits(31)
        if refusal:
            return Run(number, group, seed, drawn, "", {}, refusal)
        settings = {"seed": seed}
        if self.variables:
            names = dict(drawn)
            for section, entries in machine.items():
                if isinstance(entries, dict):
                    names.update((f"{section}.{key}", value) for key, value in entries.items())
            for name, source in self.variables.items():
                value = names[name] = source.value(names, self.seed, number, name)
                settings[name] = value if isinstance(value, str) else number_text(value)
        return Run(number, group, seed, drawn, machine_text(machine), settings)

    def _drawn(self, number, of_group):
        names = {}
        for name, source in {**of_group, **{k: v for k, v in self.draw.items() if k not in of_group}}.items():
            names[name] = source.value(names, self.seed, number, name)
            if isinstance(names[name], (list, dict)):
                raise source.place.error(f"`{name}` is one value; lists stand in `machine`")
        return names

    def _machine(self, number, group, drawn):
        """(sections, "") or ({}, why it is refused)."""
        truth = self._evaluated(self.machine, drawn, number)
        name = f"{group or self.title} {number}"
        if self.base is not None:
            return laid_over({**self.base, "name": name}, truth), ""
        names = dict(drawn)
        for section, entries in truth.items():
            names.update((f"{section}.{key}", value) for key, value in entries.items())
        told = {"name": name, **chosen(laid_over(truth, self._evaluated(self.told, names, number)))}
        try:
            completed = self._completed(told)
        except tune.UsageError as error:
            return {}, str(error)
        return laid_over(completed, {section: entries for section, entries in truth.items() if section != "drive"}), ""

    def _completed(self, told):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", encoding="utf-8") as file:
            text = machine_text(told)
            file.write(text)
            file.flush()
            try:
                read = tune.read(file.name)
            except tune.UsageError as error:
                line, reason = re.match(r"(?::(\d+):\d+)?: (.*)", str(error).removeprefix(file.name), re.DOTALL).groups()
                place = self.place_of(text, int(line)) if line else None
                raise SourceError(f"{place or self._section_place(reason)}: {reason}") from None
        return yaml.load(tune.text_of(read), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))

    def _section_place(self, reason):
        """Of the section that tools/tune.py names."""
        for section, entries in self.machine.items():
            if f"{section}." in reason and entries:
                return next(iter(entries.values())).place
        return self._with("machine").at("machine")

    def _evaluated(self, sections, names, number):
        return {
            section: {key: source.value(names, self.seed, number, section, key) for key, source in entries.items()}
            for section, entries in sections.items()
        }

    def place_of(self, machine, line):
        """Where the campaign file says what stands in that line of a machine file; None if it does not."""
        section = None
        for number, text in enumerate(machine.splitlines(), 1):
            key = as_key(text)
            section = key if not text.startswith(" ") else section
            if number == line:
                for sections in (self.machine, self.told):
                    entries = sections.get(section, {})
                    if key in entries:
                        return entries[key].place
                    if key == section and entries:
                        return next(iter(entries.values())).place
        return None


def as_key(line):
    return line.strip().partition(":")[0]
