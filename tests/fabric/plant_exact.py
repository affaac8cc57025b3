# SPDX-License-Identifier: MIT
"""The plant in exact arithmetic: what each operation of microcode.py gives, bit for bit, and the RTL held to it.

plant_exact.py [RUNS]     plays random words and gates on the verilated plant; prints one line, exits 1 at the first difference
plant_exact.py --faults   puts each fault of plant_faults.toml into a copy of the RTL; exits 1 if one is not noticed
"""
import ctypes
import os
import random
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from places import REGISTERS, ROOT

sys.path.insert(0, str(ROOT / "drivers/fabric/rtl/plant"))
import microcode  # noqa: E402

WORD, HALF = 1 << 36, 1 << 18
STEP = microcode.STEP
CONTROL, FAULT = 0x04, 0x08


def signed(value, bits):
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


class Model:
    """Words and latches; one step at a time, in the order of the program."""

    def __init__(self, words, control=0, opened=0):
        self.ops = microcode.program()
        self.address = microcode.variables(self.ops)
        self.word = dict(words)
        self.sinks, self.igbt, self.opened = control >> 1 & 1, control >> 2 & 1, opened
        self.folded = self.slow = False
        self.into, self.turn = [False] * 3, 0

    def legs(self, high, low, into, middle):
        """{input: value} of clocks counted."""
        none = [STEP - h - l for h, l in zip(high, low)]
        off = [bool(self.opened >> k & 1) or none[k] == STEP for k in range(3)]
        bus = [high[k] + (none[k] if into[k] else 0) for k in range(3)]
        upper = [STEP if off[k] else bus[k] for k in range(3)]
        sign = [-1 if into[k] else 1 for k in range(3)]
        back = [(high[k] if into[k] else low[k]) if self.igbt else 0 for k in range(3)]
        ahead = [(low[k] if into[k] else high[k]) if self.igbt else 0 for k in range(3)]
        diode = [-STEP if off[k] else sign[k] * (none[k] + back[k]) for k in range(3)]
        drop = [0 if off[k] else sign[k] * ahead[k] for k in range(3)]
        driven = [upper[k] for k in range(3) if not off[k]]
        count = len(driven)
        neutral = STEP if count == 0 else 2 * driven[0] if count == 1 else sum(driven)
        weight = [(-HALF // 8 if middle == k else 0) if count == 0 else 0 if off[k] else HALF // 4 if count == 1 else HALF // 8
                  for k in range(3)]
        found = {"HIGH_ALPHA": (2 * upper[0] - upper[1] - upper[2]) << 9, "HIGH_BETA": (upper[1] - upper[2]) << 9,
                 "DIODE_ALPHA": (2 * diode[0] - diode[1] - diode[2]) << 8, "DIODE_BETA": (diode[1] - diode[2]) << 8,
                 "SWITCH_ALPHA": (2 * drop[0] - drop[1] - drop[2]) << 8, "SWITCH_BETA": (drop[1] - drop[2]) << 8,
                 "NEUTRAL": neutral << 9}
        found.update({f"WEIGHT_{leg}": weight[k] for k, leg in enumerate("ABC")})
        found.update({f"HIGH_{leg}": bus[k] << 9 for k, leg in enumerate("ABC")})
        return {name: signed(value, 18) for name, value in found.items()}, off

    def step(self, high, low, chops):
        """Yields (operation, what it writes or None)."""
        for n, op in enumerate(self.ops):
            sixth = (3 * self.turn + (1 << 16)) >> 17
            external, off = self.legs(high, low, self.into, (0, 2, 1)[sixth % 3])
            a = external[op.a] if op.a in external else self.word[op.a or "ZERO"] >> 18
            b = self.word[op.b or "ZERO"]
            product = a * (b >> 18) << 10 >> (8 if op.state else b & 31)
            c = self.word[op.c or "ZERO"]
            c = c % HALF if op.low else c
            turned = op.unfold and self.folded
            total = (-c if op.minus_c ^ turned else c) + (-product if op.minus ^ turned ^ (op.speed and self.slow) else product)
            yield n, self.fitted(op, total, off, chops)

    def fitted(self, op, total, off, chops):
        relu = {"": False, "zero": True, "nosink": not self.sinks}
        relu.update({f"leg_{leg}": not self.opened >> k & 1 for k, leg in enumerate("abc")})
        zero = {"": False, "chops": not chops, **{f"off_{leg}": not off[k] for k, leg in enumerate("abc")}}
        if op.fold:
            low = signed(total, 36)
            self.folded = (low >> 35 & 1) != (low >> 34 & 1)
            result = signed(~low, 35) if self.folded else low
        elif zero[op.unless] or relu[op.relu] and total < 0:
            result = 0
        else:
            result = signed(total, 36) if op.wrap else max(min(total, WORD // 2 - 1), -WORD // 2)
        if op.negative and total >= 0:
            return None
        if op.w == "W":
            self.slow = total < 0
        self.word[op.w] = result
        if op.w in ("IA", "IB", "IC"):
            self.into["ABC".index(op.w[1])] = result < 0
        elif op.w == "THE":
            self.turn = (result >> 18) % HALF
        return result


class Pins(ctypes.Structure):
    _fields_ = [("high", ctypes.c_uint8), ("low", ctypes.c_uint8), ("chops", ctypes.c_bool), ("cs_n", ctypes.c_bool),
                ("sclk", ctypes.c_bool), ("temp_cs_n", ctypes.c_bool), ("temp_sclk", ctypes.c_bool)]


class Rtl:
    """The verilated plant."""

    def __init__(self, library=None):
        self.lib = ctypes.CDLL(str(library or REGISTERS / "plant/plant.so"))
        self.lib.rtl_plant_new.restype = ctypes.c_void_p
        self.lib.rtl_plant_get.restype = ctypes.c_int64
        self.lib.rtl_plant_put.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int64]
        self.lib.rtl_plant_clocks.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]
        self.lib.rtl_plant_write.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32]
        self.plant = ctypes.c_void_p(self.lib.rtl_plant_new())
        self.pins = Pins(0, 0, False, True, True, True, True)

    def clock(self, clocks=1):
        self.lib.rtl_plant_clocks(self.plant, ctypes.byref(self.pins), clocks)

    def put(self, place, word):
        self.lib.rtl_plant_put(self.plant, place, word)

    def get(self, place):
        return self.lib.rtl_plant_get(self.plant, place)

    def set(self, offset, value):
        self.lib.rtl_plant_write(self.plant, offset, value)

    @property
    def phase(self):
        return self.lib.rtl_plant_phase(self.plant)

    def written(self):
        word = ctypes.c_int64()
        place = self.lib.rtl_plant_writes(self.plant, ctypes.byref(word))
        return None if place < 0 else (place, word.value)


