# SPDX-License-Identifier: MIT
"""Worst-case stack of every entry point, from the compiler's own call graph (-fcallgraph-info=su), with nesting.

usage: stack.py IMAGE.elf OBJECT_DIR

Recursion, a frame of unknown size or an indirect call whose targets are not listed below is an error, not a guess.
"""
import re
import sys
from pathlib import Path

from elftools.elf.elffile import ELFFile

EXCEPTION_FRAME = 32 + 4  # eight words, and one that aligns the stack to 8 bytes (ARMv7-M, B1.5.7)
# what calls through a pointer, and what the pointer may hold
INDIRECT = {"commands_execute": re.compile(r"^run_\w+$"), "param_get": None}
# entry points in order of urgency: each can interrupt all that follow it
NESTED = ["FabricIrq0_IRQHandler", "Timer1_IRQHandler", "UART0_IRQHandler"]
THREAD = "main"
FAULT = "fault_taken"


class Graph:
    def __init__(self):
        self.frame, self.calls = {}, {}

    def read(self, path):
        for line in path.read_text().split("\n"):
            node = re.match(r'node: \{ title: "([^"]+)" label: "([^"]+)"', line)
            edge = re.match(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', line)
            if node:
                name = node.group(1).split(":")[-1]
                size = re.search(r"(\d+) bytes \((\w+[^)]*)\)", node.group(2))
                if size:
                    if size.group(2) != "static":
                        raise SystemExit(f"mssfoc: {path}: the frame of {name} is {size.group(2)}, not static")
                    self.frame[name] = int(size.group(1))
            elif edge:
                source, target = (edge.group(i).split(":")[-1] for i in (1, 2))
                self.calls.setdefault(source, set()).add(target)

    def targets(self, name):
        for target in self.calls.get(name, ()):
            if target != "__indirect_call":
                yield target
                continue
            pattern = INDIRECT.get(name)
            if pattern is None:
                raise SystemExit(f"mssfoc: {name} calls through a pointer; list its targets in tests/tools/stack.py")
            yield from (f for f in self.frame if pattern.match(f))

    def depth(self, name, path=()):
        """Bytes and the deepest chain below and including `name`."""
        if name in path:
            raise SystemExit(f"mssfoc: recursion: {' -> '.join(path + (name,))}")
        below = max((self.depth(t, path + (name,)) for t in self.targets(name)), default=(0, ()), key=lambda d: d[0])
        # the compiler's run-time functions have no graph: their frames were read off their disassembly
        own = self.frame.get(name, RUNTIME.get(name))
        if own is None:
            raise SystemExit(f"mssfoc: no stack figure for {name}")
        return own + below[0], (name,) + below[1]


# bytes of stack of libgcc's functions, including what they call (GCC 12.2: push {r4-r11, lr} and locals)
RUNTIME = {"__aeabi_ldivmod": 80, "__aeabi_uldivmod": 80}


def symbol(elf, name):
    found = elf.get_section_by_name(".symtab").get_symbol_by_name(name)
    if not found:
        raise SystemExit(f"mssfoc: the image has no symbol {name}")
    return found[0]["st_value"]


def main(image, objects):
    graph = Graph()
    for path in sorted(Path(objects).rglob("*.ci")):
        if path.parts[-2] != "target":
            graph.read(path)
    with open(image, "rb") as stream:
        elf = ELFFile(stream)
        reserved = symbol(elf, "link_stack_top") - symbol(elf, "link_stack_limit")
        fault_reserved = symbol(elf, "link_fault_stack_top") - symbol(elf, "link_fault_stack_limit")

    rows, total = [], 0
    for name in [THREAD, *reversed(NESTED)]:
        bytes_, chain = graph.depth(name)
        total += bytes_ + (EXCEPTION_FRAME if name != THREAD else 0)
        rows.append((name, bytes_, total, " > ".join(chain[1:])))
    print(f"{'entry point':<24}{'own bytes':>10}{'nested':>8}  deepest chain")
    for name, own, nested, chain in rows:
        print(f"{name:<24}{own:>10}{nested:>8}  {chain}")
    fault, chain = graph.depth(FAULT)
    print(f"{FAULT:<24}{fault:>10}{'':>8}  {' > '.join(chain[1:])}")
    print(f"main stack {total} of {reserved} bytes, fault stack {fault} of {fault_reserved}")
    if total > reserved or fault > fault_reserved:
        print("mssfoc: the stack does not fit; enlarge it in linker/m2s010.ld", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    sys.exit(main(*sys.argv[1:]))
