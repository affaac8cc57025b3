# SPDX-License-Identifier: MIT
"""The engine of `make mutants`: every kind of fault is what it says, the choice is reproducible, and the verdicts are right."""
import json
import os
import subprocess
import textwrap
from pathlib import Path

import pytest

from mutants import ladder, reach
from mutants.choose import Sources, sequence, shares
from mutants.ctext import NotUnderstood, regions, walk
from mutants.engine import Engine
from mutants.fault import KINDS, Fault
from mutants.faults_asm import asm_faults
from mutants.faults_c import c_faults, enum_neighbours
from mutants.ladder import Rung
from mutants.report import complaints, diff, load_reasons, room, table
from mutants.store import Store, fingerprint
from mutants.tree import Project, Tree, Trouble, digest

ROOT = Path(__file__).resolve().parents[2]

SAMPLE = textwrap.dedent("""\
    #include <stdbool.h>
    enum mode { MODE_OFF, MODE_SLOW, MODE_FAST };
    struct axis { volatile int count; enum mode mode; int i_d_ref, i_q_ref; };
    #define LIMIT 500u /* a remark with + and < */
    #define MASK  (1u << 3)
    static const int steps[] = {1, 200};
    extern int f(int a, int b); void g(void); bool h(int);
    int work(struct axis *x, const int *p)
    {
        int sum = -x->i_d_ref + *p * 3; // a - b
        g();
        sum = f(sum, 7);
        x->count = sum & 0xF0u;
        if (sum >= 20 && x->mode == MODE_SLOW) {
            return 4;
        }
        for (int i = 0; i < 9; i++) {
            sum += steps[i & 1] << 2;
        }
        switch (x->mode) {
        case MODE_FAST:
            g();
            break;
        default:
            break;
        }
        while (!h(sum) && (unsigned)sum < LIMIT) {
            sum -= MASK;
        }
        if (h(x->i_q_ref)) {
            x->mode = MODE_OFF;
        } else {
            x->count++;
        }
        return h(sum) ? ~sum : true;
    }
    """)
C_EXPECTED = {
    "sign": ["int sum = x->i_d_ref + *p * 3;", "int sum = -x->i_d_ref - *p * 3;", "sum -= steps[i & 1] << 2;", "x->count--;"],
    "operator": ["int sum = -x->i_d_ref + *p / 3;", "x->count = sum | 0xF0u;", "sum += steps[i & 1] >> 2;",
                 "return h(sum) ? sum : true;"],
    "constant": ["#define LIMIT 1000u", "#define LIMIT 250u", "x->count = sum & 0xE0u;", "static const int steps[] = {1, 400};",
                 "if (sum >= 40 && x->mode == MODE_SLOW) {"],
    "off by one": ["sum = f(sum, 8);", "for (int i = 0; i <= 9; i++) {", "if (sum > 20 && x->mode == MODE_SLOW) {",
                   "#define MASK (1u << 4)", "return 3;"],
    "condition": ["if (sum < 20 && x->mode == MODE_SLOW) {", "if (sum >= 20 || x->mode == MODE_SLOW) {",
                  "if (!(h(x->i_q_ref))) {", "while (h(sum) && (unsigned)sum < LIMIT) {", "if (true) {"],
    "dropped statement": [";", "x->mode = MODE_OFF; => ;"],
    "dropped check": ["if (false) {"],
    "order": ["x->count = sum & 0xF0u; sum = f(sum, 7);"],
    "arguments": ["sum = f(7, sum);"],
    "operand": ["int sum = -x->i_q_ref + *p * 3;", "if (h(x->i_d_ref)) {"],
    "state": ["case MODE_SLOW:", "x->mode = MODE_SLOW;", "return h(sum) ? ~sum : false;"],
    "volatile": ["struct axis { int count; enum mode mode; int i_d_ref, i_q_ref; };"],
}

ASSEMBLY = textwrap.dedent("""\
    /* a remark: add r0, r0, #1 */
            .equ    ROOM, 32
            .type   work, %function
    work:
            push    {r4, lr}
            ldr     r0, [r1, #AXIS_D]       @ first
            ldr     r2, [r1, #AXIS_Q]
            sub     r0, r0, r2, asr #3
            subs    r3, r2, r0
            cmp     r0, r3
            itt     gt
            movgt   r1, r0
            andgt   r4, r4, r4, asr #31
            blo     work
            pop     {r4, pc}
    """)
