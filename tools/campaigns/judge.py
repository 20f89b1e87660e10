"""Class and cause of a run, from what pmsim says of it; shares of classes with their intervals."""

import math
import re

from .reader import OK, OTHER, REFUSED

REFUSES = "refuses"  # what the drive says of parameters that it does not run with
CONFIDENCE = 0.95


def refused(error):
    return REFUSES in error


def words(error):
    """An error without the paths and numbers of this run."""
    text = re.sub(r"^.*\.yaml:\d+(:\d+)?: |^pmsim: |^.*(?=drive refuses)", "", error.splitlines()[0])
    return re.sub(r"-?\d+(\.\d+)?(e-?\d+)?", "#", text)


def class_of(campaign, result):
    """(class, cause). result: what pmsim says, or {"error": text} of a run that was refused. A rule is about what was
    measured: an expectation without a sample makes no class of its own."""
    if "error" in result:
        return REFUSED, words(result["error"])
    items = {item["name"]: item for item in result["expectations"]}
    for rule in campaign.rules:
        for name in rule.fails:
            if not items[name]["pass"] and items[name]["value"] is not None:
                return rule.name, cause(items[name])
        for name in rule.empty:
            if items[name]["value"] is None:
                return rule.name, name
    failed = next((item for item in items.values() if not item["pass"]), None)
    return (OTHER, cause(failed)) if failed else (OK, "")


def cause(item):
    """A word says itself what it is: a fault, a state."""
    return item["value"] if isinstance(item["value"], str) else item["name"]


def tail(k, n, p):
    """Probability of k or more of n."""
    if p <= 0 or p >= 1:
        return float(p >= 1 or k <= 0)

    def chance(i):
        return math.exp(
            math.lgamma(n + 1)
            - math.lgamma(i + 1)
            - math.lgamma(n - i + 1)
            + i * math.log(p)
            + (n - i) * math.log1p(-p)
        )

    return 1 - sum(map(chance, range(k))) if 2 * k < n else sum(map(chance, range(k, n + 1)))


def _root(increasing, target):
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if increasing(middle) < target else (low, middle)
    return 0.5 * (low + high)


def interval(k, n):
    """Clopper and Pearson's interval of a share, k of n, at 95 %: never narrower than it should be."""
    if n == 0:
        return 0.0, 1.0
    half = 0.5 * (1 - CONFIDENCE)
    low = 0.0 if k == 0 else _root(lambda p: tail(k, n, p), half)
    high = 1.0 if k == n else _root(lambda p: tail(k + 1, n, p), 1 - half)
    return low, high
