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
ATOMS = (ast.Name, ast.Attribute, ast.Call, ast.Constant, ast.Subscript)
OTHERS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.JoinedStr, ast.Match)  # with a turn of its own, or a text
SMALL = 16


def mutants(file, text):
    return mutants_of(file, text, Reader(text).all())


class Reader:
    def __init__(self, text):
        self.text, self.bytes, self.lines = text, text.encode(), [0]
        for line in self.bytes.split(b"\n"):
            self.lines.append(self.lines[-1] + len(line) + 1)
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
            if isinstance(node, OTHERS[:2]):
                self.function = node.name
                for statement in node.body:
                    self.inside(statement)
        return self.found

    def inside(self, node):
        if isinstance(node, OTHERS):
            return
        rule = getattr(self, f"of_{type(node).__name__}", None)
        if rule and not isinstance(getattr(node, "ctx", None), (ast.Store, ast.Del)):
            rule(node)
        for child in ast.iter_child_nodes(node):
            self.inside(child)

    def change(self, kind, node, *edits, form="expression"):
        self.found.append((self.function, kind, tuple(sorted(edits)), (*self.span(node), form)))

    def instead(self, kind, node, new, form="expression"):
        self.change(kind, node, (*self.span(node), new), form=form)

    def of_If(self, node):
        for new in ("False", "True"):
            self.instead("lost condition", node.test, new)

    def of_Expr(self, node):
        start, _ = self.span(node)
        kind = "lost call" if isinstance(node, ast.Expr) else "forgotten clear"
        if not self.text[self.text.rfind("\n", 0, start) + 1:start].strip() and (
                isinstance(node, ast.AugAssign) or isinstance(getattr(node, "value", None), ast.Call) and kind == "lost call" or
                kind != "lost call" and not isinstance(node.targets[0], (ast.Name, ast.Tuple))):
            self.instead(kind, node, "pass", "statement")

    of_Assign = of_AugAssign = of_Expr

    def of_Compare(self, node):
        (first, _), (_, last) = self.span(node.left), self.span(node.comparators[0])
        start, end = self.span(node.left)[1], self.span(node.comparators[0])[0]
        if len(node.ops) == 2:
            self.instead("half a check", node, self.text[first:last])
            self.instead("half a check", node, self.text[end:self.span(node)[1]])
        elif not set("()") & set(self.text[start:end]):
            for table in (LOOSER, TURNED):
                if type(node.ops[0]) in table:
                    self.change("comparison", node, (start, end, f" {table[type(node.ops[0])]} "))

    def of_BoolOp(self, node):
        word = " and " if isinstance(node.op, ast.And) else " or "
        for left_out in node.values:
            self.instead("lost condition", node, word.join(self.part(one) for one in node.values if one is not left_out))

    def of_IfExp(self, node):
        for side in (node.body, node.orelse):
            self.instead("lost condition", node, self.part(side))

    def of_BinOp(self, node):
        start, end, sign = self.span(node.left)[1], self.span(node.right)[0], type(node.op)
        if sign in SIGNS and self.text[start:end].strip() in "+-":
            self.change("sign", node, (start, end, f" {SIGNS[sign]} "))
            if self.part(node.right) == "1":
                self.instead("off by one", node, self.part(node.left))
        if sign in (ast.Mult, ast.Div) and isinstance(node.right, ast.Constant):
            self.instead("unit", node, self.part(node.left))

    def of_UnaryOp(self, node):
        kind = {ast.USub: "sign", ast.Not: "comparison"}.get(type(node.op))
        if kind:
            self.instead(kind, node, self.part(node.operand))

    def of_Call(self, node):
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        if name in BOUNDS and not any(isinstance(one, ast.Starred) for one in node.args):
            for one in node.args if len(node.args) == 2 else node.args[:1] if name in ("abs", "clip") else ():
                self.instead("lost bound", node, self.part(one) if isinstance(one, ATOMS) else f"({self.part(one)})")
        for one, two in zip(node.args, node.args[1:]):
            if type(one) is type(two) and not isinstance(one, ast.Constant) and self.part(one) != self.part(two):
                self.change("copy error", node, (*self.span(one), self.part(two)), (*self.span(two), self.part(one)))

    def of_Constant(self, node):
        value = node.value
        if isinstance(value, bool):
            self.instead("enumerator", node, str(not value))
        elif isinstance(value, int):
            small, whole = abs(value) <= SMALL, value % 1000 == 0
            other = value + 1 if small else value // 1000 if whole else value * 2
            self.instead("off by one" if small else "unit", node, str(other))
        elif isinstance(value, float):
            self.instead("unit", node, repr(value * (1000 if "e" in self.part(node) else 2)))

    def of_Name(self, node):
        end, name = self.span(node)[1], getattr(node, "id", getattr(node, "attr", None))
        for kind, other in twins(name, self.known):
            self.change(kind, node, (end - len(name), end, other))

    of_Attribute = of_Name
