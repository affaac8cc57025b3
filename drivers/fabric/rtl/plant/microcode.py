# SPDX-License-Identifier: MIT
"""The plant's program: what plant_core.v does in each step, and when. The RTL's ROM, the exact model and the analysis of its
ranges are made of it.

microcode.py plant_program.vh   prints the program for the RTL
microcode.py plant_addresses.h      prints where its words are, for C
microcode.py                    prints what each clock does

A word has 36 bits, signed, and stands for a number of per unit: 2^34 is 1, so that it ends at +-2. The multiplier takes its
upper 18 bits. One operation:

    W = C + A B

A is the upper half of a word, or an input (EXTERNAL); B either a word (`by`), whose upper half is taken, or a coefficient
(`times`): mantissa of 18 bits in the upper half and exponent e in the lowest five, product 2^(10 - e), which for
a word is 2^2. What does not fit saturates, but for angles, which wrap: a turn is 2^36.
"""
import sys
from dataclasses import dataclass

LATENCY = 6     # from the issue of an operation to that of the first which may read its result
FURTHER = 3     # and to one that takes an input which depends on it
STEP = 100      # clocks of a step: 1 us
WORDS = 128

# inputs in place of A: averages of the legs over the step before (plant_legs.v)
EXTERNAL = ["HIGH_ALPHA", "HIGH_BETA", "DIODE_ALPHA", "DIODE_BETA", "SWITCH_ALPHA", "SWITCH_BETA", "NEUTRAL",
            "WEIGHT_A", "WEIGHT_B", "WEIGHT_C", "HIGH_A", "HIGH_B", "HIGH_C"]
OF_CURRENTS = {"HIGH_ALPHA", "HIGH_BETA", "DIODE_ALPHA", "DIODE_BETA", "SWITCH_ALPHA", "SWITCH_BETA", "NEUTRAL", "HIGH_A",
               "HIGH_B", "HIGH_C"}
# what becomes of negative results
RELU = {"": 0, "zero": 1, "nosink": 2, "leg_a": 4, "leg_b": 5, "leg_c": 6}
# 0 instead of the result unless ...
UNLESS = {"": 0, "chops": 1, "off_a": 4, "off_b": 5, "off_c": 6}


@dataclass(frozen=True)
class Op:
    """One operation; flags as in plant_core.v."""
    w: str
    c: str = ""
    a: str = ""
    b: str = ""
    state: bool = False         # B is a word
    minus: bool = False         # C - A B
    minus_c: bool = False       # -C + A B
    low: bool = False           # of C only the lower half
    wrap: bool = False
    fold: bool = False          # a turn onto -1...1, the quarter of it on which its sine is monotonic
    unfold: bool = False        # negative if the last fold turned its angle round
    speed: bool = False         # A B negative with the speed
    relu: str = ""
    unless: str = ""
    negative: bool = False      # written only if it is negative

    def reads(self):
        names = {name for name in (self.c, self.b) if name}
        if self.a in EXTERNAL:
            if self.a in OF_CURRENTS:
                names |= {"IA", "IB", "IC"}
            else:
                names.add("THE")
        elif self.a:
            names.add(self.a)
        if self.unfold:
            names.add("FOLDED")
        if self.speed:
            names.add("W")
        return names

    def writes(self):
        return {self.w, "FOLDED"} if self.fold else {self.w}


def word(w, c="", a="", by="", times="", **flags):
    return Op(w, c, a, by or times, bool(by), **flags)


