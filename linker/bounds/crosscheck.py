# SPDX-License-Identifier: MIT
"""The image's frames and calls against what the compiler wrote down beside each object: .su and .ci files."""
import re
from pathlib import Path

from disasm import ImageError
from frames import depths, own_frame

ROOT = Path(__file__).resolve().parents[2]
POINTER = "__indirect_call"
# bytes of arguments that a variadic function saves from its registers: the compiler does not count them
VARIADIC = {"text_print": 12}


def _beside_objects(objects, suffix):
    """Tests and benchmarks are other images, with functions of the same names; what a folder built before its sources were
    moved or removed is nobody's."""
    places = [path.relative_to(objects) for path in Path(objects).rglob(f"*{suffix}")]
    return sorted(Path(objects) / place for place in places if "tests" not in place.parts
                  and (len(place.parts) == 1 or (ROOT / place).with_suffix(".c").is_file()))


def compiler_frames(objects):
    """{function: {bytes}} of the .su files; a name may be that of several static functions."""
    frames = {}
    for path in _beside_objects(objects, ".su"):
        for line in path.read_text().splitlines():
            place, size, kind = line.split("\t")
            name = place.split(":")[-1]
            if kind != "static":
                raise ImageError(f"{path}: the frame of {name} is {kind}, not static")
            frames.setdefault(name, set()).add(int(size))
    return frames


def compiler_calls(objects):
    """{function: {called names}} of the .ci files, after inlining; without the run-time's, whose calls it may still remove."""
    calls = {}
    for path in _beside_objects(objects, ".ci"):
        for source, target in re.findall(r'^edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', path.read_text(), re.M):
            if not target.startswith("__aeabi_"):
                calls.setdefault(source.split(":")[-1], set()).add(target.split(":")[-1])
    return calls


def image_calls(image, function):
    """Names that the instructions of a function call or jump to."""
    names = set()
    for address in depths(function):
        instruction, outside = function.code[address], function.leaves_to(function.code[address])
        if instruction.flow in ("call pointer", "jump pointer"):
            names.add(POINTER)
        elif instruction.flow == "call" or outside is not None:
            names.update(image.functions_at[outside if outside is not None else instruction.targets[0]].aliases)
    return names


def check_against_compiler(image, objects):
    """Number of functions that both know. A difference means that the instructions were misread: an error."""
    frames, calls, both = compiler_frames(objects), compiler_calls(objects), 0
    for function in image.functions_at.values():
        if function.name not in frames:
            continue
        both += 1
        if own_frame(function) - VARIADIC.get(function.name, 0) not in frames[function.name]:
            raise ImageError(f"{function.name}: {own_frame(function)} bytes of stack in the image,"
                             f" {sorted(frames[function.name])} by the compiler")
        missing = calls.get(function.name, set()) - image_calls(image, function)
        if missing:
            raise ImageError(f"{function.name} calls {', '.join(sorted(missing))} by the compiler, not in the image")
    return both
