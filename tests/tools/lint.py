# SPDX-License-Identifier: MIT
"""The house rules that no compiler checks: formatting, layers, and what must not stand in code for the target.

Warnings are the compiler's business: every build has -Wall ... -Werror. Prints one line a finding, exits 1 if there is any.
The tests hold what rules() finds; how code is laid out keeps nobody from them, and is judged here alone.
"""
import ast
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import arrows

ROOT = Path(__file__).resolve().parents[2]
TARGET_ROOMS = ("firmware", "drivers", "lib", "startup")
# who may include whom: only downwards, and lib nobody but itself
ALLOWED = {
    "firmware": {"firmware", "drivers", "lib", "startup"},
    "drivers": {"drivers", "lib", "startup"},
    "lib": {"lib"},
    "startup": {"startup"},
}
# the firmware's rooms from the bottom up: each may include itself and those before it; main.c stands on top of all
FIRMWARE_ROOMS = arrows.ROOMS[:-1]
# data only: what the rooms above control share, each part declared by the room that writes it
SHARED_STATE = "firmware/axis/axis.h"
# whoever may name a particular axis: main and the interrupts' handlers
NAME_AXES = {"firmware/main.c", "firmware/system/axes.c", "firmware/system/handlers.c"}
# who may keep state between calls: where an interrupt, a reset or the core itself enters; tests/image names each variable
KEEP_STATE = {"firmware/main.c", "firmware/system/boot.c", "drivers/bringup/main.c"}
# by `make registers` into build/fabric/, by tests/bringup into build/bringup/, by firmware/tables/ into build/packed/
GENERATED = ("contract3.h", "documented.h", "data_sheet_text.h", "message_texts.h")
SYSTEM_HEADERS = {"<stdint.h>", "<stddef.h>", "<stdbool.h>", "<limits.h>", "<stdarg.h>"}
WIDTH = 128
FILE_LINES, FUNCTION_LINES = 700, 60  # of programs: a file has one idea, a function fits a screen
CODE = (".c", ".cpp", ".h", ".S", ".py", ".sh", ".ld", ".mk", ".v", ".vh")

FORBIDDEN_ON_TARGET = (
    (re.compile(r"\b(float|double)\b"), "floating point"),
    (re.compile(r"\b(malloc|calloc|realloc|free)\s*\("), "heap"),
    (re.compile(r"qemu|semihost|emulat|\bbkpt\b", re.I), "a word about where it runs"),
)
REGISTER_ADDRESS = re.compile(r"0x(4[0-9A-F]{7}|5000[0-9A-F]{4}|E00[0-9A-F]{5})\b", re.I)
# start-up reads the reset cause and sets two core registers before any driver can run
ADDRESS_EXCEPTIONS = {"startup/reset.S"}


def tracked():
    names = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True,
                           check=True).stdout.split("\n")
    return [Path(name) for name in names if name and (ROOT / name).is_file()]


def without_comments(text):
    """Same line count, comments and strings of prose blanked, so that words in comments do not count."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))
    return re.sub(r"/\*.*?\*/|//[^\n]*", blank, text, flags=re.S)


def check_text(path, text):
    first = text.split("\n", 2)[:2]
    if not any("SPDX-License-Identifier" in line for line in first):
        yield 1, "no SPDX licence line at the top"
    if text and not text.endswith("\n"):
        yield text.count("\n") + 1, "no line end at the end of the file"
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > WIDTH:
            yield number, f"{len(line)} columns, at most {WIDTH}"
        if line != line.rstrip():
            yield number, "blanks at the end of the line"
        if "\t" in line and path.suffix != ".mk":
            yield number, "a tab"


def check_includes(path, text):
    room = path.parts[0]
    for number, line in enumerate(text.split("\n"), 1):
        match = re.match(r'\s*#\s*include\s+(<[^>]+>|"([^"]+)")', line)
        if not match:
            continue
        if match.group(1).startswith("<"):
            if match.group(1) not in SYSTEM_HEADERS:
                yield number, f"{match.group(1)} is not one of the freestanding headers"
        elif "/" not in match.group(2):  # beside the file itself
            if match.group(2) not in GENERATED and not (ROOT / path.parent / match.group(2)).is_file():
                yield number, f"{match.group(2)} is not in {room}/"
        elif match.group(2).split("/")[0] not in ALLOWED[room]:
            yield number, f"include of {match.group(2)} points up from {room}/"
        elif room == "firmware" and level(match.group(2)) > level(str(path)) and str(path) != SHARED_STATE:
            yield number, f"include of {match.group(2)} points up from {path.parent}/"
        elif match.group(2) == "firmware/system/handlers.h" and str(path) not in NAME_AXES:
            yield number, "only main and the interrupts' handlers name a particular axis"


def level(name):
    """How high a file of firmware/ stands; below it, everything of the other folders."""
    parts = name.split("/")
    if parts[0] != "firmware":
        return -1
    return FIRMWARE_ROOMS.index(parts[1]) if len(parts) > 2 else len(FIRMWARE_ROOMS)


def check_circles(texts):
    """Headers that include each other, directly or not: {path: text} of the target's files."""
    edges = {name: re.findall(r'^\s*#\s*include\s+"([^"]+)"', text, re.M) for name, text in texts.items()}
    done, path = set(), []

    def walk(name):
        if name in path:
            yield Path(name), 1, "includes itself by way of " + " -> ".join(path[path.index(name) + 1:] + [name])
        elif name not in done:
            path.append(name)
            for other in edges.get(name, []):
                yield from walk(other)
            path.pop()
            done.add(name)
    for name in sorted(edges):
        yield from walk(name)