def program():
    """The operations in the order in which they may be thought of: a result is read by those behind it."""
    ops = []

    def do(*args, **flags):
        ops.append(word(*args, **flags))

    # the flux linkage of the stator: bridge, drops, resistance
    do("VA", "", "HIGH_ALPHA", by="U")
    do("VB", "", "HIGH_BETA", by="U")
    for axis, current in (("A", "IA"), ("B", "IBETA")):
        name = "ALPHA" if axis == "A" else "BETA"
        flux = "F" + axis
        do(flux, flux, current, times="KR", minus=True)
        do(flux, flux, f"SWITCH_{name}", times="KS" + axis, minus=True)
        do(flux, flux, f"DIODE_{name}", times="KD" + axis, minus=True)
        do(flux, flux, "V" + axis, times="KV" + axis)
    # legs without a gate for all of the step: the terminal is where its current ends, as far as the diodes let it
    do("UN", "", "U", times="KN")
    do("TOP", "U", "VD", times="TWO")
    do("VN", "VD", "WEIGHT_A", by="EA", minus=True)
    do("VN", "VN", "WEIGHT_B", by="EB", minus=True)
    do("VN", "VN", "WEIGHT_C", by="EC", minus=True)
    do("VN", "VN", "NEUTRAL", by="UN")
    for leg in "ABC":
        do("X" + leg, "E" + leg, "I" + leg, times="KX", minus=True)
        do("Y" + leg, "VN", "X" + leg, times="ONE", relu="leg_" + leg.lower())
        do("T" + leg, "TOP", "Y" + leg, times="ONE", minus=True, relu="leg_" + leg.lower(), unless="off_" + leg.lower())
    do("FA", "FA", "TA", times="KXA", minus=True)
    do("FA", "FA", "TB", times="KXH")
    do("FA", "FA", "TC", times="KXH")
    do("FB", "FB", "TB", times="KXB", minus=True)
    do("FB", "FB", "TC", times="KXB")
    # the bus
    do("BUS", "", "HIGH_A", by="IA")
    do("BUS", "BUS", "HIGH_B", by="IB")
    do("BUS", "BUS", "HIGH_C", by="IC")
    do("SRC", "VS", "U", times="ONE", minus=True, relu="nosink")
    do("BRK", "", "U", times="KCH", unless="chops")
    do("U1", "U", "BUS", times="KI", minus=True)
    do("U1", "U1", "SRC", times="KSR")
    do("U", "U1", "BRK", times="ONE", minus=True)
    # the shaft, with the currents of the step before
    do("XT", "PF", "ID", times="KSAL")
    do("TQ", "TLN", "IQ", by="XT")
    do("TQ", "TQ", "W", times="KB", minus=True)
    do("WW", "", "W", by="W")
    do("TQ", "TQ", "WW", times="KF", minus=True, speed=True)
    do("CG", "CPH", "THM", times="NCOG", wrap=True, fold=True)
    do("CC", "", "CG", by="CG")
    do("CH", "A1", "CC", times="A2")
    do("CH", "A0", "CH", by="CC")
    do("CS", "", "CH", by="CG")
    do("TQ", "TQ", "CS", times="KC", minus=True)
    do("W1", "W", "TQ", times="KW")
    do("W", "W1", "FRIC", times="KW", minus=True, relu="zero")
    do("W", "W1", "FRIC", times="KW", negative=True)
    # sine and cosine of the electrical angle
    do("X", "THE", fold=True, wrap=True)
    do("XX", "", "X", by="X")
    do("H", "S2", "XX", times="S3")
    do("H", "S1", "H", by="XX")
    do("H", "S0", "H", by="XX")
    do("S", "", "H", by="X")
    do("G", "C2", "XX", times="C3")
    do("G", "C1", "G", by="XX")
    do("C", "C0", "G", by="XX", unfold=True)
    # currents from flux linkages
    do("LD", "PFN", "FA", by="C")
    do("LD", "LD", "FB", by="S")
    do("LQ", "", "FB", by="C")
    do("LQ", "LQ", "FA", by="S", minus=True)
    do("ID", "", "LD", times="GD")
    do("IQ", "", "LQ", times="GQ")
    do("P", "", "ID", by="C")
    do("IA", "P", "IQ", by="S", minus=True)
    do("Q", "", "ID", by="S")
    do("IBETA", "Q", "IQ", by="C")
    do("R", "", "IBETA", times="SQ32")
    do("IB", "R", "IA", times="HALF", minus=True)
    do("IC", "IA", "IB", times="ONE", minus=True, minus_c=True)
    # EMF at the terminals
    do("EW", "", "W", times="KE")
    do("EA", "", "EW", by="S", minus=True)
    do("EC0", "", "EW", by="C")
    do("EH", "", "EC0", times="SQ32")
    do("EB", "EH", "EA", times="HALF", minus=True)
    do("EC", "EA", "EB", times="ONE", minus=True, minus_c=True)
    # the angle at the end of the next step; its increments are whole numbers, so that its copies never drift apart
    do("D", "D", "W", times="KTH", low=True, wrap=True)
    do("THM", "THM", "D", times="M1", wrap=True)
    do("THE", "THE", "D", times="MP", wrap=True)
    do("THQ", "THQ", "D", times="ML", wrap=True)
    do("QI", "", "D", times="MI", wrap=True)
    # what the converters see
    do("CODE_A", "OA", "IA", times="GA")
    do("CODE_B", "OB", "IB", times="GB")
    do("CODE_C", "OC", "IC", times="GC")
    do("CODE_U", "", "U", times="GU")
    return ops


