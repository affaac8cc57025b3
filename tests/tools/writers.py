# SPDX-License-Identifier: MIT
"""Which contexts write which part of struct axis, by the source of all of firmware/: docs/contexts.md is held to it.

    writers.py            compares; a line for each difference
    writers.py --write    draws the page's table anew; the reasons in its last column stay
    writers.py --why PART the functions that write it, each with a way there from its context's root

A function writes a part where it assigns to it, or to something inside, by the axis or by a pointer to that part's structure;
where it hands out an address inside that is not const, the function that hands it out counts. A context runs what its roots
reach: by calls, and by pointers, which may hold whatever an initializer, an assignment or an argument anywhere puts into that
member, variable or parameter. So no writer is missed; a context may be named where no run ever comes.
"""
import os
import re
import sys
from pathlib import Path

from clang.cindex import CursorKind as K
from clang.cindex import TypeKind

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests")]

from mutants.c import Parser  # noqa: E402

PAGE = ROOT / "docs/contexts.md"
HEAD = "| part | written by | if by more than one |\n|---|---|---|\n"
ROW = re.compile(r"(?m)^\| `(\w+)` \| ([^|]*?) \|([^|]*)\|$")
CONTEXTS = ("interrupt", "slow loop", "thread")
START_UP = "start-up"
# Whom the vectors and the assembly of an entry name. What main() calls before the first of them may run is nobody's beside it.
ROOTS = {"interrupt": r"handlers_\w+_ab(_1)?|current_loop_fault|I2C1_SMBus_IRQHandler", "slow loop": "Timer1_IRQHandler",
         "thread": "main"}
BEFORE_ALL = ("init_axes", "boot_core", "boot_check", "start_axes")
ASSIGNS = re.compile(r"([-+*/%&|^]|<<|>>)?=$")
LOOSE = (K.UNEXPOSED_EXPR, K.PAREN_EXPR, K.CSTYLE_CAST_EXPR)