def random_word(rng, coefficient):
    if coefficient:
        return signed(rng.getrandbits(18), 18) * HALF + rng.randrange(32)
    return signed(rng.getrandbits(36), 36) >> rng.choice((0, 0, 1, 4, 12, 24))


class Legs:
    """plant_leg.v, three times, without delays."""

    def __init__(self):
        self.on = [[False] * 3, [False] * 3]       # high, low
        self.count, self.taken = [[0] * 3, [0] * 3], [[0] * 3, [0] * 3]

    def clock(self, phase, high, low):
        for k in range(3):
            alone = [self.on[0][k] and not self.on[1][k], self.on[1][k] and not self.on[0][k]]
            for side in range(2):
                now = self.count[side][k] + alone[side]
                if phase == STEP - 3:
                    self.taken[side][k], now = now, 0
                self.count[side][k] = now
                self.on[side][k] = bool((high, low)[side] >> k & 1)


def gates(rng, high, low):
    """At most one side of a leg, most of the time; some legs rest for long."""
    for k in range(3):
        if rng.random() < 0.03:
            which = rng.choice((0, 0, 1, 2, 1, 2, 3))
            high = high & ~(1 << k) | (which & 1) << k
            low = low & ~(1 << k) | (which >> 1) << k
    return high, low


def play(seed, steps, library=None):
    """One run from random words; the number of results compared. Raises Different."""
    rng = random.Random(seed)
    ops = microcode.program()
    address, at = microcode.variables(ops), microcode.schedule(ops)
    coefficients = {op.b for op in ops if op.b and not op.state}
    words = {name: 0 if name == "ZERO" else random_word(rng, name in coefficients) for name in address}
    control, opened, chops = rng.randrange(4) << 1, rng.choice((0, 0, 0, rng.randrange(8))), rng.randrange(2)
    model, rtl, legs = Model(words, control, opened), Rtl(library), Legs()
    for name, word in words.items():
        rtl.put(address[name], word)
    rtl.pins.chops = chops
    rtl.set(FAULT, opened)
    rtl.set(CONTROL, control | 1)
    while rtl.phase != 0:
        rtl.clock()
    expected, compared = {}, 0
    busy = rng.random() < 0.7
    for clock in range(steps * STEP):
        if clock % STEP == 0:
            for n, value in model.step(*legs.taken, chops):
                if value is not None:
                    expected[clock + at[n] + microcode.LATENCY + 1] = address[ops[n].w], value, ops[n].w
        found, wanted = rtl.written(), expected.pop(clock, None)
        if found != (wanted and wanted[:2]):
            raise Different(f"seed {seed}, step {clock // STEP}, clock {clock % STEP}: {found} written, {wanted} expected")
        compared += found is not None
        if busy or rng.random() < 0.02:
            rtl.pins.high, rtl.pins.low = gates(rng, rtl.pins.high, rtl.pins.low)
        legs.clock(rtl.phase, rtl.pins.high, rtl.pins.low)
        rtl.clock()
    return compared


