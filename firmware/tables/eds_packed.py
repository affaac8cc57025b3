# SPDX-License-Identifier: MIT
"""The drive's electronic data sheet for its image: packed, as firmware/operate/canopen.h says.

usage: eds_packed.py HEADER AXES
"""
import sys
from collections import Counter
from pathlib import Path

from eds import eds

WINDOW, DISTANCE_BITS = 1024, 10
LEAST, COUNT_BITS = 3, 6
MOST = LEAST + 2 ** COUNT_BITS - 1
CHARACTER_BITS, FREQUENT_BITS = 7, 4
FREQUENT_COST, CHARACTER_COST, COPY_COST = 2 + FREQUENT_BITS, 2 + CHARACTER_BITS, 1 + DISTANCE_BITS + COUNT_BITS
BYTES_A_LINE = 20


def longest_copies(text):
    """Of each place (characters that stand a little before it already, how far before)."""
    seen, found = {}, []
    for at in range(len(text)):
        places, best = seen.setdefault(text[at:at + LEAST], []), (0, 0)
        for place in reversed(places):
            if at - place > WINDOW or best[0] == MOST:
                break
            count = LEAST if at + LEAST <= len(text) else 0
            while 0 < count < MOST and text[place + count] == text[at + count:at + count + 1]:
                count += 1
            best = max(best, (count, at - place), key=lambda one: one[0])
        places.append(at)
        found.append(best)
    return found


def shortest_way(text, copies, frequent):
    """[(place, characters, distance)] of the fewest bits; distance 0: the character itself."""
    cost, step = [0] * (len(text) + 1), [1] * len(text)
    for at in range(len(text) - 1, -1, -1):
        cost[at] = cost[at + 1] + (FREQUENT_COST if text[at] in frequent else CHARACTER_COST)
        for count in range(LEAST, copies[at][0] + 1):
            if cost[at + count] + COPY_COST < cost[at]:
                cost[at], step[at] = cost[at + count] + COPY_COST, count
    at = 0
    while at < len(text):
        yield at, step[at], copies[at][1] if step[at] > 1 else 0
        at += step[at]


def packed(text):
    """(the bytes, the most frequent characters)"""
    assert text.isascii(), "a character has seven bits"
    copies, frequent = longest_copies(text), ""
    for _ in range(3):  # which characters are left depends on what a character costs
        left = Counter(text[at] for at, _, distance in shortest_way(text, copies, frequent) if not distance)
        frequent = "".join(sorted(character for character, _ in left.most_common(2 ** FREQUENT_BITS)))
    bits = "".join(f"1{distance - 1:0{DISTANCE_BITS}b}{count - LEAST:0{COUNT_BITS}b}" if distance
                   else f"00{frequent.index(text[at]):0{FREQUENT_BITS}b}" if text[at] in frequent
                   else f"01{ord(text[at]):0{CHARACTER_BITS}b}" for at, count, distance in shortest_way(text, copies, frequent))
    bits += "0" * (-len(bits) % 8)
    return bytes(int(bits[at:at + 8], 2) for at in range(0, len(bits), 8)), frequent


def header(text):
    data, frequent = packed(text)
    rows = [", ".join(map(str, data[at:at + BYTES_A_LINE])) for at in range(0, len(data), BYTES_A_LINE)]
    return "\n".join(("/* by firmware/tables/eds_packed.py */", f"#define TEXT_BYTES {len(text)}u", "",
                      f"static const uint8_t frequent[{len(frequent)}] = {{{', '.join(map(str, frequent.encode()))}}};", "",
                      f"static const uint8_t packed[{len(data)}] = {{", *(f"    {row}," for row in rows), "};", ""))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(header(eds(int(sys.argv[2]))), encoding="utf-8")
