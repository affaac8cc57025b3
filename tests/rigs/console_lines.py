# SPDX-License-Identifier: MIT
"""Lines for the storms at the console: noise, keys of a terminal, commands that are right, and such with a character changed,
too many or missing; and a second look at what is a command."""
from tools.param_rows import param_rows

KEYS = (b"\t", b"\x1b[A", b"\x1b[D", b"\x1b[3~", b"\x15", b"\x03", b"\x1b", b"\xc3", b"\x01", b"\x17", b"\b")
WORDS = "index block by on off show all warn stop voltage_limit -".split()
SLOW = {"save", "stream", "machine"}  # take the time of all the others, or end the dialogue
PARAMS = param_rows()
PRINTABLE = range(32, 127)


def table(c):
    """[(name, arguments)] of the commands, as 'help' has them."""
    rows, n = [], 0
    while c.commands_row(n):
        row = c.commands_row(n).contents
        rows.append((row.name.decode(), row.arguments.decode()))
        n += 1
    return rows


def command_of(line, rows):
    """The name of the command that a line is by its words, or None."""
    words = line.decode().split(" ")
    words = [word for word in words if word]
    return next((name for name, arguments in rows if words and words[0] == name
                 and len(words) == 1 + arguments.count(" ")), None)


def _argument(draw, kind):
    if kind.islower():
        return kind
    if kind.startswith("PARAM"):
        return draw.choice(list(PARAMS))
    if draw.randrange(3) == 0:
        return draw.choice(WORDS)
    whole = str(draw.randrange(-3000, 17000))
    return whole if draw.randrange(4) else f"{whole}.{draw.randrange(1000):03}"


def _command(draw, rows):
    name, arguments = draw.choice([row for row in rows if row[0] not in SLOW])
    return " ".join([name, *(_argument(draw, kind) for kind in arguments.split())])


def _set(draw):
    name = draw.choice(list(PARAMS))
    low, high, _ = PARAMS[name]
    beyond = (high - low) // 16 + 1
    return f"set {name} {draw.randint(low - beyond, high + beyond)}"


def mutated(draw, line):
    """A byte is another one, missing or too many."""
    at, what = draw.randrange(len(line)), draw.randrange(3)
    return line[:at] + (b"" if what == 0 else bytes([draw.choice(PRINTABLE)])) + line[at + (what != 1):]


def some_line(draw, rows):
    """(kind, what is typed)."""
    kind = draw.randrange(8)
    if kind == 0:
        return "noise", bytes(draw.choices(PRINTABLE, k=draw.randrange(120)))
    line = (_set(draw) if kind < 4 else _command(draw, rows)).encode()
    if kind in (1, 4):
        return "mutated", mutated(draw, line)
    return ("keys", line + b"".join(draw.choices(KEYS, k=draw.randint(1, 6)))) if kind == 5 else ("right", line)
