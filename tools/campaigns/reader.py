"""Reads a campaign file. What is wrong with it is said with file and line."""

from dataclasses import dataclass
from pathlib import Path

import yaml

from dictionary.source import load

from .draw import Source

KEYS = {
    "title", "like", "scenario", "runs", "seed", "base", "groups", "draw", "machine", "told", "variables", "classes",
    "bounds", "shown",
}  # fmt: skip
FILES = "like", "scenario", "base"
OK, REFUSED, OTHER = "ok", "refused", "other"


@dataclass
class Rule:
    """The first rule of which an expectation fails, or has no sample, gives the class of a run."""

    name: str
    fails: list
    empty: list


@dataclass
class Bound:
    """On the share of a class."""

    name: str
    least: float
    most: float


class CampaignFile:
    """What a file says. `like` names another whose keys hold where this one has none; `draw`, `machine` and `told` are
    laid over those of the other, entry by entry."""

    def __init__(self, path, files=None):
        """files: key -> path of what the file names, in place of what it says."""
        self.path, self.files = Path(path), files or {}
        own = load(self.path)
        own.only(KEYS)
        self.tables = [own]
        if "like" in own.nodes:
            self.tables.append(load(self._file("like")))
            self.tables[1].only(KEYS - {"like"})
        self.title = own.text("title")
        self.count = self._with("runs").integer("runs")
        self.seed = self._with("seed").integer("seed", 1)
        if self.count < 1:
            raise self._with("runs").error("`runs` is 1 or more", "runs")
        self.scenario_path = self._file("scenario")
        self.texts = {key: self._file(key).read_text(encoding="utf-8") for key in FILES if self._has(key)}
        self.texts["campaign"] = self.path.read_text(encoding="utf-8")
        self.base = self._base() if self._has("base") else None
        self.machine, self.told = self._sections("machine"), self._sections("told")
        self._check_machine()
        self.draw = self._laid("draw")
        self.groups = {"": {}}
        if self._has("groups"):
            groups = self._with("groups").table("groups")
            self.groups = {name: values(groups, name) for name in groups.nodes}
            if not self.groups:
                raise self._with("groups").error("`groups` is empty", "groups")
        self.variables = values(self._with("variables"), "variables")
        self.rules = [self._rule(entry) for entry in self._entries("classes", "a class")]
        self.bounds = [self._bound(entry) for entry in self._entries("bounds", "a bound")]
        self.shown = self._with("shown").texts("shown") if self._has("shown") else []
        self._check_names()

    def _has(self, key):
        return any(key in table.nodes for table in self.tables)

    def _with(self, key):
        """The table that holds for a key."""
        return next((table for table in self.tables if key in table.nodes), self.tables[0])

    def _entries(self, key, what):
        return self._with(key).tables(key, what) if self._has(key) else []

    def _file(self, key):
        table = self._with(key)
        path = self.files.get(key) or Path(table.place.file).parent / table.text(key)
        if not path.is_file():
            raise table.error(f"there is no file {path}", key)
        return path

    def _base(self):
        table, path = self._with("base"), self._file("base")
        try:
            base = yaml.safe_load(self.texts["base"])
        except yaml.YAMLError as error:
            raise table.error(f"{path}: {' '.join(str(error).split())}", "base") from None
        if not isinstance(base, dict) or "flux_map" in base:
            raise table.error(f"{path} is no machine file with `electrical`", "base")
        return base

    def _laid(self, key):
        found = {}
        for table in reversed(self.tables):
            found.update(values(table, key))
        return found

    def _sections(self, key):
        found = {}
        for table in reversed(self.tables):
            if key in table.nodes:
                inner = table.table(key)
                for section in inner.nodes:
                    found.setdefault(section, {}).update(values(inner, section))
        return found

    def _check_machine(self):
        if self.base is not None and self.told:
            raise self._with("told").error(
                "`told` is what tools/tune.py is told; with `base`, whose `drive` is complete, use `machine: drive:`",
                "told",
            )
        if self.base is None and not self.machine:
            raise self.tables[0].error(
                "`machine`, for tools/tune.py to complete, or `base`, a complete machine file, is missing"
            )

    @staticmethod
    def _rule(entry):
        entry.only({"class", "fails", "empty"})
        name = entry.text("class")
        if name in (OK, REFUSED, OTHER):
            raise entry.error(f"`{name}` is the class of runs to which no rule applies", "class")
        lists = {key: entry.texts(key) if key in entry.nodes else [] for key in ("fails", "empty")}
        if not any(lists.values()):
            raise entry.error("`fails` or `empty`, a list of expectations, is needed")
        return Rule(name, **lists)

    def _bound(self, entry):
        entry.only({"class", "min", "max"})
        name, limits = entry.text("class"), []
        if name not in {OK, REFUSED, OTHER, *(rule.name for rule in self.rules)}:
            raise entry.error(f"there is no class `{name}`", "class")
        if not {"min", "max"} & set(entry.nodes):
            raise entry.error("`min` or `max`, a share, is needed")
        for key, default in (("min", "0"), ("max", "1")):
            try:
                limits.append(float(entry.text(key, default)))
            except ValueError:
                raise entry.error(f"`{key}` is a share, 0 to 1", key) from None
        if not 0 <= limits[0] <= limits[1] <= 1:
            raise entry.error("shares are 0 to 1, `min` not above `max`")
        return Bound(name, *limits)

    def _check_names(self):
        """That rules speak of expectations that the scenario has, under names that are there once."""
        scenario = load(self.scenario_path)
        self.expectations = {}  # name -> metric
        for entry in scenario.tables("expect", "an expectation") if "expect" in scenario.nodes else []:
            name = entry.text("name", entry.text("metric"))
            if name in self.expectations:
                raise entry.error(f"`{name}` stands twice; a campaign needs a `name` of its own for each")
            self.expectations[name] = entry.text("metric")
        there = f"{self.scenario_path} has no expectation named `%s`; it has: {', '.join(self.expectations)}"
        for rule, entry in zip(self.rules, self._entries("classes", "a class")):
            for key, names in (("fails", rule.fails), ("empty", rule.empty)):
                for name in names:
                    if name not in self.expectations:
                        raise entry.error(there % name, key)
        for name in self.shown:
            if name not in self.expectations:
                raise self._with("shown").error(there % name, "shown")


def values(table, key):
    if key not in table.nodes:
        return {}
    inner = table.table(key)
    return {name: Source(table.place.file, node) for name, node in inner.nodes.items()}
