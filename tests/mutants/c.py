# SPDX-License-Identifier: MIT
"""The mistakes that a person makes in C, as edits of a file's text: libclang says what stands where."""
import re
import subprocess
from functools import cache

from clang.cindex import CursorKind as K
from clang.cindex import Index, TranslationUnit, TypeKind

from mutants.mutant import mutants_of, without_remarks
from mutants.names import twins

ARM = ("--target=arm-none-eabi", "-mcpu=cortex-m3", "-mthumb", "-ffreestanding", "-DLIB_TRIG_FRAC=15",
       '-D__INT64_C(c)=c##LL', '-D__UINT64_C(c)=c##ULL', '-DCONFIG_COMMIT="0123456789abcdef0123"')
STRICT = ("-x", "c", "-std=gnu11", "-Werror=int-conversion", "-Werror=incompatible-pointer-types",
          "-Werror=implicit-function-declaration")
LOOSER = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
TURNED = {"<": ">", ">": "<", "<=": ">=", ">=": "<=", "==": "!=", "!=": "=="}
SIGNS = {"+": "-", "-": "+", "+=": "-=", "-=": "+="}
OPERATOR = re.compile(r"<<=|>>=|[-+*/%&|^]=|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^<>=,]")
ASSIGNS = re.compile(r"([-+*/%&|^]|<<|>>)?=")
BOUNDS = re.compile(r"(?i)(^|_)(f?min|f?max|clamp\w*|limit\w*|sat\w*|bound\w*|f?abs|within|held|cut)(_|$)")
EITHER_WAY = re.compile(r"(^|_)(f?min|f?max|hypot|magnitude)(_|$)")  # arguments that may be exchanged
MASKS = re.compile(r"cpu_(irq_\w+|mask_\w+|unmask\w*|barrier|dmb|dsb|isb|data_\w*|synchroni\w*)")
NUMBER = re.compile(r"(0[xX][0-9a-fA-F]+|0|[1-9]\d*)([uUlL]*)")
SMALL = 16  # a number up to here is wrong by one, a larger one by a factor


@cache
def headers_of(compiler):
    return subprocess.run([compiler, "-print-file-name=include"], capture_output=True, text=True, check=True).stdout.strip()


class Parser:
    """Reads C files as the compiler would: those of the plant for this machine, the others for the controller's."""

    def __init__(self, root, build="build", arm="arm-none-eabi-gcc", host="cc"):
        self.root, self.index = root, Index.create()
        self.compilers, self.build = (arm, host), root / build

    def parse(self, file, text):
        plant = file.startswith("qemu/")
        flags = [*STRICT, *(() if plant else ARM), "-isystem", headers_of(self.compilers[plant]), f"-I{self.root}",
                 *(f"-I{self.build}/{place}" for place in ("packed/1", "fabric", "bringup"))]
        path = str(self.root / file)
        return self.index.parse(path, flags, [(path, text)], TranslationUnit.PARSE_DETAILED_PROCESSING_RECORD)

    def complaint(self, file, text):
        """The first error; '' if there is none."""
        return next((one.spelling for one in self.parse(file, text).diagnostics if one.severity >= 3), "")

    def mutants(self, file, text):
        unit = self.parse(file, text)
        error = next((one for one in unit.diagnostics if one.severity >= 3), None)
        if error:
            raise ValueError(f"{file}:{error.location.line}: {error.spelling}; mutants are made of what compiles")
        return mutants_of(file, without_remarks(text), Reader(unit, text).all())


