# SPDX-License-Identifier: MIT
"""Stack depth along a function's instructions, and below its calls: what the image does, not what a compiler reports."""
import fnmatch
import re

from disasm import ImageError

# calls through a pointer -> the constant tables that hold all their targets, a * for any end of their names; what is not
# listed here is refused
POINTER_TABLES = {
    "states_take": "transition_table",
    "states_step": "state_steps",
    "step_state": "state_steps",
    **dict.fromkeys(("modes_check", "modes_enter", "modes_aim", "modes_step", "set_point_take", "post", "aim"), "mode_*"),
    **dict.fromkeys(("start_source_before", "start_source_after", "start_begin", "start_step", "step_calibration",
                     "step_wiring", "is_driven_by_load", "wiring_failed", "start_tuning"), "start_by_*"),
    "commands_execute": "commands_*",
    "arguments_read": "argument_kinds",
    "modbus_function": "modbus_functions",
    "apply_target": "cia402_modes",
    "change_state": "cia402_transitions",
    "argument_candidate": "argument_kinds",
    "nearest_name": "argument_kinds",
    **dict.fromkeys(("identify_measure", "identify_step", "identify_evaluate"), "identify_script"),
}
# and the words of a row that this function calls: slices of the table, where it does not call them all
POINTER_COLUMNS = {"identify_measure": slice(1, None, 4), "identify_step": slice(1, None, 4),
                   "identify_evaluate": slice(2, None, 4), "start_begin": slice(0, None, 6),
                   "step_calibration": slice(1, None, 6), "start_tuning": slice(5, None, 6)}


def stack_step(instruction):
    """Bytes by which an instruction deepens the stack (negative: releases)."""
    text, operands = instruction.mnemonic, instruction.operands.replace(" ", "")
    if text == "push" or (text in ("stmdb", "stmfd") and operands.startswith("sp!")):
        return 4 * len(instruction.registers)
    if text == "pop" or (text in ("ldmia", "ldmfd", "ldm") and operands.startswith("sp!")):
        return -4 * len(instruction.registers)
    moved = re.match(r"^sp,(?:sp,)?#(-?\d+)$", operands)
    if text in ("sub", "subw", "add", "addw") and moved:
        return int(moved.group(1)) * (1 if text.startswith("sub") else -1)
    indexed = re.search(r"\[sp,#(-?\d+)\]!|\[sp\],#(-?\d+)", operands)
    if indexed and re.match(r"(ldr|str)", text):
        return -int(indexed.group(1) or indexed.group(2))
    if _writes_stack_pointer(text, operands):
        raise ImageError(f"the stack pointer changes by an amount that is not a constant at {instruction.address:#x}:"
                         f" {instruction}")
    return 0


def _writes_stack_pointer(text, operands):
    if re.match(r"(ldm|stm)", text):
        return operands.startswith("sp!")
    if re.match(r"(cmp|cmn|tst|teq|str|push|pop|b|msr|it)", text):
        return False
    return operands.split(",")[0] in ("sp", "sp!") or "[sp]!" in operands


def depths(function):
    """{address: bytes on the stack before the instruction} for every instruction that can be reached."""
    before, work = {}, [(function.start, 0)]
    while work:
        address, depth = work.pop()
        if address in before:
            if before[address] != depth:
                raise ImageError(f"{function.name}: {before[address]} or {depth} bytes of stack at {address:#x},"
                                 " depending on the way there")
            continue
        instruction = function.code.get(address)
        if instruction is None:
            raise ImageError(f"{function.name} runs out of its code at {address:#x}")
        before[address] = depth
        step = stack_step(instruction)
        if step and instruction.conditional and instruction.flow != "return":
            raise ImageError(f"{function.name}: a conditional change of the stack pointer at {address:#x}")
        leaves = instruction.flow == "return" or function.leaves_to(instruction) is not None
        if leaves and depth + step != 0:
            raise ImageError(f"{function.name} leaves {depth + step} bytes on the stack at {address:#x}")
        if instruction.conditional and instruction.flow == "return":
            work.append((instruction.end, depth))
        elif instruction.flow != "return":
            if not _never_returns(function, instruction):
                work += [(after, depth + step) for after in function.successors(instruction)]
    return before


def _never_returns(function, instruction):
    """A call that is the last instruction of its function: nothing of the function stands behind it to return to."""
    return instruction.flow.startswith("call") and instruction.end not in function.code


def own_frame(function):
    before = depths(function)
    return max(depth + max(0, stack_step(function.code[at])) for at, depth in before.items())


def table_targets(image, function):
    """The functions in the constant table through which `function` calls."""
    names = POINTER_TABLES.get(function.name)
    if names is None:
        raise ImageError(f"{function.name} calls through a pointer; name the constant table that holds its targets in"
                         " linker/bounds/frames.py")
    words = []
    for name in names.split() if "*" not in names else sorted(fnmatch.filter(image.objects, names)):
        if name not in image.objects:
            raise ImageError(f"{function.name} calls through the table {name}, which the image does not have")
        start, size = image.objects[name]
        if image.writable(start):
            raise ImageError(f"{function.name} calls through the table {name}, which is not constant")
        words += [image.word(at) for at in range(start, start + size, 4)]
    words = words[POINTER_COLUMNS.get(function.name, slice(None))]
    found = [image.at(word & ~1) for word in words if word & 1]
    targets = [f for f, word in zip(found, (w for w in words if w & 1)) if f is not None and f.start == word & ~1]
    if not targets:
        raise ImageError(f"the table {names} holds no function")
    return targets


def calls(image, function):
    """(depth at the call, called function) of every call and tail call that can be reached."""
    for address, depth in depths(function).items():
        instruction = function.code[address]
        outside = function.leaves_to(instruction)
        if instruction.flow in ("call pointer", "jump pointer"):
            yield from ((depth, target) for target in table_targets(image, function))
        elif instruction.flow == "call" or outside is not None:
            target = image.functions_at.get(outside if outside is not None else instruction.targets[0])
            if target is None:
                raise ImageError(f"{function.name} calls {instruction.operands}, which is no function's start")
            yield depth, target


def deepest(image, function, path=()):
    """(bytes, names of the chain) of the deepest stack below and including a function, calls inside it included."""
    if function.name in path:
        raise ImageError(f"recursion: {' -> '.join((*path[path.index(function.name):], function.name))}")
    if function.name not in image.deepest:
        best = own_frame(function), (function.name,)
        for depth, target in calls(image, function):
            below, chain = deepest(image, target, (*path, function.name))
            # of two equal chains the longer says more
            best = max(best, (depth + below, (function.name, *chain)), key=lambda found: (found[0], len(found[1])))
        image.deepest[function.name] = best
    return image.deepest[function.name]
