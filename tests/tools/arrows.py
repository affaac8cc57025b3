# SPDX-License-Identifier: MIT
"""Who needs whose symbol in firmware/, by the built objects: no circle between files, and rooms only use what is below.

    arrows.py [FOLDER]      FOLDER: of the objects, build/arm/firmware
"""
import sys
from pathlib import Path

from elftools.elf.elffile import ELFFile

ROOT = Path(__file__).resolve().parents[2]
# from the ground up; a room uses itself and what stands before it
ROOMS = ("axis", "settings", "control", "fault", "commission", "source", "monitor", "drive", "scope", "system", "operate", "")


def symbols(path):
    """(defined, needed): names that other objects can use, and names that this one uses of others."""
    with open(path, "rb") as file:
        table = ELFFile(file).get_section_by_name(".symtab")
        names = [(s.name, s["st_shndx"] != "SHN_UNDEF") for s in table.iter_symbols()
                 if s.name and s["st_info"]["bind"] in ("STB_GLOBAL", "STB_WEAK")]
    return {name for name, is_here in names if is_here}, {name for name, is_here in names if not is_here}


def arrows(objects):
    """{user: {used: symbols}} of {name: (defined, needed)}."""
    owner = {symbol: name for name, (defined, _) in objects.items() for symbol in defined}
    found = {name: {} for name in objects}
    for name, (_, needed) in objects.items():
        for symbol in needed & owner.keys():
            found[name].setdefault(owner[symbol], set()).add(symbol)
    return found


def circles(found):
    """Sets of objects that need each other: the strongly connected ones, by Kosaraju's two passes."""
    order, seen = [], set()

    def walk(start, edges, leave):
        stack = [(start, iter(edges[start]))]
        seen.add(start)
        while stack:
            name, others = stack[-1]
            other = next((o for o in others if o not in seen), None)
            if other is None:
                leave(name)
                stack.pop()
            else:
                seen.add(other)
                stack.append((other, iter(edges[other])))

    for name in sorted(found):
        if name not in seen:
            walk(name, found, order.append)
    back = {name: [user for user in found if name in found[user]] for name in found}
    seen.clear()
    for name in reversed(order):
        if name not in seen:
            circle = []
            walk(name, back, circle.append)
            if len(circle) > 1:
                yield sorted(circle)


def room(name):
    return name.rpartition("/")[0]


def findings(objects):
    found = arrows(objects)
    for circle in circles(found):
        yield "a circle: " + ", ".join(circle)
    for user in sorted(found):
        for used, names in sorted(found[user].items()):
            if ROOMS.index(room(used)) > ROOMS.index(room(user)):
                yield f"{user} reaches up to {used}: {', '.join(sorted(names))}"


def objects_in(folder):
    """Those that have a source: a folder keeps what it built before a file was moved."""
    names = {path: path.relative_to(folder).with_suffix("") for path in sorted(folder.rglob("*.o"))}
    there = {path: name for path, name in names.items() if list((ROOT / "firmware" / name.parent).glob(f"{name.name}.[cS]"))}
    return {str(name): symbols(path) for path, name in there.items()}


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "build/arm/firmware")
    objects = objects_in(folder)
    if not objects:
        sys.exit(f"arrows: no objects in {folder}; 'make' builds them")
    wrong = list(findings(objects))
    print("\n".join(wrong) or f"arrows: {len(objects)} objects, {sum(map(len, arrows(objects).values()))} arrows, no circle")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