class Program:
    """What the translation units say, gathered: functions' calls, what may be behind a pointer, writes."""

    def __init__(self):
        self.calls, self.by_pointer, self.holds, self.takes, self.writes = {}, {}, {}, {}, {}
        self.parts, self.inside = [], {}  # of struct axis; {structure: parts of this type}
        self.known = set()

    def read(self, unit):
        if not self.parts:
            self.layout(unit)
        for cursor in unit.cursor.get_children():
            if cursor.kind == K.FUNCTION_DECL and cursor.is_definition():
                name = cursor.spelling
                if name not in self.known:
                    self.known.add(name)
                    self.body(cursor, name)
            elif cursor.kind == K.VAR_DECL:
                self.table(cursor)

    def layout(self, unit):
        axis = next((c for c in unit.cursor.get_children()
                     if c.kind == K.STRUCT_DECL and c.spelling == "axis" and c.is_definition()), None)
        for field in axis.type.get_fields() if axis else ():
            self.parts.append(field.spelling)
            if bare(field.type).kind == TypeKind.RECORD:
                self.inside.setdefault(bare(field.type).spelling, set()).add(field.spelling)

    # ---- what runs ----

    def table(self, cursor):
        """An initializer's functions: by the member of a structure they stand for, or by the array's name."""
        for init in cursor.get_children():
            if init.kind == K.INIT_LIST_EXPR:
                self.filled(init, cursor.type, variable(cursor))
            elif init.kind.is_expression():
                self.hold(variable(cursor), init)

    def filled(self, init, type_, name):
        type_ = type_.get_canonical()
        if type_.kind in (TypeKind.CONSTANTARRAY, TypeKind.INCOMPLETEARRAY):
            for child in init.get_children():
                self.element(child, type_.element_type, name)
        elif type_.kind == TypeKind.RECORD:
            fields, at = list(type_.get_fields()), 0
            names = [field.spelling for field in fields]
            for child in init.get_children():
                named = [c.spelling for c in child.get_children() if c.kind == K.MEMBER_REF and c.spelling in names]
                at = names.index(named[0]) if named else at
                if at < len(fields):
                    self.element(child, fields[at].type, f"{bare(type_).spelling}.{fields[at].spelling}")
                at += 1

    def element(self, child, type_, name):
        lists = [child] if child.kind == K.INIT_LIST_EXPR else [c for c in child.get_children() if c.kind == K.INIT_LIST_EXPR]
        if lists:
            self.filled(lists[-1], type_, name)
        else:
            self.hold(name, child)

    def hold(self, place, expression):
        """A function that is named there, not called; and what other places have held."""
        if expression.kind == K.DECL_REF_EXPR and expression.referenced.kind == K.FUNCTION_DECL:
            self.holds.setdefault(place, set()).add(expression.spelling)
        elif other := self.place(expression):
            self.takes.setdefault(place, set()).add(other)
        for child in list(expression.get_children())[expression.kind == K.CALL_EXPR:]:
            self.hold(place, child)

    def called(self, call, caller):
        children = list(call.get_children())
        target = call.referenced
        if target is not None and target.kind == K.FUNCTION_DECL:
            self.calls.setdefault(caller, set()).add(target.spelling)
            for n, argument in enumerate(call.get_arguments()):
                self.hold(f"{target.spelling}({n})", argument)
        elif children:
            for one in [children[0], *children[0].walk_preorder()]:
                place = self.place(one)
                if place:
                    self.by_pointer.setdefault(caller, set()).add(place)

    @staticmethod
    def place(one):
        """Where a pointer to a function may lie: a member of a structure, a parameter, a variable."""
        meant = one.referenced if one.kind in (K.MEMBER_REF_EXPR, K.DECL_REF_EXPR) else None
        if meant is None:
            return None
        if meant.kind == K.FIELD_DECL:
            return f"{bare(meant.semantic_parent.type).spelling}.{meant.spelling}"
        if meant.kind == K.PARM_DECL:
            function = meant.semantic_parent
            names = [a.spelling for a in function.get_arguments()]
            return f"{function.spelling}({names.index(meant.spelling)})" if meant.spelling in names else None
        return variable(meant) if meant.kind == K.VAR_DECL else None

    def held(self, place):
        """Functions that may be behind it, by whatever way they came there."""
        seen, work = {place}, [place]
        while work:
            for other in self.takes.get(work.pop(), ()):
                if other not in seen:
                    seen.add(other)
                    work.append(other)
        return set().union(*(self.holds.get(one, set()) for one in seen))

    # ---- what writes ----

    def body(self, cursor, name, above=()):
        for one in cursor.get_children():
            self.expression(one, name, above)
            self.body(one, name, (*above[-1:], one))

    def expression(self, one, name, above):
        if one.kind == K.CALL_EXPR:
            self.called(one, name)
        elif one.kind in (K.BINARY_OPERATOR, K.COMPOUND_ASSIGNMENT_OPERATOR):
            left, right = list(one.get_children())[:2]
            if one.kind == K.COMPOUND_ASSIGNMENT_OPERATOR or assigns(one, left):
                self.written(self.parts_of(left), name)
                for place in filter(None, (self.place(c) for c in left.walk_preorder())):
                    self.hold(place, right)
        elif one.kind == K.UNARY_OPERATOR:
            inner = next(one.get_children())
            if is_address(one, inner):
                self.handed(inner, name, above)
            elif steps(one):
                self.written(self.parts_of(inner), name)
        elif decays(one) and not (above and above[-1].kind == K.ARRAY_SUBSCRIPT_EXPR):
            self.handed(next(one.get_children()), name, (*above, one))
        elif one.kind == K.VAR_DECL:
            self.table(one)

    def written(self, parts, function):
        for part in parts:
            self.writes.setdefault(part, set()).add(function)

    def handed(self, inner, function, above):
        """An address that leaves: who gets it writes by the type, if only one part has it; or else this counts as a write."""
        alone = len(self.inside.get(bare(inner.type).spelling, ())) == 1 and bare(inner.type).kind == TypeKind.RECORD
        read_only = inner.type.is_const_qualified() or \
            (above and above[-1].kind in LOOSE and pointee(above[-1].type).is_const_qualified())
        if not alone and not read_only:
            self.written(self.parts_of(inner), function)

    def parts_of(self, one):
        """Of what struct axis holds, the parts in which this lies."""
        children = list(one.get_children())
        if one.kind == K.MEMBER_REF_EXPR and children:
            by_pointer = children[0].type.get_canonical().kind == TypeKind.POINTER
            base = bare(pointee(children[0].type)).spelling
            if base == "struct axis":
                return {one.spelling}
            return self.by_type(base) if by_pointer else self.parts_of(children[0])
        if one.kind == K.UNARY_OPERATOR:  # *p
            base = bare(one.type).spelling
            return set(self.parts) if base == "struct axis" else self.by_type(base)
        if one.kind in (*LOOSE, K.ARRAY_SUBSCRIPT_EXPR) and children:
            return self.parts_of(children[0])
        return set()

    def by_type(self, name):
        found = self.inside.get(name, set())
        return found if len(found) == 1 else set()

    # ---- together ----

    def run_by(self, roots, without=()):
        """{function: the one that calls it} of all that the roots reach."""
        way = {root: None for root in roots}
        work = list(way)
        while work:
            function = work.pop()
            after = set(self.calls.get(function, ()))
            for place in self.by_pointer.get(function, ()):
                after |= self.held(place)
            for other in sorted(after - set(without)):
                if other not in way and other in self.known:
                    way[other] = function
                    work.append(other)
        return way

    def ways(self):
        return {context: self.run_by(sorted(f for f in self.known if re.fullmatch(pattern, f)), BEFORE_ALL)
                for context, pattern in ROOTS.items()}