class Different(Exception):
    """Where the RTL writes another word than the arithmetic."""


def noticed(name, old, new):
    """What is said of the RTL with a fault; None: nothing."""
    source = ROOT / "drivers/fabric/rtl/plant"
    text = (source / f"{name}.v").read_text(encoding="utf-8")
    if text.count(old) != 1:
        raise ValueError(f"{name}.v has {text.count(old)} times: {old!r}")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(source, Path(folder) / "rtl")
        (Path(folder) / "rtl" / f"{name}.v").write_text(text.replace(old, new), encoding="utf-8")
        command = ["make", "-s", "NO_INSTALL=1", "VERILATOR=verilator -Wno-fatal", f"{folder}/plant/plant.so"]
        places_of = {**os.environ, "PLANT_FROM": f"{folder}/rtl", "PLANT_DIR": f"{folder}/plant"}
        run = subprocess.run(command, env=places_of, cwd=ROOT, capture_output=True, text=True)
        if run.returncode:
            raise ValueError(f"{name}.v does not build with {new!r}: {run.stderr.strip()}")
        try:
            for seed in range(60):
                play(seed, 12, f"{folder}/plant/plant.so")
        except Different as why:
            return str(why)
    return None


def faults():
    path = ROOT / "tests/fabric/plant_faults.toml"
    return [(name, fault["from"], fault["to"]) for name, group in tomllib.loads(path.read_text(encoding="utf-8")).items()
            for fault in group["list"]]


def attack():
    survived = [(name, old) for name, old, new in faults() if noticed(name, old, new) is None]
    for name, old in survived:
        print(f"plant fault in {name}.v survives: {old!r}")
    print(f"plant faults: {len(faults()) - len(survived)} of {len(faults())} noticed by exact arithmetic")
    return 1 if survived else 0


def main(arguments):
    if arguments == ["--faults"]:
        return attack()
    runs = int(arguments[0]) if arguments else 60
    compared = 0
    try:
        for seed in range(runs):
            compared += play(seed, 12)
    except Different as why:
        print(f"plant exact: {why}")
        return 1
    print(f"plant exact: {compared} results of {runs} runs from random words are those of exact arithmetic")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
