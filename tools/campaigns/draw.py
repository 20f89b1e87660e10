"""Distributions of a campaign file. Each name has a random stream of its own, seeded by campaign, run and name: a value
stays what it is when other names come or go, or when runs are made in another order."""

import math
import random

import yaml

from dictionary.source import Place, as_text

from .formula import FormulaError, evaluate

KINDS = {"uniform": 2, "log": 2, "integer": 2, "normal": 2, "one_of": None}
HELP = "uniform: [low, high], log: [low, high], integer: [low, high], normal: [mean, deviation], one_of: [...]"


def stream(*what):
    """Random numbers that depend on what they are for alone."""
    return random.Random("/".join(map(str, what)))


def uniform(random_, low, high):
    if not low <= high:
        raise FormulaError(f"uniform: [{low:g}, {high:g}] needs low <= high")
    return random_.uniform(low, high)


def log(random_, low, high):
    if not 0 < low <= high:
        raise FormulaError(f"log: [{low:g}, {high:g}] needs 0 < low <= high")
    return math.exp(random_.uniform(math.log(low), math.log(high)))


def integer(random_, low, high):
    if low != int(low) or high != int(high) or low > high:
        raise FormulaError(f"integer: [{low:g}, {high:g}] needs whole numbers, the lower one first")
    return random_.randint(int(low), int(high))


def normal(random_, mean, deviation):
    return random_.gauss(mean, deviation)


def factors(random_, names, spread):
    """A factor for each of what is told wrong, up to `spread` either way."""
    return {name: uniform(random_, 1 - spread, 1 + spread) for name in names}


def number_or_word(text):
    """Of one_of: what is no number is a word."""
    if text in ("true", "false"):
        return text == "true"
    try:
        return int(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return text


class Source:
    """A value as the file gives it: number, formula, distribution, or list of these."""

    def __init__(self, file, node):
        self.place, self.node = Place(file, node), node

    def value(self, names, *what):
        """names: of formulas; what: the value is for, which seeds it."""
        try:
            return self._value(names, what)
        except FormulaError as error:
            raise self.place.error(str(error)) from None

    def _value(self, names, what):
        node, file = self.node, self.place.file
        if isinstance(node, yaml.ScalarNode):
            return evaluate(node.value, names)
        if isinstance(node, yaml.SequenceNode):
            return [Source(file, item).value(names, *what, k) for k, item in enumerate(node.value)]
        entries = [(as_text(Place(file, key), key), value) for key, value in node.value]
        if len(entries) == 1 and entries[0][0] in KINDS:
            return self._drawn(*entries[0], names, what)
        unknown = next((key for key, _ in entries if key not in KINDS), None)
        if unknown is None or len(entries) == 1:
            raise FormulaError(f"one distribution is needed: {HELP}")
        return {
            key: Source(file, value).value(names, *what, key) for key, value in entries
        }  # an entry of a list of tables

    def _drawn(self, kind, node, names, what):
        file = self.place.file
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise FormulaError(f"`{kind}` needs a list")
        if kind == "one_of":
            return number_or_word(as_text(self.place, stream(*what).choice(node.value)))
        ends = [Source(file, item).value(names, *what, k) for k, item in enumerate(node.value)]
        if len(ends) != KINDS[kind] or any(isinstance(end, (str, list, dict)) for end in ends):
            raise FormulaError(f"`{kind}` needs two numbers")
        return {"uniform": uniform, "log": log, "integer": integer, "normal": normal}[kind](stream(*what), *ends)