def check_target_code(path, text):
    code = without_comments(text)
    for number, line in enumerate(code.split("\n"), 1):
        for pattern, what in FORBIDDEN_ON_TARGET:
            if pattern.search(line):
                yield number, f"{what} in code for the target"
        if path.parts[0] != "drivers" and str(path) not in ADDRESS_EXCEPTIONS and REGISTER_ADDRESS.search(line):
            yield number, "a register address outside drivers/"


STATIC_VARIABLE = re.compile(r"^\s*static (?!inline\b)(?!.*\bconst\b)[^(]*$")


def check_state(path, text):
    for number, line in enumerate(without_comments(text).split("\n"), 1):
        if STATIC_VARIABLE.match(line) and str(path) not in KEEP_STATE:
            yield number, "a static variable: pass state on, in struct axis or a structure of its own"


# structures within the loop's, and who writes them beside its own files
LOOP_PARTS = {"firmware/control/observer.c": "flux", "firmware/control/injection.c": "flux|inject",
              "firmware/control/weakening.c": "weaken", "firmware/control/bridge.h": "locked_out"}
LOOP_NAMED = re.compile(r"\bstruct current_loop (?:volatile )?\*(?:const |restrict )*(\w+)")
LOOP_BARE = re.compile(r"(?<!volatile )struct current_loop \*")
LOOP_ITSELF = re.compile(r"firmware/control/(?:current_loop|stage_)\w*\.[ch]")


def loop_accesses(code, names, own):
    """(place, what is wrong) of each write of a field, each pointer to one: of the loop that pointers of these names have."""
    any_of = "|".join(sorted(names))
    loop = rf"(?:\b(?:{any_of})->|\(\*(?:{any_of})\)\.|\bloop\.|(?<!\w)\(&[\w.>\[\]-]*\bloop\)->)"
    field = rf"{loop}(?!(?:{own})\b)(?P<field>[a-z]\w*)(?:\.\w+|\[[^\]]*\])*"
    before = r"\(*(?:[\w\[\]]+(?:->|\.))*?"
    changed = r"(?:(?:[-+*/%|&^]|<<|>>)?=(?!=)|\+\+|--)"
    for pattern, what in ((rf"{field}\)*\s*{changed}", "is written"), (rf"(?:\+\+|--){before}{field}", "is written"),
                          (rf"(?<!&)&(?!&){before}{field}", "has a pointer to it"),
                          (rf"(?<!\w )\*(?P<field>{any_of})\s*=(?!=)", "is written as a whole")):
        for match in re.finditer(pattern, code):
            yield match.start("field"), f"{match['field']} {what}"


def check_doors(path, text):
    """The interrupt's memory: current_loop.h says what it is asked for, and how. `loop` is one wherever it stands, other names
    in the function that declares them: `c` is much else, too."""
    if LOOP_ITSELF.fullmatch(str(path)):
        return
    code = without_comments(text)
    lines = code.split("\n")
    found = set()
    bodies = [(first, "\n".join(lines[first - 1:last])) for _, _, first, last in functions(text)]
    for first, part, names in [(1, code, []), *((first, body, LOOP_NAMED.findall(body)) for first, body in bodies)]:
        found |= {(first + part.count("\n", 0, at), what)
                  for at, what in loop_accesses(part, {"loop", *names}, LOOP_PARTS.get(str(path), "-"))}
    for number, what in sorted(found):
        yield number, f"{what} beside the doors of firmware/control/current_loop.h"
    for number, line in enumerate(lines, 1):
        if LOOP_BARE.search(line):
            yield number, "a pointer to the interrupt's memory that is not volatile"


def functions(text):
    """(name, is static, first line, last line) of each function that a file of C defines, as clang-format lays it out."""
    lines = without_comments(text).split("\n")
    for opened in (n for n, line in enumerate(lines) if line == "{"):
        first = opened
        while first > 0 and re.match(r"[\w ]", lines[first - 1]) and lines[first - 1].strip():
            first -= 1
        signature = " ".join(lines[first:opened])
        named = re.match(r"[^(]*?\(?\*?(\w+)\(", re.sub(r"__attribute__\(\([^)]*\)\)\s*", "", signature))
        closed = next((n for n in range(opened, len(lines)) if lines[n] == "}"), None)
        if named and closed is not None:
            yield named.group(1), signature.startswith("static "), first + 1, closed + 1


