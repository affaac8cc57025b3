# SPDX-License-Identifier: MIT
"""C as far as faults need it: tokens, and the functions, tables and macros of a file with their statements.

A whole compiler's tree would know types as well; here the compiler says which faults it takes, so tokens and brackets suffice.
"""
import bisect
import re
from dataclasses import dataclass, field

TOKEN = re.compile(r"""
    (?P<skip>\s+|/\*.*?\*/|//[^\n]*|\\\n)
  | (?P<id>[A-Za-z_$]\w*)
  | (?P<num>0[xX][0-9a-fA-F]+[uUlL]*|\d+\.?\w*)
  | (?P<str>"(?:\\.|[^"\\])*")
  | (?P<chr>'(?:\\.|[^'\\])*')
  | (?P<op><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|\#\#|[-+*/%&|^~!<>=?:;,.(){}\[\]\#])
""", re.VERBOSE | re.DOTALL)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n\\]|\\\n|\\.)*", re.MULTILINE)
DEFINE = re.compile(r"[ \t]*#\s*define\s+(\w+)(\([^)]*\))?")
OPENING, CLOSING = "([{", ")]}"
TYPES = {"const", "volatile", "static", "unsigned", "signed", "int", "char", "short", "long", "void", "struct", "enum", "union",
         "bool", "_Bool", "register", "extern", "inline", "restrict"}


class NotUnderstood(Exception):
    """A construct that this reader does not know; it names file and line."""


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    start: int
    end: int


@dataclass
class Statement:
    kind: str           # if, for, while, do, switch, block, label, jump, expression, declaration, asm, empty
    first: int          # indices of tokens, both included
    last: int
    condition: tuple = ()   # of if, while, do, switch: the tokens between the brackets, (first, last)
    parts: list = field(default_factory=list)
    has_else: bool = False


@dataclass
class Region:
    """A function, a table or a macro: its name and its tokens."""
    name: str
    kind: str           # function, table, macro, type
    tokens: list
    body: Statement = None


def tokens_of(text, start=0, end=None, where=""):
    found, at, end = [], start, len(text) if end is None else end
    while at < end:
        match = TOKEN.match(text, at, end)
        if not match:
            line = text.count("\n", 0, at) + 1
            raise NotUnderstood(f"{where}:{line}: not understood: {text[at:at + 20]!r}")
        if match.lastgroup != "skip":
            found.append(Token(match.lastgroup, match.group(), match.start(), match.end()))
        at = match.end()
    return found


def matching(tokens, at):
    """Index of the bracket that closes the one at `at`."""
    depth = 0
    for i in range(at, len(tokens)):
        if tokens[i].kind == "op" and tokens[i].text in OPENING:
            depth += 1
        elif tokens[i].kind == "op" and tokens[i].text in CLOSING:
            depth -= 1
            if depth == 0:
                return i
    raise NotUnderstood(f"no end of the bracket at character {tokens[at].start}")


def opening(tokens, at):
    """Index of the bracket that the one at `at` closes."""
    depth = 0
    for i in range(at, -1, -1):
        if tokens[i].kind == "op" and tokens[i].text in CLOSING:
            depth += 1
        elif tokens[i].kind == "op" and tokens[i].text in OPENING:
            depth -= 1
            if depth == 0:
                return i
    raise NotUnderstood(f"no start of the bracket at character {tokens[at].start}")


def regions(text, where=""):
    """Every function, initialised table, type and macro of a file."""
    comments = [(m.start(), m.end()) for m in re.finditer(r"/\*.*?\*/", text, re.DOTALL)]
    starts = [start for start, _ in comments]

    def in_comment(at):
        i = bisect.bisect_right(starts, at) - 1
        return i >= 0 and at < comments[i][1]

    found, plain = [], list(text)
    for match in DIRECTIVE.finditer(text):
        if in_comment(match.start()):
            continue
        plain[match.start():match.end()] = re.sub(r"[^\n]", " ", match.group())
        define = DEFINE.match(match.group())
        if define:
            body = tokens_of(text, match.start() + define.end(), match.end(), where)
            found.append(Region(define.group(1), "macro", body))
    tokens, at = tokens_of("".join(plain), where=where), 0
    while at < len(tokens):
        at = _top_level(tokens, at, found, where, text)
    return found


