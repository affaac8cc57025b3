# SPDX-License-Identifier: MIT
"""The same mistakes in Python, of the judge and the client: `ast` says what stands where."""
import ast
import re

from mutants.mutant import mutants_of
from mutants.names import twins

LOOSER = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">"}
TURNED = {ast.Lt: ">", ast.LtE: ">=", ast.Gt: "<", ast.GtE: "<=", ast.Eq: "!=", ast.NotEq: "==", ast.In: "not in",
          ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is"}
SIGNS = {ast.Add: "-", ast.Sub: "+"}
BOUNDS = {"min", "max", "abs", "clip", "minimum", "maximum"}
CLEARS = (ast.Constant, ast.List, ast.Dict, ast.Tuple)
SMALL = 16


def complaint(file, text):
    try:
        compile(text, file, "exec")
    except SyntaxError as error:
        return str(error)
    return ""


def mutants(file, text):
    return mutants_of(file, text, Reader(text).all())


class Reader:
    def __init__(self, text):
        self.text, self.lines = text, [0]
        for line in text.encode().split(b"\n"):
            self.lines.append(self.lines[-1] + len(line) + 1)
        self.bytes = text.encode()
        self.known = set(re.findall(r"[A-Za-z_]\w*", text))
        self.found, self.function = [], ""

    def span(self, node):
        places = (self.lines[node.lineno - 1] + node.col_offset, self.lines[node.end_lineno - 1] + node.end_col_offset)
        return tuple(len(self.bytes[:place].decode()) for place in places)

    def part(self, node):
        return self.text[slice(*self.span(node))]

    def all(self):
        """Of functions alone: what stands outside them has been executed before a mutant is chosen."""
        for node in ast.walk(ast.parse(self.text)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                self.function = node.name
                for statement in node.body:
                    self.inside(statement)
        return self.found

    def inside(self, node):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.JoinedStr, ast.Match)):
            return  # a function inside has its own turn
        name = type(node).__name__
        if isinstance(node, ast.stmt):
            self.statement(node)
        elif hasattr(self, f"of_{name}") and not isinstance(getattr(node, "ctx", None), (ast.Store, ast.Del)):
            getattr(self, f"of_{name}")(node)
        for child in ast.iter_child_nodes(node):
            self.inside(child)

    def change(self, kind, node, *edits, form="expression"):
        self.found.append((self.function, kind, tuple(sorted(edits)), (*self.span(node), form)))

    def instead(self, kind, node, new):
        self.change(kind, node, (*self.span(node), new))

    def statement(self, node):
        start, _ = self.span(node)
        alone = not self.text[self.text.rfind("\n", 0, start) + 1:start].strip()
        if isinstance(node, (ast.If, ast.While)):
            for new in ("False", "True") if isinstance(node, ast.If) else ("False",):
                self.instead("lost condition", node.test, new)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and alone:
            self.change("lost call", node, (*self.span(node), "pass"), form="statement")
        elif isinstance(node, ast.AugAssign) and alone:
            self.change("forgotten clear", node, (*self.span(node), "pass"), form="statement")
        elif isinstance(node, ast.Assign) and alone and not isinstance(node.targets[0], ast.Name):
            self.change("forgotten clear", node, (*self.span(node), "pass"), form="statement")

    # ---- expressions ----

    def of_Compare(self, node):
        left, right, sign = node.left, node.comparators[0], type(node.ops[0])
        start, end = self.span(left)[1], self.span(right)[0]
        between = self.text[start:end]
        if between.strip() == between.strip("( )\n") and len(node.ops) == 1:
            for table in (LOOSER, TURNED):
                if sign in table:
                    self.change("comparison", node, (start, end, f" {table[sign]} "))
        if len(node.ops) == 2:
            self.instead("half a check", node, self.text[self.span(left)[0]:self.span(right)[1]])
            self.instead("half a check", node, self.text[self.span(right)[0]:self.span(node)[1]])

    def of_BoolOp(self, node):
        for left_out in node.values:
            word = " and " if isinstance(node.op, ast.And) else " or "
            self.instead("lost condition", node, word.join(self.part(one) for one in node.values if one is not left_out))

    def of_IfExp(self, node):
        for side in (node.body, node.orelse):
            self.instead("lost condition", node, self.part(side))

    def of_BinOp(self, node):
        start, end = self.span(node.left)[1], self.span(node.right)[0]
        sign = type(node.op)
        if sign in SIGNS and self.text[start:end].strip() in "+-":
            self.change("sign", node, (start, end, f" {SIGNS[sign]} "))
            if self.part(node.right) == "1":
                self.instead("off by one", node, self.part(node.left))
        if sign in (ast.Mult, ast.Div) and isinstance(node.right, ast.Constant):
            self.instead("unit", node, self.part(node.left))

    def of_UnaryOp(self, node):
        if isinstance(node.op, (ast.USub, ast.Not)):
            self.instead("sign" if isinstance(node.op, ast.USub) else "comparison", node, self.part(node.operand))

    def of_Call(self, node):
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        if name in BOUNDS and node.args and not any(isinstance(one, ast.Starred) for one in node.args):
            for one in node.args[:2] if len(node.args) == 2 else [one for one in node.args[:1] if name in ("abs", "clip")]:
                alone = isinstance(one, (ast.Name, ast.Attribute, ast.Call, ast.Constant, ast.Subscript))
                self.instead("lost bound", node, self.part(one) if alone else f"({self.part(one)})")
        for one, two in zip(node.args, node.args[1:]):
            if type(one) is type(two) and not isinstance(one, ast.Constant) and self.part(one) != self.part(two):
                self.change("copy error", node, (*self.span(one), self.part(two)), (*self.span(two), self.part(one)))

    def of_Constant(self, node):
        value = node.value
        if value is True or value is False:
            self.instead("enumerator", node, str(not value))
        elif isinstance(value, int):
            self.instead("off by one", node, str(value + 1)) if abs(value) <= SMALL else self.instead(
                "unit", node, str(value // 1000 if value % 1000 == 0 else value * 2))
        elif isinstance(value, float):
            self.instead("unit", node, repr(value * (1000 if "e" in self.part(node) else 2)))

    def of_Name(self, node):
        for kind, other in twins(node.id, self.known):
            self.instead(kind, node, other)

    def of_Attribute(self, node):
        end = self.span(node)[1]
        for kind, other in twins(node.attr, self.known):
            self.change(kind, node, (end - len(node.attr), end, other))
