"""A campaign file, and what its runs are made of: run n depends on the file and n alone."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import yaml

import tune
from dictionary.source import SourceError, load

from .draw import Source, stream

KEYS = {
    "title",
    "scenario",
    "runs",
    "seed",
    "base",
    "groups",
    "draw",
    "machine",
    "told",
    "variables",
    "classes",
    "bounds",
    "shown",
}
OK, REFUSED, OTHER = "ok", "refused", "other"


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


@dataclass
class Rule:
    """The first rule of which an expectation fails gives the class of a run."""

    name: str
    fails: list


@dataclass
class Bound:
    """On the share of a class."""

    name: str
    least: float
    most: float


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


class Campaign:
    """What a file says; its text and that of its scenario are kept with the results."""

    def __init__(self, path, files=None):
        """files: key -> path of what the file names, in place of what it says."""
        self.path, self.files = Path(path), files or {}
        table = load(self.path)
        table.only(KEYS)
        self.text = self.path.read_text(encoding="utf-8")
        self.title = table.text("title")
        self.count, self.seed = table.integer("runs"), table.integer("seed", 1)
        if self.count < 1:
            raise table.error("`runs` is 1 or more", "runs")
        self.scenario_path = self._file(table, "scenario")
        self.scenario = self.scenario_path.read_text(encoding="utf-8")
        self.base = self._base(table) if "base" in table.nodes else None
        self.machine, self.machine_place = self._sections(table, "machine"), table.at("machine")
        self.told = self._sections(table, "told")
        if self.base is not None and self.told:
            raise table.error(
                "`told` is what tools/tune.py is told; with `base`, whose `drive` is complete, use `machine: drive:`",
                "told",
            )
        if self.base is None and not self.machine:
            raise table.error(
                "`machine`, for tools/tune.py to complete, or `base`, a complete machine file, is missing"
            )
        self.draw = self._values(table, "draw")
        self.groups = {"": {}}
        if "groups" in table.nodes:
            groups = table.table("groups")
            self.groups = {name: self._values(groups, name) for name in groups.nodes}
            if not self.groups:
                raise table.error("`groups` is empty", "groups")
        self.variables = self._values(table, "variables")
        self.rules = (
            [self._rule(entry) for entry in table.tables("classes", "a class")] if "classes" in table.nodes else []
        )
        self.bounds = (
            [self._bound(entry) for entry in table.tables("bounds", "a bound")] if "bounds" in table.nodes else []
        )
        self.shown = table.texts("shown") if "shown" in table.nodes else []
        self._check_names(table)

    @classmethod
    def stored(cls, what):
        """As it was when the results were made, of their record (store.record)."""
        with tempfile.TemporaryDirectory() as folder:
            files = {"scenario": Path(folder) / what["scenario_file"], "base": Path(folder) / "base.yaml"}
            path = Path(folder) / Path(what["campaign_file"]).name
            for file, text in (
                (path, what["campaign"]),
                (files["scenario"], what["scenario"]),
                (files["base"], what["base"]),
            ):
                file.write_text(text, encoding="utf-8")
            return cls(path, files)

    def _file(self, table, key):
        path = self.files.get(key) or self.path.parent / table.text(key)
        if not path.is_file():
            raise table.error(f"there is no file {path}", key)
        return path

    def _base(self, table):
        path = self._file(table, "base")
        try:
            base = yaml.safe_load(path.read_text(encoding="utf-8"))
        except yaml.YAMLError as error:
            raise table.error(f"{path}: {' '.join(str(error).split())}", "base") from None
        if not isinstance(base, dict) or "flux_map" in base:
            raise table.error(f"{path} is no machine file with `electrical`", "base")
        return base

    @staticmethod
    def _values(table, key):
        if key not in table.nodes:
            return {}
        inner = table.table(key)
        return {name: Source(table.place.file, node) for name, node in inner.nodes.items()}

    def _sections(self, table, key):
        if key not in table.nodes:
            return {}
        inner = table.table(key)
        return {name: self._values(inner, name) for name in inner.nodes}

    @staticmethod
    def _rule(entry):
        entry.only({"class", "fails"})
        name = entry.text("class")
        if name in (OK, REFUSED, OTHER):
            raise entry.error(f"`{name}` is the class of runs to which no rule applies", "class")
        return Rule(name, entry.texts("fails"))

    def _bound(self, entry):
        entry.only({"class", "min", "max"})
        name, limits = entry.text("class"), []
        if name not in {OK, REFUSED, OTHER, *(rule.name for rule in self.rules)}:
            raise entry.error(f"there is no class `{name}`", "class")
        for key, default in (("min", "0"), ("max", "1")):
            try:
                limits.append(float(entry.text(key, default)))
            except ValueError:
                raise entry.error(f"`{key}` is a share, 0 to 1", key) from None
        if not 0 <= limits[0] <= limits[1] <= 1:
            raise entry.error("shares are 0 to 1, `min` not above `max`")
        return Bound(name, *limits)

    def _check_names(self, table):
        """That rules speak of expectations that the scenario has, under names that are there once."""
        scenario = load(self.scenario_path)
        self.expectations = []
        for entry in scenario.tables("expect", "an expectation") if "expect" in scenario.nodes else []:
            name = entry.text("name", entry.text("metric"))
            if name in self.expectations:
                raise entry.error(f"`{name}` stands twice; a campaign needs a `name` of its own for each")
            self.expectations.append(name)
        for index, rule in enumerate(self.rules):
            for name in rule.fails:
                if name not in self.expectations:
                    place = table.tables("classes", "a class")[index]
                    raise place.error(
                        f"{self.scenario_path} has no expectation named `{name}`; it has: "
                        f"{', '.join(self.expectations)}",
                        "fails",
                    )

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
        told = laid_over({"name": name, **truth}, self._evaluated(self.told, names, number))
        try:
            completed = self._completed(told)
        except tune.UsageError as error:
            return {}, str(error)
        return laid_over(completed, {section: entries for section, entries in truth.items() if section != "drive"}), ""

    def _completed(self, told):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", encoding="utf-8") as file:
            file.write(machine_text(told))
            file.flush()
            try:
                read = tune.read(file.name)
            except tune.UsageError as error:
                reason = str(error).removeprefix(file.name + ": ")
                raise SourceError(f"{self._section_place(reason)}: {reason}") from None
        return yaml.load(tune.text_of(read), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))

    def _section_place(self, reason):
        """Of the section that tools/tune.py names."""
        for section, entries in self.machine.items():
            if f"{section}." in reason and entries:
                return next(iter(entries.values())).place
        return self.machine_place

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
