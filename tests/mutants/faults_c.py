# SPDX-License-Identifier: MIT
"""The faults that a person makes in C, as edits of a file's text."""
import re
from collections import Counter

from mutants.ctext import TYPES, matching, opening, regions, tokens_of, walk
from mutants.fault import make_faults, without_remarks

LOOSER = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
NEGATED = {"<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&"}
SIGNS = {"+": "-", "-": "+", "+=": "-=", "-=": "+=", "++": "--", "--": "++"}
OTHER = {"*": "/", "/": "*", "%": "/", "&": "|", "|": "&", "^": "|", "<<": ">>", ">>": "<<", "*=": "/=", "/=": "*=", "&=": "|=",
         "|=": "&=", "^=": "|=", "<<=": ">>=", ">>=": "<<="}
TWINS = (("_d_", "_q_"), ("_min", "_max"), ("MIN", "MAX"), ("low", "high"), ("ia_", "ib_"), ("ib_", "ic_"), ("i_a", "i_b"),
         ("cos", "sin"), ("alpha", "beta"), ("ref_", ""), ("target_", "ref_"), ("kp_", "ki_"), ("first", "last"),
         ("read", "write"), ("enable", "disable"), ("save", "restore"))
SHORT_TWINS = (("d", "q"), ("a", "b"), ("b", "c"), ("cos", "sin"))
SMALL = 16  # a number up to here is wrong by one, a larger one by a factor
NOT_STATEMENTS = ("_Static_assert", "REG_AT_OFFSET")


def c_faults(file, text, uses=None, enums=None):
    """Every fault of a C file.

    uses    how often each identifier stands in all files: a macro that nobody uses has no fault, another name must exist
    enums   {constant: (constant before it, constant after it)}
    """
    uses = Counter(identifiers(text)) if uses is None else uses
    found = []
    for region in regions(text, file):
        if region.kind != "macro" or uses[region.name]:
            found += _Finder(region, text, uses, enums or {}).all()
    return make_faults(file, without_remarks(text), found)


def enum_neighbours(texts):
    """{constant: its neighbours} from the enums of all files."""
    neighbours = {}
    for where, text in texts.items():
        for region in regions(text, where):
            words = [t.text for t in region.tokens]
            if region.kind != "type" or "{" not in words:
                continue
            at = words.index("{")
            if "enum" not in words[max(0, at - 2):at]:
                continue
            members = [words[i + 1] for i in range(at, len(words) - 1) if words[i] in ("{", ",") and words[i + 1] != "}"]
            for i, name in enumerate(members):
                neighbours[name] = tuple(members[j] for j in (i - 1, i + 1) if 0 <= j < len(members))
    return neighbours


def identifiers(text):
    """Every identifier as often as it stands in functions, tables and macros; a macro's own name does not count."""
    return [t.text for region in regions(text) for t in region.tokens if t.kind == "id"]