class Reader:
    def __init__(self, unit, text):
        self.unit, self.path = unit, unit.spelling
        self.text, self.blank = text, without_remarks(text)
        self.ascii = text.isascii()
        self.bytes = text.encode()
        self.macros = sorted(self.span(c) for c in unit.cursor.get_children()
                             if c.kind == K.MACRO_INSTANTIATION and self.here(c))
        self.known = set(re.findall(r"[A-Za-z_]\w*", self.blank))
        for c in unit.cursor.get_children():
            self.known |= {one.spelling for one in (c.get_children() if c.kind == K.STRUCT_DECL else [c])}
        self.found, self.function, self.slot, self.loads = [], "", None, {}
        self.turns = True  # whether a comparison may be turned round: a loop's would only never begin

    # ---- where things stand ----

    def here(self, cursor):
        file = cursor.location.file
        return file is not None and file.name == self.path

    def span(self, cursor):
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        return (start, end) if self.ascii else (len(self.bytes[:start].decode()), len(self.bytes[:end].decode()))

    def part(self, cursor):
        return self.text[slice(*self.span(cursor))]

    def of_macro(self, cursor):
        """Whether all of it comes from one use of a macro."""
        start, end = self.span(cursor)
        return any(a <= start and end <= b for a, b in self.macros)

    def statement_span(self, cursor):
        start, end = self.span(cursor)
        return start, end if self.blank[end - 1] == ";" else self.blank.index(";", end) + 1

    def change(self, kind, *edits, slot=None):
        self.found.append((self.function, kind, tuple(sorted(edits)), slot or self.slot))

    # ---- statements ----

    def all(self):
        for cursor in self.unit.cursor.get_children():
            if cursor.kind == K.FUNCTION_DECL and cursor.is_definition() and self.here(cursor) and not self.of_macro(cursor):
                self.function, self.loads = cursor.spelling, {}
                self.statement(list(cursor.get_children())[-1])
        return self.found

    def statement(self, cursor):
        children = [] if self.of_macro(cursor) else list(cursor.get_children())
        if not children:
            return
        if cursor.kind == K.COMPOUND_STMT:
            for one, two in zip(children, children[1:]):
                self.exchanged(one, two)
            for child in children:
                self.statement(child)
        elif cursor.kind in (K.IF_STMT, K.WHILE_STMT):
            self.condition(cursor, children[0])
            for child in children[1:]:
                self.statement(child)
        elif cursor.kind == K.DO_STMT:
            self.statement(children[0])
            self.within(children[1])
        elif cursor.kind == K.FOR_STMT:
            self.loop(cursor, children)
        elif cursor.kind in (K.SWITCH_STMT, K.CASE_STMT, K.DEFAULT_STMT, K.LABEL_STMT):
            if cursor.kind == K.SWITCH_STMT:
                self.within(children[0])
            self.statement(children[-1])
        elif cursor.kind == K.RETURN_STMT:
            self.within(children[0])
        elif cursor.kind == K.DECL_STMT:
            self.declarations(children)
        elif cursor.kind.is_expression():
            self.simple(cursor)

    def condition(self, cursor, test):
        start, end = self.span(test)
        self.within(test)
        self.slot = (start, end, "expression")
        if cursor.kind == K.IF_STMT and "(0)" not in self.text[start - 1:end + 1]:
            self.change("lost condition", (start, end, "0"))
            self.change("lost condition", (start, end, "1"))

    def loop(self, cursor, children):
        body = children[-1]
        first = self.blank.find(";", self.span(cursor)[0])
        second = self.blank.find(";", first + 1)
        for child in children[:-1]:
            self.turns = not first < self.span(child)[0] < second
            if child.kind == K.DECL_STMT:
                self.declarations(child.get_children())
            else:
                self.within(child)
        self.turns = True
        self.statement(body)

    def declarations(self, cursors):
        for cursor in cursors:
            given = [child for child in cursor.get_children() if child.kind.is_expression() and self.here(child)]
            static = cursor.storage_class.name == "STATIC"
            if cursor.kind != K.VAR_DECL or not given or static or cursor.type.kind == TypeKind.CONSTANTARRAY:
                continue
            value = self.bare(given[-1])
            if value.kind == K.INIT_LIST_EXPR:
                for child in value.get_children():
                    self.initial(child)
            else:
                self.within(value)
                if value.kind in (K.MEMBER_REF_EXPR, K.DECL_REF_EXPR) and value.type.is_volatile_qualified():
                    self.loads[cursor.spelling] = self.part(value)  # where the copy is used, it is read again

    def initial(self, child):
        child = self.bare(child)
        parts = [one for one in child.get_children() if one.kind.is_expression()]
        if child.kind == K.UNEXPOSED_EXPR or "." in self.text[slice(*self.span(child))][:1]:  # a designator
            for part in parts[-1:]:
                self.initial(part)
        elif child.kind != K.INIT_LIST_EXPR:
            self.within(child)

    def simple(self, cursor):
        """A statement that is an expression: left out as a whole, or wrong inside."""
        start, end = self.statement_span(cursor)
        self.slot = (start, end, "statement")
        cursor = self.bare(cursor)
        if re.match(r"\(void\)\w+;", self.text[start:end]):
            return
        if cursor.kind == K.CALL_EXPR:
            self.change("race" if MASKS.match(cursor.spelling) else "lost call", (start, end, ";"))
        else:
            self.change("forgotten clear", (start, end, ";"))
        self.expression(cursor)

    def exchanged(self, one, two):
        """Two statements of which one writes what the other uses, the second publishes to an interrupt, or both call."""
        if not (one.kind.is_expression() and two.kind.is_expression()) or self.of_macro(one) or self.of_macro(two):
            return
        a, b = self.statement_span(one), self.statement_span(two)
        texts = self.text[slice(*a)], self.text[slice(*b)]
        if texts[0] == texts[1] or "(void)" in texts[0] + texts[1]:
            return
        pairs = [self.operands(self.bare(c)) for c in (one, two)]
        written = [parts[0] if parts and ASSIGNS.fullmatch(parts[1]) else None for parts in pairs]
        if all(parts and len(parts[1]) > 1 for parts in pairs) and len({self.part(p[0]) + p[1] for p in pairs}) == 1:
            return  # both add to the same
        linked = any(w and re.search(rf"(?<![\w.>]){re.escape(self.part(w))}(?!\w)", other)
                     for w, other in zip(written, reversed(texts)))
        calls = all(self.bare(c).kind == K.CALL_EXPR and c.spelling != "memset" for c in (one, two))
        if linked or calls or all(written) and written[1].type.is_volatile_qualified():
            self.change("order", (*a, texts[1]), (*b, texts[0]), slot=(a[0], b[1], "statement"))

    # ---- inside an expression ----

    def within(self, cursor):
        """A whole expression with a slot of its own."""
        if not self.of_macro(cursor) or "(" not in self.part(cursor):
            self.slot = (*self.span(cursor), "expression")
            self.expression(cursor)

    def bare(self, cursor):
        """Without what the compiler has put around it."""
        while cursor.kind == K.UNEXPOSED_EXPR:
            children = list(cursor.get_children())
            if len(children) != 1 or self.span(children[0]) != self.span(cursor):
                break
            cursor = children[0]
        return cursor

    def operands(self, cursor):
        """(left, operator, its place, right) of two operands."""
        if cursor.kind not in (K.BINARY_OPERATOR, K.COMPOUND_ASSIGNMENT_OPERATOR):
            return None
        left, right = cursor.get_children()
        start, end = self.span(left)[1], self.span(right)[0]
        match = OPERATOR.search(self.blank, start, end)
        if not match or self.blank[start:end].strip() != match.group():
            return None
        return left, match.group(), match.span(), right

    def expression(self, cursor):
        cursor = self.bare(cursor)
        if cursor.kind in (K.INTEGER_LITERAL, K.FLOATING_LITERAL) or self.of_macro(cursor):
            self.literal(cursor)
            return
        rules = {K.BINARY_OPERATOR: self.binary, K.COMPOUND_ASSIGNMENT_OPERATOR: self.binary, K.UNARY_OPERATOR: self.unary,
                 K.CALL_EXPR: self.call, K.CONDITIONAL_OPERATOR: self.choice, K.MEMBER_REF_EXPR: self.name,
                 K.DECL_REF_EXPR: self.name, K.ARRAY_SUBSCRIPT_EXPR: self.index}
        rules.get(cursor.kind, lambda _: None)(cursor)
        for child in cursor.get_children():
            if child.kind.is_expression() and self.here(child) and cursor.kind != K.CXX_UNARY_EXPR:
                self.expression(child)

    def binary(self, cursor):
        parts = self.operands(cursor)
        if not parts:
            return
        left, sign, place, right = parts
        if sign in LOOSER:
            self.change("comparison" if self.turns else "off by one", (*place, LOOSER[sign]))
        if sign in TURNED and self.turns:
            self.change("comparison", (*place, TURNED[sign]))
        if sign in SIGNS and left.type.get_canonical().kind != TypeKind.POINTER:
            self.change("sign", (*place, SIGNS[sign]))
        if sign in ("&&", "||"):
            self.conjuncts(cursor, left, right)
        if sign in ("<<", ">>", "<<=", ">>="):
            self.shifted(right)
        if sign in ("*", "/") and NUMBER.fullmatch(self.part(right)):
            self.change("unit", (self.span(left)[1], self.span(right)[1], ""))
        if sign in ("+", "-") and self.part(right) in ("1", "1u"):
            self.change("off by one", (self.span(left)[1], self.span(right)[1], ""))

    def conjuncts(self, cursor, left, right):
        names = [set(re.findall(r"[a-z_]\w*(?:(?:->|\.)\w+)*", self.part(side))) - {"u"} for side in (left, right)]
        limits = all(re.search(r"[^-<>][<>]=?(?![<>])", self.part(side)) for side in (left, right))
        kind = "half a check" if limits and names[0] & names[1] else "lost condition"
        start, end = self.span(cursor)
        for side in (left, right):
            self.change(kind, (start, end, self.part(side)))

    def shifted(self, by):
        start, end = self.span(by)
        if self.text[start:end].strip("uU") != "0":
            self.change("unit", (start, end, f"({self.text[start:end]} + 1)"))
            self.change("unit", (start, end, f"({self.text[start:end]} - 1)"))

    def unary(self, cursor):
        start, end = self.span(cursor)
        (child,) = cursor.get_children()
        if self.blank[start] == "-" and not NUMBER.fullmatch(self.part(child)):
            self.change("sign", (start, start + 1, ""))
        if self.blank[start] == "!":
            self.change("comparison", (start, start + 1, ""))

    def call(self, cursor):
        given = list(cursor.get_arguments())
        start, end = self.span(cursor)
        if MASKS.match(cursor.spelling) and self.slot[2] == "expression":
            self.change("race", (start, end, "0u"))
        if BOUNDS.search(cursor.spelling):
            for one in given[:2 if len(given) == 2 else 1]:
                if one.type.get_canonical().kind == cursor.type.get_canonical().kind:
                    self.change("lost bound", (start, end, f"({self.part(one)})"))
        for one, two in zip(given, given[1:]) if not EITHER_WAY.search(cursor.spelling) else ():
            kinds = [self.bare(c).type.get_canonical().spelling.replace("const ", "") for c in (one, two)]
            if kinds[0] == kinds[1] and self.part(one) != self.part(two):
                self.change("copy error", (*self.span(one), self.part(two)), (*self.span(two), self.part(one)))

    def choice(self, cursor):
        """A limit by hand: a < b ? a : b."""
        test, one, two = cursor.get_children()
        inside = self.part(test)
        limits = {*"<>"} & {*inside} and (self.part(one) in inside or self.part(two) in inside)
        for side in (one, two):
            self.change("lost bound" if limits else "lost condition", (*self.span(cursor), f"({self.part(side)})"))

    def index(self, cursor):
        start, end = self.span(list(cursor.get_children())[1])
        if re.fullmatch("[012]u?", self.text[start:end]):
            for other in {*"012"} - {self.text[start]}:
                self.change("copy error", (start, start + 1, other))
        else:
            self.change("off by one", (start, end, f"{self.text[start:end]} + 1"))

    def name(self, cursor):
        name = cursor.spelling
        end = self.span(cursor)[1]
        start = end - len(name)
        if self.text[start:end] != name:
            return
        if cursor.kind == K.DECL_REF_EXPR and cursor.referenced is not None and cursor.referenced.kind == K.ENUM_CONSTANT_DECL:
            members = [one.spelling for one in cursor.referenced.semantic_parent.get_children()]
            at = members.index(name)
            for other in (*members[max(at - 1, 0):at], *members[at + 1:at + 2]):
                self.change("enumerator", (start, end, other))
            return
        for kind, other in twins(name, self.known):
            self.change(kind, (start, end, other))
        if name in self.loads and cursor.kind == K.DECL_REF_EXPR:
            self.change("race", (start, end, self.loads[name]))

    def literal(self, cursor):
        """A number, or a name for one."""
        start, end = self.span(cursor)
        text = self.text[start:end]
        match = NUMBER.fullmatch(text)
        if text in ("true", "false"):
            self.change("enumerator", (start, end, "false" if text == "true" else "true"))
        elif match and int(match[1], 0) > SMALL:
            value = int(match[1], 0)
            news = (value // 1000 if value % 1000 == 0 else value * 2, value // 2 if value % 2 == 0 else value + 1)
            for new in news:
                self.change("unit", (start, end, f"{hex(new) if match[1][:2] in ('0x', '0X') else new}{match[2]}"))
        elif match:
            self.change("off by one", (start, end, f"{int(match[1], 0) + 1}{match[2]}"))
        elif re.fullmatch(r"[A-Z]\w+", text):
            if re.search(r"_(MS|US|NS|S|HZ|MV|MA|UV)$", text):
                self.change("unit", (start, end, f"({text} * 1000)"))
            elif re.search(r"_(Q\d+|RPM|PCT|PM|COUNTS|BITS|SHIFT)$", text):
                self.change("unit", (start, end, f"({text} * 2)"))
            else:
                self.change("off by one", (start, end, f"({text} - 1)"))
        elif re.fullmatch(r"\d+(\.\d+)?(e[-+]?\d+)?", text):
            self.change("unit", (start, end, f"({text} * {1000 if 'e' in text else 2})"))