SAMPLED = {"CODE_A", "CODE_B", "CODE_C"}
OUTPUTS = {"IA", "IB", "IC", "W", "THM", "THE", "THQ", "QI", "CODE_A", "CODE_B", "CODE_C", "CODE_U"}


def variables(ops):
    """{name: address}; 0 is read where nothing is needed."""
    names = ["ZERO"]
    for op in ops:
        for name in (op.w, op.c, op.b, op.a):
            if name and name not in EXTERNAL and name not in names:
                names.append(name)
    if len(names) > WORDS:
        raise ValueError(f"{len(names)} words, {WORDS} at most")
    return {name: n for n, name in enumerate(names)}


def constraints(ops):
    """[(earlier, later, clocks between at least)] by the order of the program; of the next step, `later` is beyond its end."""
    found = []
    twice = list(ops) + list(ops)
    for later, op in enumerate(twice):
        for name in op.reads():
            for earlier in range(later - 1, -1, -1):
                if name in twice[earlier].writes():
                    found.append((earlier, later, LATENCY + (FURTHER if op.a in EXTERNAL and name not in (op.b, op.c) else 0)))
                    break
        for name in op.writes():
            for earlier in range(later - 1, -1, -1):
                if name in twice[earlier].reads():
                    found.append((earlier, later, 0))
                if name in twice[earlier].writes():
                    found.append((earlier, later, 1))
                    break
    return [one for one in found if one[0] < len(ops)]


def heights(ops, edges):
    """How long before the end of everything each operation has to begin."""
    height, moved = [0] * len(ops), True
    while moved:
        moved = False
        for e, l, d, over in edges:
            least = height[l] + d - over * STEP
            if least > height[e]:
                height[e], moved = least, True
    return height