class _Finder:
    def __init__(self, region, text, uses, enums):
        self.region, self.text, self.uses, self.enums = region, text, uses, enums
        self.tokens = region.tokens
        self.found = []

    def all(self):
        for i, token in enumerate(self.tokens):
            if token.text == "volatile" and self.tokens[i - 1].text not in ("asm", "__asm", "__asm__"):
                self.change("volatile", (i, i, ""))
        if self.region.kind == "function":
            self.statements()
        elif self.region.kind != "type":
            self.expression(0, len(self.tokens) - 1)
        return self.found

    def change(self, kind, *changes):
        """Each change: the first and last token it replaces, and by what."""
        edits = tuple((self.tokens[a].start, self.tokens[b].end, new) for a, b, new in changes)
        self.found.append((self.region.name, kind, edits))

    def part(self, first, last):
        return self.text[self.tokens[first].start:self.tokens[last].end]

    # ---- statements ----

    def statements(self):
        for statement in walk(self.region.body):
            if statement.kind == "block":
                self.neighbours(statement.parts)
            elif statement.kind in ("if", "while", "switch", "do"):
                self.condition(statement)
            elif statement.kind == "for":
                self.expression(statement.first + 2, statement.condition[1])
            elif statement.kind in ("expression", "asm"):
                self.whole(statement)
            elif statement.kind == "jump":
                self.jump(statement)
            elif statement.kind == "label":
                self.expression(statement.first + 1, statement.last - 1)
            elif statement.kind == "declaration":
                self.declaration(statement)

    def condition(self, statement):
        first, last = statement.condition
        self.expression(first, last)
        if statement.kind == "switch":
            return
        self.change("condition", (first, last, f"!({self.part(first, last)})"))
        if statement.kind == "if":
            self.change("dropped check" if not statement.has_else else "condition", (first, last, "false"))
            self.change("condition", (first, last, "true"))

    def whole(self, statement):
        if self.tokens[statement.first].text in NOT_STATEMENTS:
            return
        self.change("dropped statement", (statement.first, statement.last, ";"))
        if statement.kind == "expression":
            self.expression(statement.first, statement.last - 1)

    def jump(self, statement):
        if statement.last - statement.first <= 1:  # break; continue; return;
            self.change("dropped statement", (statement.first, statement.last, ";"))
        elif self.tokens[statement.first].text == "return":
            self.expression(statement.first + 1, statement.last - 1)

    def declaration(self, statement):
        for i in range(statement.first, statement.last):
            if self.tokens[i].text == "=":
                self.expression(i + 1, statement.last - 1)
                return

    def neighbours(self, parts):
        for one, two in zip(parts, parts[1:]):
            plain = all(part.kind in ("expression", "asm") and self.tokens[part.first].text not in NOT_STATEMENTS
                        for part in (one, two))
            a, b = self.part(one.first, one.last), self.part(two.first, two.last)
            if plain and a != b and self.dependent(one, two):
                self.change("order", (one.first, one.last, b), (two.first, two.last, a))

    def dependent(self, one, two):
        """Whether exchanging them may matter: two calls, two registers, or one needs what the other writes."""
        written = [self.written(one), self.written(two)]
        if all(w is None for w in written) or all(w and re.search(r"(^|->|\.)[A-Z][A-Z0-9_]+\b", w) for w in written):
            return True
        others = [self.part(two.first, two.last), self.part(one.first, one.last)]
        return any(w and re.search(rf"(?<![\w.>]){re.escape(w)}(?!\w)", other) for w, other in zip(written, others))

    def written(self, statement):
        """What an assignment writes; None for a call."""
        for i in range(statement.first, statement.last):
            if self.tokens[i].text.endswith("=") and self.tokens[i].text not in ("==", "!=", "<=", ">="):
                return self.part(statement.first, i - 1)
        return None

    # ---- inside an expression ----

    def expression(self, first, last):
        for i in range(first, last + 1):
            token = self.tokens[i]
            if token.kind == "op":
                self.operator(i, first)
            elif token.kind == "num":
                self.number(i, first)
            elif token.kind == "id":
                self.name(i)

    def operator(self, i, first):
        text = self.tokens[i].text
        if text in LOOSER:
            self.change("off by one", (i, i, LOOSER[text]))
        if text in NEGATED:
            self.change("condition", (i, i, NEGATED[text]))
        if text in ("+", "-") and not self.binary(i, first):
            if text == "-":
                self.change("sign", (i, i, ""))
        elif text in SIGNS:
            self.change("sign", (i, i, SIGNS[text]))
        elif text == "~":
            self.change("operator", (i, i, ""))
        elif text in OTHER and (text not in ("*", "&") or self.binary(i, first)):
            self.change("operator", (i, i, OTHER[text]))
        elif text == "!":
            self.change("condition", (i, i, ""))

    def binary(self, i, first):
        """Whether + - * & stand between two operands: behind a value, and not behind a cast."""
        if i <= first:
            return False
        before = self.tokens[i - 1]
        if before.text == ")":
            inside = self.tokens[opening(self.tokens, i - 1) + 1:i - 1]
            return not all(t.text in TYPES or t.text == "*" or (t.kind == "id" and t.text.endswith("_t")) for t in inside)
        return before.kind in ("num", "str", "chr") or before.text == "]" or (before.kind == "id" and before.text != "return")

    def number(self, i, first):
        text = self.tokens[i].text
        match = re.fullmatch(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)", text)
        if not match:
            return
        digits, suffix = match.groups()
        value, hexadecimal = int(digits, 0), digits[:2] in ("0x", "0X")

        def write(n):
            return (f"0x{n:X}" if hexadecimal else str(n)) + suffix
        shift = i > first and self.tokens[i - 1].text in ("<<", ">>")
        if shift or value <= SMALL:
            self.change("off by one", (i, i, write(value + 1)))
            if value > 0:
                self.change("off by one", (i, i, write(value - 1)))
        elif hexadecimal:
            self.change("constant", (i, i, write(value ^ (value & -value))))
            self.change("constant", (i, i, write(value >> 1)))
        else:
            self.change("constant", (i, i, write(value * 2)))
            self.change("constant", (i, i, write(value // 2)))

    def name(self, i):
        text = self.tokens[i].text
        for new in self.enums.get(text, ()):
            self.change("state", (i, i, new))
        if text in ("true", "false"):
            self.change("state", (i, i, "false" if text == "true" else "true"))
        for new in self.twins(i):
            self.change("operand", (i, i, new))
        called = i + 1 < len(self.tokens) and self.tokens[i + 1].text == "("
        if called and text not in TYPES and text != "sizeof" and self.region.kind != "macro":
            self.arguments(i + 1)

    def twins(self, i):
        text, before = self.tokens[i].text, self.tokens[i - 1].text if i else ""
        if text in self.enums:
            return []
        made = []
        for one, two in (*TWINS, *[(b, a) for a, b in TWINS if b]):
            new = text.replace(one, two, 1)
            if one in text and new != text and self.uses[new]:
                made.append(new)
        if before in (".", "->"):
            made += [b for a, b in (*SHORT_TWINS, *[(b, a) for a, b in SHORT_TWINS]) if text == a]
        return made

    def arguments(self, at):
        close, starts, i = matching(self.tokens, at), [at + 1], at + 1
        while i < close:
            if self.tokens[i].kind == "op" and self.tokens[i].text in "([{":
                i = matching(self.tokens, i)
            elif self.tokens[i].text == ",":
                starts.append(i + 1)
            i += 1
        ends = [start - 2 for start in starts[1:]] + [close - 1]
        for n in range(len(starts) - 1):
            a, b = self.part(starts[n], ends[n]), self.part(starts[n + 1], ends[n + 1])
            if a != b:
                self.change("arguments", (starts[n], ends[n], b), (starts[n + 1], ends[n + 1], a))