ASM_EXPECTED = {
    "dropped statement": ["cmp r0, r3 => "],
    "constant": [".equ ROOM, 64"],
    "operand": ["ldr r0, [r1, #AXIS_Q]"],
    "operator": ["add r0, r0, r2, asr #3", "sub r0, r0, r2, lsr #3"],
    "off by one": ["sub r0, r0, r2, asr #4", "itt ge movge r1, r0 andge r4, r4, r4, asr #31", "bls work"],
    "condition": ["itt le movle r1, r0 andle r4, r4, r4, asr #31", "bhs work"],
    "arguments": ["subs r3, r0, r2", "cmp r3, r0"],
    "order": ["subs r3, r2, r0 sub r0, r0, r2, asr #3"],
}


def said(faults, kind):
    return {text for f in faults if f.kind == kind for text in (f.replacement, f"{f.original} => {f.replacement}")}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_fault_in_c(kind):
    faults = c_faults("a.c", SAMPLE, enums=enum_neighbours({"a.c": SAMPLE}))
    assert set(C_EXPECTED[kind]) <= said(faults, kind), said(faults, kind)
    assert all(f.applied(SAMPLE).count("\n") == SAMPLE.count("\n") for f in faults)


@pytest.mark.parametrize("kind", ASM_EXPECTED)
def test_every_kind_of_fault_in_assembly(kind):
    faults = asm_faults("a.S", ASSEMBLY)
    assert set(ASM_EXPECTED[kind]) <= said(faults, kind), said(faults, kind)
    assert {f.function for f in faults} == {"work", "ROOM"}


def test_remarks_includes_declarations_and_types_have_no_faults():
    lines = {f.line for f in c_faults("a.c", SAMPLE)}
    assert not lines & {1, 2, 7, 8}
    assert not any("remark" in f.original + f.replacement for f in c_faults("a.c", SAMPLE))
    assert not any(f.line == 1 for f in asm_faults("a.S", ASSEMBLY))


def test_statements_are_found_whatever_is_nested():
    text = "void f(void)\n{\n    if (a)\n        do {\n            x = (int[]){1, 2}[0];\n        } while (b);\n    else\n"
    kinds = [statement.kind for statement in walk(regions(text + "        c();\n}\n")[0].body)]
    assert kinds == ["block", "if", "do", "block", "expression", "expression"]
    with pytest.raises(NotUnderstood, match="a.c"):
        regions("void f(void)\n{\n    int x = 1\n}\n", "a.c")


@pytest.fixture(scope="module")
def sources():
    return Sources(ROOT)


def test_every_file_of_the_drive_is_understood(sources):
    assert len(sources.texts) > 40
    identities = [fault.identity for faults in sources.faults.values() for fault in faults]
    assert len(set(identities)) == len(identities) > 3000
    assert {fault.kind for faults in sources.faults.values() for fault in faults} == set(KINDS)
    for name, faults in sources.faults.items():
        text = sources.texts[name]
        assert all(f.applied(text) != text and f.applied(text).count("\n") == text.count("\n") for f in faults[::7])


def test_every_explained_survivor_is_a_fault_that_there_is(sources):
    present = {fault.identity for faults in sources.faults.values() for fault in faults}
    assert not set(load_reasons(ROOT / "tests" / "mutants" / "equivalent.toml")) - present


def test_the_choice_is_the_seeds_and_outlives_other_lines():
    def order(seed, text=SAMPLE):
        return [f.identity for f in sequence(c_faults("a.c", text), seed, "a.c")]
    assert order("1") == order("1") and sorted(order("1")) == sorted(order("2")) and order("1") != order("2")
    assert order("1", "\n/* more */\n" + SAMPLE) == order("1")
    first = list(sequence(c_faults("a.c", SAMPLE), "1", "a.c"))[:8]
    assert len({f.line for f in first}) == 8 and len({f.kind for f in first}) >= 7


@pytest.mark.parametrize("count", (1, 12, 150, 500))
def test_so_many_are_drawn_and_of_each_room_its_part(count, sources):
    weights = {name: sources.weights[name] for name, faults in sources.faults.items() if faults}
    drawn = [shares(weights, count, seed) for seed in map(str, range(30))]
    rooms = {room(name) for name in weights}
    for given in drawn:
        assert sum(given.values()) == count and min(given.values()) > 0
        for one in rooms:
            part = count * sum(weight for name, weight in weights.items() if room(name) == one) / sum(weights.values())
            assert abs(sum(number for name, number in given.items() if room(name) == one) - part) < 1 + 1e-9, one
    assert len({name for given in drawn for name in given}) > min(20, count), "every seed draws others"
    assert drawn[1] == shares(weights, count, "1")