def schedule(ops):
    """The clock in which each operation is issued, one in each of STEP; STEP and more: it ends in the next step.

    Modulo scheduling: the most urgent operation takes its first free clock, or the one it needs most, and those that no longer
    fit are taken out again.
    """
    count = len(ops)
    edges = [(e, l % count, d, l // count) for e, l, d in constraints(ops)]
    after = [[] for _ in range(count)]
    before = [[] for _ in range(count)]
    for e, l, d, over in edges:
        after[e].append((l, d - over * STEP))
        before[l].append((e, d - over * STEP))
    height, at, last = heights(ops, edges), {}, [-1] * count
    waiting = set(range(count))
    for _ in range(count * 400):
        if not waiting:
            return earlier_samples(ops, edges, [at[n] for n in range(count)])
        n = max(waiting, key=lambda k: (height[k], -k))
        waiting.discard(n)
        first = max([0] + [at[e] + d for e, d in before[n] if e in at])
        taken = {clock % STEP: k for k, clock in at.items()}
        clock = next((c for c in range(first, first + STEP) if c % STEP not in taken), None)
        if clock is None or clock <= last[n] and last[n] >= first:
            clock = max(first, last[n] + 1)
        if ops[n].a in EXTERNAL and clock > STEP - 4:
            raise ValueError(f"{ops[n].w} would read the inputs of the next step")
        last[n] = clock
        gone = {taken[clock % STEP]} if clock % STEP in taken else set()
        at[n] = clock
        gone |= {l for l, d in after[n] if l in at and l != n and at[l] < clock + d}
        gone |= {e for e, d in before[n] if e in at and e != n and at[e] + d > clock}
        for k in gone - {n}:
            del at[k]
            waiting.add(k)
    raise ValueError("no schedule")


def earlier_samples(ops, edges, at):
    """What is sampled changes places with what can wait."""
    def holds(at):
        return (all(at[l] >= at[e] + d - over * STEP for e, l, d, over in edges)
                and all(clock <= STEP - 4 for op, clock in zip(ops, at) if op.a in EXTERNAL))

    for n in (n for n, op in enumerate(ops) if op.w in SAMPLED):
        for clock in range(max(at[e] + d - over * STEP for e, l, d, over in edges if l == n), at[n]):
            other = next((k for k in range(len(ops)) if (at[k] - clock) % STEP == 0), None)
            moved = list(at)
            moved[n] = clock
            if other is not None:
                moved[other] = min((t for t in range(at[other] - STEP, at[other] + STEP) if t >= 0 and (t - at[n]) % STEP == 0),
                                   key=lambda t: abs(t - at[other]))
            if holds(moved):
                at = moved
                break
    if not holds(at):
        raise ValueError("no schedule")
    return at


# ---- encoding ----

FIELDS = [("w", 7), ("c", 7), ("a", 7), ("b", 7), ("relu", 3), ("unless", 3), ("external", 1), ("state", 1), ("minus", 1),
          ("minus_c", 1), ("low", 1), ("wrap", 1), ("fold", 1), ("unfold", 1), ("speed", 1), ("negative", 1), ("late", 1),
          ("valid", 1)]
WIDTH = sum(bits for _, bits in FIELDS)


def encode(op, address, late):
    values = {"w": address[op.w], "c": address[op.c or "ZERO"], "b": address[op.b or "ZERO"],
              "a": EXTERNAL.index(op.a) if op.a in EXTERNAL else address[op.a or "ZERO"],
              "external": op.a in EXTERNAL, "relu": RELU[op.relu], "unless": UNLESS[op.unless], "late": late, "valid": 1,
              **{name: int(getattr(op, name))
                 for name in ("state", "minus", "minus_c", "low", "wrap", "fold", "unfold", "speed", "negative")}}
    code, place = 0, 0
    for name, bits in FIELDS:
        code |= int(values[name]) << place
        place += bits
    return code


def header():
    """Of the whole program, as macros and a function of the clock."""
    ops = program()
    address, at = variables(ops), schedule(ops)
    out = ["// SPDX-License-Identifier: MIT\n// Generated by drivers/fabric/rtl/plant/microcode.py: change it there.\n",
           "`ifndef PLANT_PROGRAM_VH\n`define PLANT_PROGRAM_VH\n",
           f"`define PLANT_STEP 7'd{STEP}\n`define PLANT_CODE_BITS {WIDTH}\n"]
    place = 0
    for name, bits in FIELDS:
        out.append(f"`define OP_{name.upper()} {f'{place + bits - 1}:' if bits > 1 else ''}{place}\n")
        place += bits
    for name in sorted(OUTPUTS):
        out.append(f"`define WORD_{name.strip('_')} 7'd{address[name]}\n")
    rows = "".join(f"    7'd{clock % STEP}: code <= {WIDTH}'h{encode(ops[n], address, clock >= STEP):X}; \\\n"
                   for clock, n in sorted((clock, n) for n, clock in enumerate(at)))
    out.append(f"`define PLANT_PROGRAM \\\n{rows}    default: code <= {WIDTH}'h0;\n`endif\n")
    return "".join(out)


def c_header():
    """The words' addresses, which the host needs."""
    address = variables(program())
    rows = "".join(f"    PLANT_{name.strip('_')} = {n},\n" for name, n in address.items())
    return ("/* SPDX-License-Identifier: MIT */\n/* Generated by drivers/fabric/rtl/plant/microcode.py: change it there. */\n"
            f"#ifndef PLANT_ADDRESSES_H\n#define PLANT_ADDRESSES_H\n\n#define PLANT_STEP_CLOCKS {STEP}\n"
            f"#define PLANT_WORDS {WORDS}\n\nenum {{\n{rows}}};\n\n#endif\n")


def listing():
    ops = program()
    at = schedule(ops)
    for clock, n in sorted((clock, n) for n, clock in enumerate(at)):
        op = ops[n]
        yield f"{clock:3} {op.w:6} = {op.c or '0'} {'-' if op.minus else '+'} {op.a or '0'} {op.b}"


if __name__ == "__main__":
    if sys.argv[1:] == ["plant_program.vh"]:
        print(header(), end="")
    elif sys.argv[1:] == ["plant_addresses.h"]:
        print(c_header(), end="")
    else:
        print("\n".join(listing()))
