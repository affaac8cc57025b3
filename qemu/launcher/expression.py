# SPDX-License-Identifier: MIT
"""Arithmetic in scenario files: `0.1 * rated_current_A`, `abs(speed_rpm) > overspeed_rpm`.

Only numbers, names, + - * / and unary minus, one comparison, `and`/`or`, and a few functions; evaluated on floats or on
numpy arrays. Nothing of Python can be reached from it.
"""
import ast
import operator
import re

import numpy as np

from .errors import LauncherError, instead

_BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
            ast.Eq: operator.eq, ast.NotEq: operator.ne}
_LOGIC = {ast.And: np.logical_and, ast.Or: np.logical_or}
_FUNCTIONS = {"abs": np.abs, "min": np.minimum, "max": np.maximum, "round": np.round}


def evaluate(text, names):
    """The value of the expression `text`; `names` maps each allowed name to a float or an array."""
    try:
        tree = ast.parse(str(text).strip(), mode="eval")
    except (SyntaxError, ValueError) as error:
        raise LauncherError(f"'{text}' is not an expression") from error
    return _value(tree.body, names, text)


def _value(node, names, text):
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise LauncherError(f"'{text}': unknown name '{node.id}'" + instead(node.id, sorted(names)))
        return names[node.id]
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_value(node.left, names, text), _value(node.right, names, text))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_value(node.operand, names, text)
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        left = _value(node.left, names, text)
        return _COMPARE[type(node.ops[0])](left, _value(node.comparators[0], names, text))
    if isinstance(node, ast.BoolOp):
        parts = [_value(part, names, text) for part in node.values]
        result = parts[0]
        for part in parts[1:]:
            result = _LOGIC[type(node.op)](result, part)
        return result
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS \
            and not node.keywords:
        return _FUNCTIONS[node.func.id](*[_value(argument, names, text) for argument in node.args])
    raise LauncherError(f"'{text}' holds something other than numbers, names and arithmetic")


def names_in(text):
    """The names that an expression uses; none of what is no expression."""
    try:
        return {node.id for node in ast.walk(ast.parse(str(text).strip(), mode="eval")) if isinstance(node, ast.Name)}
    except (SyntaxError, ValueError):
        return set()


def number(text_or_number, names):
    """A float from a TOML number or an expression string."""
    if isinstance(text_or_number, bool):
        raise LauncherError(f"'{text_or_number}' is not a number")
    if isinstance(text_or_number, (int, float)):
        return float(text_or_number)
    value = evaluate(text_or_number, names)
    if np.ndim(value) != 0:
        raise LauncherError(f"'{text_or_number}' is not a single number")
    return float(value)


def fill(template, names):
    """`torque {0.1 * rated_current_A:.2f}` with every brace replaced; the default format is %g."""
    def replace(match):
        return format(number(match.group(1), names), match.group(2) or "g")

    try:
        return re.sub(r"\{([^{}:]*)(?::([^{}]*))?\}", replace, template)
    except ValueError as error:
        raise LauncherError(f"'{template}': {error}") from error
