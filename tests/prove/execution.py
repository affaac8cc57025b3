# SPDX-License-Identifier: MIT
"""Runs the code of one kernel in the machine: lays out its arguments as the procedure call standard does, collects results."""
import z3
from abstraction import Lookups, Products
from kernel import Pointer
from machine import Machine
from memory import Region, Stack


class Execution:
    """
    overlap=None: every pointer has an object of its own. overlap=k: the second pointer points k words behind the first.
    constants: {input: int} for those inputs that are not to be variables.
    """

    def __init__(self, kernel, code, constants=None, overlap=None, table_words=None):
        constants = constants or {}
        self.kernel = kernel
        self.inputs = {name: z3.BitVecVal(constants[name], 32) if name in constants else z3.BitVec(name, 32)
                       for name in kernel.inputs}
        self.products = Products()
        table = kernel.table
        self.table = table_words or (Lookups(table.lowest, table.highest) if table else None)
        places = self._arguments(overlap)
        registers = {n: place for n, place in enumerate(places[:4])}
        self.stack = Stack({4 * n: place for n, place in enumerate(places[4:])})
        tables = [Region(table.symbol, {}, table=self.table, table_words=table.words)] if table else []
        regions = [self.stack, *self.objects, *tables]
        self.machine = Machine(code, registers, regions, self.products).run()
        self.obligations = self.machine.obligations
        self.outputs = self._results()

    def _arguments(self, overlap):
        """Values of the arguments in order; makes the objects that the pointers point to."""
        places, self.objects, self.at = [], [], {}
        for argument in self.kernel.arguments:
            if not isinstance(argument, Pointer):
                places.append(self.inputs[argument.name])
                continue
            shared = overlap is not None and self.objects
            region = self.objects[0] if shared else Region(argument.name, {})
            shift = 4 * overlap if shared else 0
            for index, name in enumerate(argument.fields):
                offset = shift + 4 * index
                if name in argument.inputs:
                    region.words[offset] = self.inputs[name]
                if name in argument.out:
                    region.writable.add(offset)
                    self.at[name] = region, offset
            if not shared:
                self.objects.append(region)
            places.append(z3.simplify(region.base + shift))
        return places

    def _results(self):
        results = {}
        for name, (region, offset) in self.at.items():
            results[name] = z3.simplify(region.words[offset]) if offset in region.words else None
        if self.kernel.result:
            results[self.kernel.result] = z3.simplify(self.machine.r[0])
        return results

    @property
    def facts(self):
        """What is known of products and words of tables."""
        return self.products.facts + (self.table.facts if self.kernel.table else [])

    def numbers(self):
        """Results as signed integers, when all inputs were constants; an output never written is None."""
        return {name: term.as_signed_long() if term is not None and z3.is_bv_value(term) else None
                for name, term in self.outputs.items()}


def overlaps(kernel):
    """Every distance in words at which the two objects share a word."""
    if not kernel.overlap:
        return []
    first, second = kernel.arguments
    return range(1 - len(second.fields), len(first.fields))
