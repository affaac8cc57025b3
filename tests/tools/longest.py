# SPDX-License-Identifier: MIT
"""The longest way through a function's instructions, in cycles: a graph without loops, or with loops of a known bound."""
from dataclasses import dataclass

from disasm import ImageError


@dataclass
class Way:
    """`cycles` to the end of the last instruction of `path`, the addresses on the way."""
    cycles: int
    path: list


class Longest:
    """Bounds of the functions of an image. `costs(function)` gives the timing.Costs of a function.

    loops    {function: how often its back edges are taken at most, together}; a loop that is not listed is an error
    avoid    names of functions whose calls are left out, with every way that leads only to them
    """

    def __init__(self, image, costs, loops=None, avoid=()):
        self.image, self._costs, self.loops, self.avoid = image, costs, loops or {}, set(avoid)
        self._known, self._open = {}, []

    def cycles(self, function):
        """From its first instruction until it has returned, called functions included."""
        return self.to_return(function).cycles

    def to_return(self, function):
        if function.name in self._open:
            raise ImageError(f"recursion: {' -> '.join([*self._open, function.name])}")
        if function.name not in self._known:
            self._open.append(function.name)
            ends = [way for i, way in self.ways(function) if self._is_end(function, i)]
            self._open.pop()
            if not ends:
                raise ImageError(f"{function.name} never returns: its cycles have no bound")
            self._known[function.name] = max(ends, key=lambda way: way.cycles)
        return self._known[function.name]

    def ways(self, function):
        """[(instruction, longest Way to its end)] of everything that can be reached; a tail call counts to its return.

        A node is an instruction, how often a loop has turned, and for how long a posted write still occupies the bus.
        """
        order, back = self._order(function)
        turns, costs = self._turns(function, back), self._costs(function)
        first, writing = function.code[function.start], costs.waits.apb_write  # by whoever was there before
        start = (first.address, 0, costs.posted(first, writing))
        best = {start: (costs.step(first, None, True) + costs.stall(first, writing), None)}  # by a branch or an exception
        at = {(first.address, 0): {start}}
        for turn in range(turns + 1):
            for address in order:
                for node in at.get((address, turn), ()):
                    self._spread(function, costs, best, at, node, back, turns)
        return [(function.code[node[0]], Way(cycles + self._tail(function, costs, function.code[node[0]]) + node[2],
                                             _path(best, node))) for node, (cycles, _) in best.items()]

    def _spread(self, function, costs, best, at, node, back, turns):
        i, cycles = function.code[node[0]], best[node][0]
        for to, taken in self._edges(function, i):
            turn = node[1] + ((i.address, to) in back)
            if turn > turns:
                continue
            following = function.code[to]
            after_call = i.flow.startswith("call")
            branch = costs.leave(i, taken or after_call)
            pending = 0 if after_call else max(0, node[2] - branch)
            total = cycles + branch + self._called(i) + costs.stall(following, pending)
            total += costs.step(following, None if after_call else i, taken or after_call)
            reached = (to, turn, costs.posted(following, pending))
            if total > best.get(reached, (-1,))[0]:
                best[reached] = (total, node)
                at.setdefault((to, turn), set()).add(reached)

    def _edges(self, function, i):
        """(address, by a taken branch) of what may follow inside the function."""
        if self._is_avoided(function, i):
            return
        for to in function.successors(i):
            if to not in function.code:
                raise ImageError(f"{function.name} runs out of its code at {to:#x}")
            if not self._is_avoided(function, function.code[to]):
                yield to, to in i.targets

    def _is_avoided(self, function, i):
        outside = function.leaves_to(i)
        called = i.targets[0] if i.flow == "call" else outside
        target = self.image.functions_at.get(called) if called is not None else None
        return target is not None and bool(self.avoid & set(target.aliases))

    def _called(self, i):
        if i.flow == "call pointer":
            raise ImageError(f"a call through a pointer at {i.address:#x}: its cycles have no bound")
        return self.cycles(self.image.functions_at[i.targets[0]]) if i.flow == "call" else 0

    def _tail(self, function, costs, i):
        outside = function.leaves_to(i)
        if outside is None or self._is_avoided(function, i):
            return 0
        return costs.leave(i, True) + self.cycles(self.image.functions_at[outside])

    def _is_end(self, function, i):
        return i.flow == "return" or (function.leaves_to(i) is not None and not self._is_avoided(function, i))

    def _order(self, function):
        """Reachable addresses, each before what follows it, and the edges that go back."""
        done, order, back, on_way = set(), [], set(), set()
        stack = [(function.start, None)]
        while stack:
            address, edges = stack.pop()
            if edges is None:
                if address in done or address in on_way:
                    continue
                on_way.add(address)
                edges = iter([to for to, _ in self._edges(function, function.code[address])])
            for to in edges:
                if to in on_way:
                    back.add((address, to))
                elif to not in done:
                    stack += [(address, edges), (to, None)]
                    break
            else:
                on_way.discard(address)
                done.add(address)
                order.append(address)
        return order[::-1], back

    def _turns(self, function, back):
        if not back:
            return 0
        if function.name not in self.loops:
            at = min(source for source, _ in back)
            raise ImageError(f"{function.name} has a loop at {at:#x} ({self.image.line_of(at)}): its cycles have no bound")
        return self.loops[function.name]


def _path(best, node):
    path = []
    while node is not None:
        path.append(node[0])
        node = best[node][1]
    return path[::-1]