def check_sizes(path, text):
    lines = text.count("\n")
    if lines > FILE_LINES:
        yield 1, f"{lines} lines, at most {FILE_LINES}"
    for name, _, first, last in functions(text):
        if last - first + 1 > FUNCTION_LINES:
            yield first, f"{name}() has {last - first + 1} lines, at most {FUNCTION_LINES}"


def shared_statics(texts):
    """{name: [files]} of static functions defined in more than one file."""
    found = {}
    for path, text in texts.items():
        for name, static, _, _ in functions(text):
            if static:
                found.setdefault(name, []).append(path)
    return {name: files for name, files in sorted(found.items()) if len(files) > 1}


def firmware_texts():
    return {str(path): (ROOT / path).read_text(encoding="utf-8") for path in tracked()
            if path.parts[0] == "firmware" and path.suffix in (".c", ".h")}


FORMATTER = ROOT / ".ci" / "clang-format"  # one version for all


def check_format(paths, folder=ROOT):
    result = subprocess.run([FORMATTER, "--dry-run", "-Werror", "--style=file", *map(str, paths)], cwd=folder,
                            capture_output=True, text=True)
    places = re.findall(r"^([^:\n]+):(\d+):\d+: error: ", result.stderr, re.M)
    for name, number in places:
        yield Path(name), int(number), "not as clang-format would have it"
    if result.returncode and not places:
        yield Path(".clang-format"), 1, result.stderr.strip().split("\n")[-1] or "clang-format failed"


def check_guide():
    """What docs/guides/adding.md adds, where it adds it."""
    sys.path.insert(0, str(ROOT / "tests"))
    from guides import edits
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        edits.copied(folder, [edit.path for edit in edits.edits()] + [".clang-format"])
        guide = edits.GUIDE.relative_to(ROOT)
        try:
            code = [path for path in edits.apply(folder) if path.endswith((".c", ".h"))]
        except AssertionError as error:
            yield guide, 1, str(error)
            return
        for path, number, what in check_format(code, folder):
            yield guide, 1, f"what it makes of {path}:{number} is {what}"


def check_members(folders=(*TARGET_ROOMS, "qemu/twin"), folder=ROOT):
    """Of structures that one file has for itself. All else that cppcheck says here is about what it cannot see."""
    result = subprocess.run(["cppcheck", "--enable=style", "--max-configs=1", "--std=c11", "-q",
                             "--template={file}:{line}: {message} [{id}]", *folders], cwd=folder, capture_output=True,
                            text=True)
    for name, number, what in re.findall(r"^(.*?):(\d+): (.*) \[unusedStructMember\]$", result.stderr, re.M):
        yield Path(name), int(number), what


def check_python(path, text):
    try:
        tree = ast.parse(text, str(path))
    except SyntaxError as error:
        yield 1, str(error).strip().split("\n")[-1]
        return
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, (ast.Import, ast.ImportFrom)) else []
        for name in [*names, getattr(node, "module", None) or ""] if names else []:
            if name.split(".")[-1].startswith("test_"):
                yield node.lineno, f"{name} is imported: what several tests need stands in tests/rigs"


def layout():
    files = tracked()
    for path in files:
        if path.suffix in CODE:
            for number, what in check_text(path, (ROOT / path).read_text(encoding="utf-8")):
                yield path, number, what
    yield from check_format([p for p in files if p.suffix in (".c", ".cpp", ".h")])
    yield from check_guide()
    yield from check_members()


def rules():
    files = tracked()
    for path in files:
        if path.suffix not in CODE:
            continue
        text = (ROOT / path).read_text(encoding="utf-8")
        checks = []
        if path.parts[0] in TARGET_ROOMS and path.suffix in (".c", ".h", ".S"):
            checks += [check_includes(path, text), check_target_code(path, text)]
        if path.parts[0] in TARGET_ROOMS and path.suffix == ".c":
            checks.append(check_state(path, text))
        if path.parts[0] == "firmware" or path.parts[:2] == ("drivers", "bringup"):
            checks += [check_sizes(path, text), check_doors(path, text)]
        if path.suffix == ".py":
            checks.append(check_python(path, text))
        for check in checks:
            for number, what in check:
                yield path, number, what
    yield from check_circles({str(path): (ROOT / path).read_text(encoding="utf-8") for path in files
                              if path.parts[0] in TARGET_ROOMS and path.suffix in (".c", ".h", ".S")})
    for name, paths in shared_statics(firmware_texts()).items():
        yield paths[0], 1, f"{name}() is static in {', '.join(paths)}: a backtrace tells only the name"


def main():
    count = 0
    for path, number, what in (*layout(), *rules()):
        print(f"{path}:{number}: {what}")
        count += 1
    if count:
        print(f"mssfoc: {count} findings; '.ci/clang-format -i FILE' fixes the formatting", file=sys.stderr)
        return 1
    print("lint: no findings")
    return 0


if __name__ == "__main__":
    sys.exit(main())