def _top_level(tokens, at, found, where, text):
    """Reads one definition or declaration; returns where the next begins."""
    i = at
    while i < len(tokens):
        token = tokens[i].text
        if token == "{":
            close = matching(tokens, i)
            if tokens[i - 1].text == ")":
                name = tokens[opening(tokens, i - 1) - 1].text
                try:
                    body = _Statements(tokens, text, where).block(i)[0]
                except IndexError as error:
                    raise NotUnderstood(f"{where}: {name} ends in the middle of a statement") from error
                found.append(Region(name, "function", tokens[at:close + 1], _shifted(body, at)))
                return close + 1
            kind = "table" if tokens[i - 1].text == "=" else "type"
            names = [t.text for t in tokens[at:i] if t.kind == "id" and t.text not in TYPES]
            end = close
            while end < len(tokens) and tokens[end].text != ";":
                end += 1
            found.append(Region(names[-1] if names else "unnamed", kind, tokens[at if kind == "type" else i:end + 1]))
            return end + 1
        if token in "([":
            i = matching(tokens, i)
        elif token == ";":
            _declared(tokens[at:i + 1], found)
            return i + 1
        i += 1
    return i


def _declared(tokens, found):
    """`static const int x = 3;` is a table of one; anything else without braces has nothing to break but a volatile."""
    names = [t.text for t in tokens if t.kind == "id" and t.text not in TYPES]
    if tokens[0].text.startswith(("_Static_assert", "REG_AT_OFFSET")) or not names:
        return
    equals = [n for n, t in enumerate(tokens) if t.text == "="]
    if equals:
        before = [t.text for t in tokens[:equals[0]] if t.kind == "id" and t.text not in TYPES]
        found.append(Region(before[-1], "table", tokens[equals[0]:]))
    elif any(t.text == "volatile" for t in tokens):
        found.append(Region(names[-1], "type", tokens))


def _shifted(statement, by):
    statement.first -= by
    statement.last -= by
    statement.condition = tuple(i - by for i in statement.condition)
    for part in statement.parts:
        _shifted(part, by)
    return statement


class _Statements:
    """Reads statements: each method takes the index where one begins and returns it with the index behind it."""

    def __init__(self, tokens, text, where):
        self.tokens, self.text, self.where = tokens, text, where

    def block(self, at):
        close, parts, i = matching(self.tokens, at), [], at + 1
        while i < close:
            part, i = self.statement(i)
            parts.append(part)
        return Statement("block", at, close, parts=parts), close + 1

    def statement(self, at):
        word = self.tokens[at].text
        if word == "{":
            return self.block(at)
        if word in ("if", "while", "switch", "for"):
            return self.controlled(at, word)
        if word == "do":
            body, i = self.statement(at + 1)
            close = matching(self.tokens, i + 1)
            return Statement("do", at, close + 1, (i + 2, close - 1), [body]), close + 2
        if word in ("case", "default"):
            i = at
            while self.tokens[i].text != ":":
                i = matching(self.tokens, i) + 1 if self.tokens[i].text == "(" else i + 1
            return Statement("label", at, i), i + 1
        end = self.semicolon(at)
        return Statement(self.kind(at, end), at, end), end + 1

    def controlled(self, at, word):
        close = matching(self.tokens, at + 1)
        body, i = self.statement(close + 1)
        parts, has_else = [body], False
        if word == "if" and i < len(self.tokens) and self.tokens[i].text == "else":
            other, i = self.statement(i + 1)
            parts.append(other)
            has_else = True
        return Statement(word, at, i - 1, (at + 2, close - 1), parts, has_else), i

    def semicolon(self, at):
        i = at
        while self.tokens[i].text != ";":
            if self.tokens[i].text in CLOSING and self.tokens[i].kind == "op":
                line = self.text.count("\n", 0, self.tokens[at].start) + 1
                raise NotUnderstood(f"{self.where}:{line}: a statement without an end")
            i = matching(self.tokens, i) + 1 if self.tokens[i].kind == "op" and self.tokens[i].text in OPENING else i + 1
        return i

    def kind(self, at, end):
        first, second = self.tokens[at], self.tokens[min(at + 1, end)]
        if at == end:
            return "empty"
        if first.text in ("return", "break", "continue", "goto"):
            return "jump"
        if first.text in ("__asm", "asm", "__asm__"):
            return "asm"
        if first.text in ("*", "(", "++", "--"):
            return "expression"
        if first.kind == "id" and first.text not in TYPES and second.kind == "op" and second.text != "*":
            return "expression"
        return "declaration"


def walk(statement):
    """The statement and all inside it."""
    yield statement
    for part in statement.parts:
        yield from walk(part)