# ---- the engine on a small project of its own ----

LEVEL = textwrap.dedent("""\
    #define UNSEEN 12345
    int seen(int level)
    {
        int sum = 0;
        for (int n = 0; n < level; n++) {
            sum += n;
        }
        return sum;
    }
    int unseen(int level)
    {
        return level + UNSEEN;
    }
    """)
SEEN_TEST = textwrap.dedent("""\
    import ctypes
    from pathlib import Path

    def test_seen():
        assert ctypes.CDLL(str(Path("build/level.so").resolve())).seen(5) == 10
    """)
MAKEFILE = textwrap.dedent("""\
    build/level.so: build/obj/level.o
    \tcc -shared $< -o $@
    build/obj/level.o: firmware/level.c
    \t@mkdir -p build/obj
    \tcc -O1 -g -fPIC -c $< -o $@
    """)


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A project with one file, one test, and a folder for the engine."""
    monkeypatch.setattr(ladder, "CPU_MORE_S", 1.0)
    root = tmp_path / "project"
    for name, text in {"firmware/level.c": LEVEL, "tests/test_seen.py": SEEN_TEST, "Makefile": MAKEFILE}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root, tmp_path / "work"


def project(root):
    return Project(root, ("make", "-s"), ("build/level.so",), ("build/obj/*.o",), ("build/level.so",), "objcopy")


def judge(root, work, count, keep=lambda fault: True, **more):
    """Runs the engine with one worker on the faults that `keep` takes: {replacement: outcome}, and what it said."""
    sources, heard = Sources(root, rooms=("firmware",), also=()), []
    for name in sources.faults:
        sources.faults[name] = [fault for fault in sources.faults[name] if keep(fault)]
    work.mkdir(exist_ok=True)
    store = Store(work / "results.jsonl", root, {name: digest(text) for name, text in sources.texts.items()},
                  fingerprint(root, ("firmware", "tests")))
    rungs = [Rung("unit", ("tests",), product="build/level.so")]
    engine = Engine(sources, [Tree(project(root), work / "w0")], rungs, store, "1", heard.append, **more)
    judged = engine.run(count, list(sources.faults))
    outcomes = {f.replacement: entry["outcome"] for f, entry in [*judged.values(), *engine.tried.values()]}
    return outcomes, heard, judged, sources


def test_what_matters_is_noticed_and_what_does_not_is_not(small):
    wanted = {"sum -= n;": "noticed", "for (int n = 0; n < level; n--) {": "noticed",
              "for (int n = 1; n < level; n++) {": "survived", "return level - UNSEEN;": "survived"}
    outcomes, heard, judged, sources = judge(*small, 4, lambda fault: fault.replacement in wanted)
    assert outcomes == wanted
    assert any("noticed firmware/level.c:6 sign by tests/test_seen.py::test_seen" in line for line in heard)
    found = list(complaints(judged, {}, sources))
    assert len(found) == 3 and found[0] == "2 of 4 noticed, at least 95 % are asked for" and "nothing notices" in found[1]
    rows = list(table("kind", [(f.kind, entry["outcome"], entry["rung"]) for f, entry in judged.values()]))
    assert [line.split() for line in (rows[0], rows[-1])] == [["kind", "mutants", "noticed", "unit"],
                                                              ["all", "4", "2", "50", "%", "2"]]
    one = next(fault for fault, entry in judged.values() if fault.kind == "sign" and entry["outcome"] == "noticed")
    assert "-        sum += n;\n+        sum -= n;" in diff(one, LEVEL)
    assert (small[1] / "w0" / "tree" / "firmware" / "level.c").read_text() == LEVEL


def test_a_listed_one_is_a_survivor_without_a_trial(small):
    def kept(fault):
        return fault.replacement == "sum -= n;"

    _, _, judged, _ = judge(*small, 1, kept)
    (identity,) = judged
    outcomes, heard, judged, sources = judge(small[0], small[1] / "listed", 1, kept, listed=frozenset([identity]))
    assert outcomes == {"sum -= n;": "survived"} and any("as listed" in line for line in heard)
    assert not any("take it out" in line for line in complaints(judged, {identity: "because"}, sources))


def test_a_mutant_that_does_not_build_or_is_the_same_code_does_not_count(small):
    root, work = small
    more = "int unused = 7;\n    unused = 8;\n    return sum;"
    (root / "firmware" / "level.c").write_text(LEVEL.replace("return sum;", more))
    outcomes, _, judged, _ = judge(root, work, 2, lambda fault: fault.replacement in (
        "int unused = 8;", "int unused = 6;", "sum -= n;", "return level / UNSEEN;", ";") and "return" not in fault.original)
    assert outcomes["int unused = 8;"] == "same code" and len(judged) == 2
    assert {entry["outcome"] for _, entry in judged.values()} == {"noticed"}


def test_a_mutant_that_does_not_end_is_stopped_and_noticed(small):
    root, work = small
    (root / "firmware" / "level.c").write_text(LEVEL.replace("int sum = 0;", (
        "int sum = 0;\n    volatile int rest = 3;\n    while (rest > 0) {\n        rest--;\n    }")))
    outcomes, _, judged, _ = judge(root, work, 1, lambda fault: fault.original == "rest--;" and fault.replacement == ";")
    [(_, entry)] = judged.values()
    assert entry["outcome"] == "noticed" and entry["how"].startswith("did not end")


def test_what_is_known_is_not_done_again_and_what_has_changed_is(small, monkeypatch):
    root, work = small
    signs = {"sum -= n;", "return level - UNSEEN;"}
    first, heard, *_ = judge(root, work, 2, lambda fault: fault.replacement in signs)
    with open(work / "results.jsonl", "a") as out:
        out.write('{"identity": "cut o')
    with monkeypatch.context() as patch:
        patch.setattr(Tree, "run", lambda *_: pytest.fail("nothing was left to do"))
        again, heard, *_ = judge(root, work, 2, lambda fault: fault.replacement in signs)
    assert again == first and all("as before" in line for line in heard)

    (root / "tests" / "test_more.py").write_text(SEEN_TEST.replace("seen(5) == 10", "unseen(1) == 12346"))
    now, heard, *_ = judge(root, work, 2, lambda fault: fault.replacement in signs)
    assert now == {replacement: "noticed" for replacement in signs}
    assert ["as before" in line for line in heard if "/2" in line].count(True) == 1


def test_what_an_interrupted_run_left_is_no_base_for_the_next(small):
    root, work = small
    faults = c_faults("firmware/level.c", LEVEL)
    fault = next(fault for fault in faults if fault.replacement == "sum -= n;")
    tree = Tree(project(root), work / "w0")
    tree.prepare()
    tree.keep()
    right = tree.products
    assert tree.insert(fault, LEVEL) == "" and tree.changed_products() == {"build/level.so"}
    again = Tree(project(root), work / "w0")
    again.prepare()
    again.keep()
    assert again.products == right and (again.root / fault.file).read_text() == LEVEL


def compiled(folder, name, text):
    (folder / f"{name}.c").write_text(text)
    subprocess.run(["cc", "-O1", "-ffunction-sections", "-c", f"{name}.c", "-o", f"{name}.o"], cwd=folder, check=True)
    return folder / f"{name}.o"


@pytest.mark.parametrize("fault, changed", [
    (("sum += n", "sum -= n"), {"seen"}), (("int unseen", "int other"), {"unseen"}), (("12345", "12346"), {"unseen"}),
    (("sum += n", "sum += n + 0"), set()), (("fixed = 7", "fixed = 8"), None), (("level;", "level + seen(2);"), {"seen"})])
def test_which_functions_a_fault_changes(tmp_path, fault, changed):
    text = LEVEL + "const int fixed = 7;\n"
    was, now = compiled(tmp_path, "was", text), compiled(tmp_path, "now", text.replace(*fault))
    assert reach.changed_functions([(was, was), (was, now)]) == changed


class Known(reach.Functions):
    def __init__(self, *places):
        self.places = places


def bits(*addresses):
    number = sum(1 << reach._place(address) for address in addresses)
    return number.to_bytes(1 << 17, "little")


def test_a_test_executes_what_the_twin_saw_or_what_its_files_others_do():
    """By the functions of the image that it runs: the same place is something else in another one."""
    known = Known(("low", 0x100, 8), ("next", 0x108, 6), ("high", 0x20000100, 4))
    assert known.executed(bits(0x106)) == {"low"} and known.executed(bits(0x108, 0x20000102)) == {"next", "high"}
    names = ("a.py::one", "a.py::two", "a.py::three", "b.py::four")
    tests = [ladder.Test(name, Rung("image", (), product="elf")) for name in names]
    others = [ladder.Test(f"c.py::image[{name}]", Rung("target", (), product="[].elf")) for name in ("first", "second")]
    images = {"elf": known, "first.elf": Known(("mine", 0x100, 4)), "second.elf": Known(("yours", 0x100, 4))}
    of_others = reach.of_tests(images.get, others, {test.name: bits(0x100) for test in others})
    assert of_others == {"c.py::image[first]": {"mine"}, "c.py::image[second]": {"yours"}}
    found = reach.of_tests(images.get, tests, {"a.py::one": bits(0x100), "a.py::two": bits(0x108)})
    assert found == {"a.py::one": {"low"}, "a.py::two": {"next"}, "a.py::three": {"low", "next"}}
    asked = [ladder.Test(t.name, Rung("image", (), product="elf"), executes=found.get(t.name)) for t in tests]
    assert [t.name for t in ladder.concerned(asked, {"elf"}, {"next"})] == ["a.py::two", "a.py::three", "b.py::four"]
    assert ladder.concerned(asked, {"elf"}, None) == asked and ladder.concerned(asked, set(), {"next"}) == []


def test_a_unit_test_enters_what_it_calls_and_what_its_fixtures_called(tmp_path):
    """Through the plugin, pytest, the real library: read back as the engine does."""
    (tmp_path / "reach").mkdir()
    (tmp_path / "test_two.py").write_text(textwrap.dedent("""\
        import pytest
        from unit.conftest import c

        @pytest.fixture(scope="module")
        def root(c):
            return c.identify_root(49)

        def test_one(c, root):
            assert c.scale(6, 3, 2) == 9

        def test_two(root):
            assert root == 7

        def test_three(c):
            assert c.crc16(None, 0) == 0xFFFF
        """))
    names = [f"test_two.py::test_{name}" for name in ("one", "two", "three")]
    (tmp_path / "plan.json").write_text(json.dumps([[name, 0] for name in names]))
    told = {"MUTANTS_PLAN": f"{tmp_path}/plan.json", "MUTANTS_LOG": f"{tmp_path}/log", "MUTANTS_REACH": f"{tmp_path}/reach",
            "PYTHONPATH": f"{ROOT}/tests"}
    command = ladder.pytest_command([f"{tmp_path}/test_two.py"], tmp_path / "tmp", "-p", "mutants.watch")
    command[command.index("--rootdir=.")] = f"--rootdir={tmp_path}"
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **told}, capture_output=True, text=True)
    assert done.returncode == 0 and "3 passed" in done.stdout, done.stdout
    tests = [ladder.Test(name, Rung("unit", ())) for name in names]
    entered = reach.Entered()
    entered.take(Path(os.environ["BUILD"]).resolve().parent, tmp_path / "reach", tests)
    one, two, three = (entered.of(test) for test in tests)
    assert "scale" in one and "scale" not in two | three and "crc16" in three and "crc16" not in one | two
    assert all("identify_root" in each for each in (one, two, three)), "the fixture is the file's"
    assert entered.of(ladder.Test("test_other.py::test_four", Rung("unit", ()))) is None


def test_a_unit_test_is_asked_if_it_enters_what_the_fault_is_in():
    def fault(file, function):
        return Fault(file, function, "sign", 1, "a", "b", ())
    known = {"scale", "crc16", "wide"}
    assert reach.entered_by(fault("a.c", "scale"), {"wide"}, known) == {"scale"}
    assert reach.entered_by(fault("a.c", "LIMIT"), {"wide", "unknown"}, known) == {"wide"}, "a number: by what changes"
    assert reach.entered_by(fault("a.h", "LIMIT"), {"wide"}, known) is None, "whoever includes it may be inlined elsewhere"
    assert reach.entered_by(fault("a.c", "LIMIT"), None, known) is None
    assert reach.entered_by(fault("a.c", "LIMIT"), {"unknown"}, known) is None
    tests = [ladder.Test(name, Rung("unit", ()), 1.0, enters=enters)
             for name, enters in (("a", {"scale"}), ("b", {"crc16"}), ("c", None))]
    assert [t.name for t in ladder.concerned(tests, set(), None, {"scale"})] == ["a", "c"]
    assert ladder.concerned(tests, set(), None, None) == tests


def test_who_noticed_before_is_asked_first_and_time_that_runs_out_is_a_survivor(small):
    root, work = small
    blind = SEEN_TEST.replace("seen(5) == 10", "unseen(1) > 0").replace("test_seen", "test_a")
    (root / "tests" / "test_a.py").write_text(blind)

    def kept(fault):
        return fault.replacement == "sum -= n;"

    identity = next(f.identity for f in c_faults("firmware/level.c", LEVEL) if kept(f))
    _, _, judged, _ = judge(root, work, 1, kept, hints={identity: "tests/test_a.py::test_a"})
    entry = judged[identity][1]
    assert entry["asked"] == ["tests/test_a.py::test_a", "tests/test_seen.py::test_seen"] and entry["by"] == entry["asked"][1]
    _, _, judged, _ = judge(root, work.with_name("hinted"), 1, kept, hints={identity: entry["by"]})
    assert judged[identity][1]["asked"] == ["tests/test_seen.py::test_seen"]
    _, _, judged, _ = judge(root, work.with_name("poor"), 1, kept, budget_s=1e-6)
    assert judged[identity][1]["outcome"] == "survived" and "2 tests were not asked" in judged[identity][1]["how"]


def test_a_test_that_comes_first_may_take_what_its_files_fixtures_take(small, monkeypatch):
    """Another one has paid for them on the tree as it is: asked alone, it would be stopped, and that taken for a verdict."""
    root, work = small
    monkeypatch.setattr(ladder, "CPU_MORE_S", 0.1)
    (root / "tests" / "test_seen.py").write_text(textwrap.dedent("""\
        import subprocess, sys
        import pytest

        @pytest.fixture(scope="module")
        def long():
            burn = "import time; [0 for _ in iter(lambda: time.process_time() < 1.5, False)]"
            subprocess.run([sys.executable, "-c", burn], check=True)

        def test_first(long):
            pass

        def test_second(long):
            pass
        """))
    identity = next(f.identity for f in c_faults("firmware/level.c", LEVEL) if f.replacement == "sum -= n;")
    _, _, judged, _ = judge(root, work, 1, lambda fault: fault.identity == identity,
                            hints={identity: "tests/test_seen.py::test_second"})
    entry = judged[identity][1]
    assert entry["outcome"] == "survived" and entry["asked"][0] == "tests/test_seen.py::test_second"
    assert entry["cpu_s"] > 1.5


def test_time_counts_what_a_file_shares_once():
    one, two = (ladder.Test(f"a.py::{name}", Rung("unit", ()), 1.0, shared_s=5.0) for name in ("one", "two"))
    other = ladder.Test("b.py::three", Rung("unit", ()), 1.0, shared_s=5.0)
    assert ladder.affordable([one, two, other], 12.9) == [one, two] and ladder.affordable([one, two], 6.9) == [one]
    assert ladder.affordable([one, two, other], 13.0) == [one, two, other]


def test_a_tree_that_fails_as_it_is_is_no_base_for_verdicts(small):
    root, work = small
    (root / "tests" / "test_seen.py").write_text(SEEN_TEST.replace("10", "11"))
    with pytest.raises(Trouble, match="does not pass tests/test_seen.py::test_seen"):
        judge(root, work, 1)
    (root / "firmware" / "level.c").write_text("int seen(int level)\n{\n    return 1 + nothing;\n}\n")
    with pytest.raises(Trouble, match="does not build"):
        judge(root, work, 1)


def test_what_fails_without_a_fault_can_be_left_out_and_is_named(small):
    root, work = small
    (root / "tests" / "test_more.py").write_text(SEEN_TEST.replace("10", "11").replace("test_seen", "test_broken"))
    outcomes, heard, *_ = judge(root, work, 1, lambda fault: fault.replacement == "sum -= n;", keep_going=True)
    assert outcomes == {"sum -= n;": "noticed"}
    assert "left out: tests/test_more.py::test_broken fails without any fault" in heard


def test_stale_and_unreasoned_entries_are_complained_of(small, tmp_path):
    *_, judged, sources = judge(*small, 1, lambda fault: fault.replacement == "sum -= n;")
    noticed = next(iter(judged))
    found = list(complaints(judged, {noticed: "a reason", "firmware/gone.c|f|a|b|1": "a reason"}, sources))
    assert len(found) == 2 and "is noticed now" in found[0] and "no such fault any more" in found[1]
    (tmp_path / "e.toml").write_text('[[mutant]]\nfile = "a"\nfunction = "f"\noriginal = "x"\nreplacement = "y"\nreason = ""\n')
    with pytest.raises(ValueError, match="without reason"):
        load_reasons(tmp_path / "e.toml")
