# SPDX-License-Identifier: MIT
"""A history by lot: who is there, how they behave, what fails. The same seed and number give the same text everywhere."""
import random
import re

CYCLIC, RESETS, SDO, NMT, WAITS, REJOINS, TAKES = 1, 2, 4, 8, 16, 32, 64  # swarm.h
RPM = (300, 500, 800, 1200, 1800, 2500, -400, -900, -1500)
WORDS = (0x00, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x1F, 0x80, 0x8F, 0x10F)
CHOICES = {
    "rpm": RPM, "rpm_or_none": (0, 0, *RPM), "bw": (30, 60), "few": (0, 1, 2), "timeout": (0, 300, 1000),
    "lasts": (1, 5, 30, 200, 1000), "brief": (30, 300), "silent": (30, 200, 800), "long": (100, 500, 2000),
    "word": tuple(65536 + word for word in WORDS), "repeats": (30, 300, 1500), "nmt": (1, 2, 128, 129, 130),
    "latch": (1 << 10, 1 << 11, 1 << 2, 1 << 1), "supply": (3000, 12000, 17000, 20000, 40000), "encoder": (1, 2, 3),
    "slip": (7, 120, 350, -500, 900), "offset": (300, -1500, 6000), "mnm": (50, 150, 400), "late": (1, 3, 9, 40),
    "hang": (5, 50, 150), "off": (20, 300), "writes": range(1, 901), "ramp": range(3000, 9001, 500),
}
SETTINGS = {
    "retry_count": (0, 1, 3), "retry_delay_ms": (10, 100, 300, 600, 1000), "command_timeout_ms": (0,) * 6 + (300, 2000),
    "can_recover": (0, 1), "can_heartbeat_ms": (0, 100), "can_node": (5,), "direction": (0, 0, 0, 1),
    "angle_source": (0,) * 8 + (1, 2), "ramp_rpm_s": (5000, 5000, 3000, 10000),
}
# what may come, and how often; + is 40 ms later
TYPED = {"on": 6, "off": 5, "speed {rpm}": 8, "quickstop": 3, "clear": 5, "torque 0.5": 1, "pp by 4000": 2, "hm index": 1,
         "csv 300": 1, "status": 2, "speed 9999": 2, "spede 300": 1, "save": 2, "set ramp_rpm_s {ramp}": 2,
         "set speed_bw_hz {bw}": 1, "set retry_count {few}": 1, "set command_timeout_ms {timeout}": 1, "get all": 1,
         "identify": 1, "take": 2, "help onn": 1, "set": 1, "load": 1}
RIGHT = {"want {line} 1 {rpm_or_none}": 5, "want {line} 0": 2, "target {line} {rpm}": 3}
BAD = {"die {line} 1": 2, "{boots}": 2, "die {line} 1+{boots}+want {line} 1 0": 1, "supply 12000 {brief}+die {line} 1": 3,
       "supply 12000 {brief}+{type} take": 1, "mute {line} {silent}": 1, "stale {line} {long}": 1,
       "repeat {line} {word} {repeats}": 2}
FAULTS = ("latch {axis} {latch} {lasts}", "supply {supply} {lasts}", "encoder {axis} {encoder} {lasts}", "slip {axis} {slip}",
          "sensor {axis} {offset} {lasts}", "load {axis} {mnm} {lasts}", "block {axis} 1 {lasts}", "clock 0 {lasts}",
          "late {late}", "hang {hang}", "power 0 {off}",
          "flash-cut {writes} 400+{type} off+{type} set ramp_rpm_s {ramp}+{type} save")


class Lot:
    """Draws that depend on the seed alone: random() is the one that Python promises to keep."""

    def __init__(self, seed):
        self._random = random.Random(seed).random

    def one(self, choices):
        return choices[int(self._random() * len(choices))]

    def chance(self, share):
        return self._random() < share

    def weighted(self, rows):
        at = self._random() * sum(weight for _, weight in rows)
        for what, weight in rows:
            at -= weight
            if at < 0:
                return what
        return rows[-1][0]

    def filled(self, text, **given):
        return re.sub(r"\{(\w+)\}", lambda name: str(given[name[1]] if name[1] in given else self.one(CHOICES[name[1]])), text)


def master(lot, line, axes):
    """The event that makes it boot."""
    kind = (CYCLIC if lot.chance(0.6) else 0) | lot.one((0, RESETS, WAITS, WAITS)) | (TAKES if lot.chance(0.2) else 0)
    if line == 1:
        kind |= (SDO if lot.chance(0.4) else 0) | (NMT if lot.chance(0.3) else 0) | (REJOINS if lot.chance(0.7) else 0)
    beats = lot.one((0, 50, 100, 100)) if line == 1 else 0
    return f"boot {line} {lot.one(range(axes))} {kind} {lot.one((10, 20, 20, 50, 150))} {beats}"


def doings(lot, masters):
    """[((text, what it names), weight)] of this history: not all of what exists comes in each."""
    rows = [((f"{{type}} {text}", {}), weight) for text, weight in TYPED.items()] if lot.chance(0.8) else []
    rows = [(row, weight * 8 / sum(TYPED.values())) for row, weight in rows]
    for line, boots in masters.items():
        bad = BAD if lot.chance(0.6) else {}
        names = {"line": line, "boots": boots}
        rows += [((text, names), weight) for text, weight in (RIGHT | bad).items()]
        rows += [(("nmt {nmt}", {}), 4), (("bus-off 1 {lasts}", {}), 3)] if line == 1 and bad else []
    rows += [((fault, {}), lot.one((1, 1, 2))) for fault in FAULTS if lot.chance(0.25)]
    return rows or [(("{type} on", {}), 1)]


def history(seed, number):
    """Its text: docs/guides/code.md."""
    lot = Lot(f"{seed}.{number}")
    axes = 2 if lot.chance(0.2) else 1
    masters = {line: master(lot, line, axes) for line, share in ((0, 0.5), (1, 0.7)) if lot.chance(share)}
    lines = [f"axes {axes}"] + [f"set {name} {lot.one(choices)}" for name, choices in SETTINGS.items()]
    events = [(lot.one(range(30, 61)), boots) for boots in masters.values()]
    rows = doings(lot, masters)
    first = [lot.filled("want {line} 1 {rpm}", line=line) for line in masters] + ["type axis 1 on" if axes == 2 else "type on"]
    events.append((lot.one(range(100, 301)), lot.one(first)))
    at_ms = 400
    for _ in range(lot.one(range(3, 15))):
        at_ms += lot.one((1, 3, 20, 120, 300, 700, 1500))
        text, names = lot.weighted(rows)
        axis = lot.one(range(axes))
        for what in lot.filled(text, axis=axis, type=f"type axis {axis + 1}" if axes == 2 else "type", **names).split("+"):
            events.append((at_ms, what))
            at_ms += 40
    events.sort(key=lambda event: event[0])
    return "\n".join(lines + [f"{ms} {what}" for ms, what in events] + [f"end {at_ms + 300}"]) + "\n"