def bare(type_):
    type_ = type_.get_canonical()
    while type_.kind in (TypeKind.CONSTANTARRAY, TypeKind.INCOMPLETEARRAY):
        type_ = type_.element_type.get_canonical()
    declared = type_.get_declaration()
    return declared.type if type_.kind == TypeKind.RECORD else type_


def variable(cursor):
    """A local one's name is its function's."""
    parent = cursor.semantic_parent
    return f"{parent.spelling}:{cursor.spelling}" if parent.kind == K.FUNCTION_DECL else cursor.spelling


def pointee(type_):
    type_ = type_.get_canonical()
    return type_.get_pointee() if type_.kind == TypeKind.POINTER else type_


def assigns(one, left):
    end = left.extent.end.offset
    sign = next((t.spelling for t in one.get_tokens() if t.extent.start.offset >= end), "")
    return bool(ASSIGNS.fullmatch(sign)) and sign not in ("==", "<=", ">=")


def is_address(one, inner):
    return one.type.kind == TypeKind.POINTER and pointee(one.type).get_canonical() == inner.type.get_canonical()


def steps(one):
    tokens = [t.spelling for t in one.get_tokens()]
    return bool({"++", "--"} & {*tokens[:1], *tokens[-1:]})


def decays(one):
    """An array that becomes a pointer by which something may be written."""
    child = next(one.get_children(), None) if one.kind == K.UNEXPOSED_EXPR else None
    return (child is not None and one.type.kind == TypeKind.POINTER and not pointee(one.type).is_const_qualified()
            and child.type.get_canonical().kind == TypeKind.CONSTANTARRAY)


def of_firmware():
    found = Program()
    parser = Parser(ROOT, os.environ.get("BUILD", "build"))
    for path in sorted((ROOT / "firmware").rglob("*.c")):
        unit = parser.parse(str(path.relative_to(ROOT)), path.read_text(encoding="utf-8"))
        error = next((d for d in unit.diagnostics if d.severity >= 3), None)
        if error:
            sys.exit(f"writers: {path.relative_to(ROOT)}:{error.location.line}: {error.spelling}")
        found.read(unit)
    return found


def writers(found):
    """{part: contexts, in a sentence}"""
    ways = found.ways()
    return {part: ", ".join(c for c in CONTEXTS if found.writes.get(part, set()) & ways[c].keys()) or START_UP
            for part in found.parts}


def table(now, reasons):
    return HEAD + "".join(f"| `{part}` | {by} | {reasons[part]} |\n" if reasons.get(part) else f"| `{part}` | {by} | |\n"
                          for part, by in now.items())


def findings(now, text):
    rows = {part: (by, reason) for part, by, reason in ROW.findall(text)}
    for part in sorted({*now, *rows}):
        by, reason = rows.get(part, ("no row", ""))
        if part not in now:
            yield f"struct axis has no {part}"
        elif by != now[part]:
            yield f"{part}: written by {now[part]}, and the page says {by}"
        elif ("," in by) != bool(reason.strip()):
            yield f"{part}: a reason stands where more than one writes, and only there"


def why(found, part):
    for context, way in found.ways().items():
        for function in sorted(found.writes.get(part, set()) & way.keys()):
            chain = [function]
            while way[chain[-1]]:
                chain.append(way[chain[-1]])
            yield f"{context}: {' < '.join(chain)}"


def main(*words):
    found = of_firmware()
    text = PAGE.read_text(encoding="utf-8")
    if words[:1] == ("--why",):
        print("\n".join(line for part in words[1:] or found.parts for line in why(found, part)))
        return 0
    now = writers(found)
    if words == ("--write",):
        begin = text.index(HEAD)
        PAGE.write_text(text[:begin] + table(now, {part: reason.strip() for part, _, reason in ROW.findall(text)}),
                        encoding="utf-8")
        text = PAGE.read_text(encoding="utf-8")
    wrong = [f"docs/contexts.md: {one}" for one in findings(now, text)]
    print("\n".join([*wrong, "writers.py --why PART says by which way; --write draws the table anew"]) if wrong else
          f"writers: {len(found.known)} functions, {len(now)} parts of struct axis, each as docs/contexts.md has it")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
