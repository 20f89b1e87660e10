"""Formulas of a campaign file: arithmetic of numbers and names, and nothing else of Python."""

import ast
import math
import operator

FUNCTIONS = {
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
    "hypot": math.hypot,
    "abs": abs,
    "min": min,
    "max": max,
    "round": round,
    "floor": math.floor,
    "ceil": math.ceil,
}
CONSTANTS = {"pi": math.pi, "true": True, "false": False, "untold": None}  # what `told` leaves to tools/tune.py
BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Mod: operator.mod,
}
UNARY = {ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_}
COMPARE = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


class FormulaError(Exception):
    """What is wrong with a formula or its values."""


def parse(text):
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError):
        raise FormulaError(f"`{text}` is no number and no formula") from None


def evaluate(text, names):
    """Value of a formula: a number, a flag or a word."""
    try:
        return _value(parse(text), names)
    except (ZeroDivisionError, OverflowError, ValueError, TypeError) as error:
        raise FormulaError(f"`{text}` has no value here: {error}") from None


def _name(node):
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):  # drive.acceleration
        head = _name(node.value)
        return head and f"{head}.{node.attr}"
    return None


def _value(node, names):
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str)):
        return node.value
    name = _name(node)
    if name in names:
        return names[name]
    if name in CONSTANTS:
        return CONSTANTS[name]
    if name:
        raise FormulaError(f"`{name}` is not known here; known are: {', '.join(sorted(names)) or 'no names'}")
    if isinstance(node, ast.BinOp) and type(node.op) in BINARY:
        return BINARY[type(node.op)](_value(node.left, names), _value(node.right, names))
    if isinstance(node, ast.UnaryOp) and type(node.op) in UNARY:
        return UNARY[type(node.op)](_value(node.operand, names))
    if isinstance(node, ast.IfExp):
        return _value(node.body if _value(node.test, names) else node.orelse, names)
    if isinstance(node, ast.BoolOp):
        found = (bool(_value(part, names)) for part in node.values)
        return all(found) if isinstance(node.op, ast.And) else any(found)
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARE:
        return COMPARE[type(node.ops[0])](_value(node.left, names), _value(node.comparators[0], names))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in FUNCTIONS:
            raise FormulaError(f"there is no function `{node.func.id}`; there are: {', '.join(sorted(FUNCTIONS))}")
        return FUNCTIONS[node.func.id](*(_value(part, names) for part in node.args))
    raise FormulaError(f"`{ast.unparse(node)}` is more than arithmetic")
