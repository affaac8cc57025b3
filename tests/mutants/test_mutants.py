# SPDX-License-Identifier: MIT
"""The engine of `make mutants`: every kind of mistake is what it says, the choice is reproducible, the verdicts are right."""
import json
import subprocess
import textwrap
from collections import Counter
from pathlib import Path

import pytest

from mutants import assembly, by_hand, ladder, python, reach, report
from mutants.c import Parser
from mutants.choose import Sources, sequence, shares, with_all
from mutants.engine import Engine
from mutants.ladder import Rung
from mutants.mutant import KINDS
from mutants.report import FIELDS, complaints, lines, load_survivors, room, write_page
from mutants.store import Store
from mutants.tree import Project, Trouble, headed

ROOT = Path(__file__).resolve().parents[2]

SAMPLE = textwrap.dedent("""\
    #include <stdbool.h>
    #include <stdint.h>
    enum mode { MODE_NONE, MODE_SLOW, MODE_FAST };
    struct axis { volatile int count; enum mode mode; int i_d_ref, i_q_ref; int ring[3]; };
    #define PAUSE_MS 500 /* a remark with + and < */
    extern int f(int a, int b); void g(void); bool h(int); int q15_clamp(int x, int low, int high), q15_max(int, int);
    extern uint32_t cpu_irq_save(void); void cpu_irq_restore(uint32_t mask);
    _Static_assert(PAUSE_MS < 1000, "no mistake here");
    int work(struct axis *x, const int *p)
    {
        int sum = -x->i_d_ref + *p * 300; // a - b
        const uint32_t mask = cpu_irq_save();
        const int count = x->count;
        x->ring[0] = sum;
        x->count = count + 1;
        cpu_irq_restore(mask);
        g();
        sum = f(sum, count);
        if (sum >= 20 && x->mode == MODE_SLOW) {
            return 4 << 3;
        }
        if (sum < -7 || sum > PAUSE_MS) {
            sum = q15_clamp(sum, x->i_d_ref, 9);
        }
        for (int i = 0; i < 9; i++) {
            sum += i;
        }
        sum |= 8; sum |= q15_max(sum, 9); (void)p;
        x->mode = MODE_NONE;
        return h(sum) ? sum : true;
    }
    """)
SNAKE = textwrap.dedent('''\
    """Words < with + operators."""
    LIMIT = 3
    class Judge:
        def verdict(self, low, high, *, on=True):
            # no + mistake
            self.seen = 0
            self.count += 1
            print("a text", low)
            if low < 0 or self.seen:
                return False
            if 0 < high <= LIMIT:
                high = min(high, low) // 1 - 1
            return low * 1e3 if self.seen else max(low, high, -low)
    ''')
ASSEMBLY = textwrap.dedent("""\
    /* a remark: add r0, r0, #1 */
    work:
            ldr     r0, [r1, #AXIS_D]       @ first
            sub     r2, r0, r2, asr #3
            blo     work
    """)
EXPECTED = {
    "sign": ["int sum = x->i_d_ref + *p * 300;", "int sum = -x->i_d_ref - *p * 300;", "sum -= i;",
             "high = min(high, low) // 1 + 1", "add r2, r0, r2, asr #3"],
    "forgotten clear": ["x->mode = MODE_NONE; => ;", "sum += i; => ;", "self.seen = 0 => pass", "self.count += 1 => pass",
                        "sub r2, r0, r2, asr #3 => "],
    "lost call": ["g(); => ;", 'print("a text", low) => pass'],
    "order": ["x->count = count + 1; x->ring[0] = sum;", "g(); cpu_irq_restore(mask);",
              "sub r2, r0, r2, asr #3 @ first ldr r0, [r1, #AXIS_D]"],
    "lost condition": ["if (sum >= 20) {", "if (x->mode == MODE_SLOW) {", "if (0) {", "if (1) {", "return (sum);",
                       "if low < 0:", "if False:", "return low * 1e3"],
    "half a check": ["if (sum < -7) {", "if (sum > PAUSE_MS) {", "if 0 < high:", "if high <= LIMIT:"],
    "comparison": ["if (sum > 20 && x->mode == MODE_SLOW) {", "if (sum <= 20 && x->mode == MODE_SLOW) {", "bhs work",
                   "if (sum >= 20 && x->mode != MODE_SLOW) {", "if low <= 0 or self.seen:"],
    "copy error": ["int sum = -x->i_q_ref + *p * 300;", "x->ring[1] = sum;", "sum = f(count, sum);", "sub r2, r1, r2, asr #3",
                   "sum = q15_clamp(x->i_d_ref, sum, 9);", "if high < 0 or self.seen:"],
    "unit": ["int sum = -x->i_d_ref + *p * 150;", "int sum = -x->i_d_ref + *p;", "if (sum < -7 || sum > (PAUSE_MS * 1000)) {",
             "return 4 << (3 - 1);", "return low if self.seen else max(low, high, -low)"],
    "off by one": ["for (int i = 0; i <= 9; i++) {", "for (int i = 1; i < 9; i++) {", "x->count = count;", "self.count += 2",
                   "sub r2, r0, r2, asr #4"],
    "race": ["const uint32_t mask = 0u;", "cpu_irq_restore(mask); => ;", "x->count = x->count + 1;"],
    "lost bound": ["sum = (sum);", "high = high // 1 - 1"],
    "enumerator": ["if (sum >= 20 && x->mode == MODE_FAST) {", "return h(sum) ? sum : false;", "return True"],
}


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    parser = Parser(tmp_path_factory.mktemp("sample"))
    return parser, parser.mutants("a.c", SAMPLE)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_mistake(kind, sample):
    mutants = (*sample[1], *python.mutants("a.py", SNAKE), *assembly.mutants("a.S", ASSEMBLY))
    said = {text for one in mutants if one.kind == kind for text in (one.replacement, f"{one.original} => {one.replacement}")}
    assert set(EXPECTED[kind]) <= said, said


def test_texts_remarks_declarations_and_constants_have_none(sample):
    assert not {mutant.line for mutant in sample[1]} & set(range(1, 11))
    assert not {mutant.line for mutant in python.mutants("a.py", SNAKE)} & {1, 2, 3, 4, 5}
    for mutant in (*sample[1], *python.mutants("a.py", SNAKE), *assembly.mutants("a.S", ASSEMBLY)):
        assert "remark" not in mutant.original + mutant.replacement
        assert "q15_max" not in mutant.original or (  # the same in either order, and what only quietens the compiler
            mutant.kind in ("forgotten clear", "lost bound", "off by one") and "(void)p" in mutant.replacement)
        assert mutant.kind == "lost call" or ("a text" in mutant.original) == ("a text" in mutant.replacement)


def test_what_stands_beside_the_original_is_both(sample):
    """By the number that is chosen, the program does as the mutant alone and as the original; both in as many lines."""
    parser, mutants = sample
    for mutant in mutants:
        both = with_all(SAMPLE, [(7, mutant)])
        assert both.count("\n") == SAMPLE.count("\n") == mutant.applied(SAMPLE).count("\n")
        if not parser.complaint("a.c", mutant.applied(SAMPLE)):
            assert not parser.complaint("a.c", "#define MUTANT(n) (n)\n" + both), both
    for mutant in python.mutants("a.py", SNAKE):
        text = headed("a.py", with_all(SNAKE, [(7, mutant)])).replace("_mutant(7)", "chosen")
        results = []
        for chosen, source in ((True, text), (None, mutant.applied(SNAKE)), (False, text), (None, SNAKE)):
            names = {"chosen": chosen}
            exec(compile(source, "a.py", "exec"), names)
            results.append([tried(names["Judge"], low, high) for low, high in ((1, 2), (-1, 2), (2, 4), (1, 0))])
        assert results[0] == results[1] and results[2] == results[3], (mutant.replacement, results)


def tried(judge, low, high):
    one = judge()
    one.count, one.seen = 3, 1
    try:
        return one.verdict(low, high), vars(one)
    except (NameError, AttributeError, TypeError) as error:
        return str(error)


def test_the_choice_is_the_seeds_and_outlives_other_lines(sample):
    def order(seed, text=SAMPLE):
        return [mutant.identity for mutant in sequence(sample[0].mutants("a.c", text), seed, "a.c")]
    assert order("1") == order("1") and sorted(order("1")) == sorted(order("2")) and order("1") != order("2")
    assert order("1", "\n/* more */\n" + SAMPLE) == order("1")
    first = list(sequence(sample[1], "1", "a.c"))[:8]
    assert len({mutant.line for mutant in first}) == 8 and len({mutant.kind for mutant in first}) >= 7


@pytest.fixture(scope="module")
def sources():
    return Sources(ROOT)


@pytest.mark.parametrize("count", (1, 12, 150, 500))
def test_so_many_are_drawn_and_of_each_room_its_part(count, sources):
    weights = {name: weight for name in sources.texts if (weight := sources.weight(name))}
    assert {room(name) for name in weights} > {"firmware/drive", "drivers", "startup", "lib", "plant (qemu/twin)",
                                               "judge (qemu/launcher)", "client (qemu/client)"}
    for seed in map(str, range(6)):
        given = shares(weights, count, seed)
        assert sum(given.values()) == count and min(given.values()) > 0
        owed, got = Counter(), Counter()
        for name, weight in weights.items():
            owed[room(name)] += count * weight / sum(weights.values())
            got[room(name)] += given.get(name, 0)
        assert all(abs(got[one] - owed[one]) < 2 + 1e-9 for one in owed), (owed, got)


def test_what_is_drawn_compiles_and_does_not_overlap(sources):
    drawn = sources.draw(14, "1", lambda name: name.startswith(("firmware/drive/re", "firmware/system/curr", "qemu/client/")))
    assert len(drawn) == 14 and {mutant.file.split(".")[-1] for mutant in drawn} == {"c", "S", "py"}
    for one in drawn:
        assert sources._compiles(one.file, one.applied(sources.texts[one.file]))
        others = [other.slot for other in drawn if other.file == one.file and other is not one and other.slot]
        assert all(one.slot is None or one.slot[1] <= slot[0] or slot[1] <= one.slot[0] for slot in others)


def test_what_a_person_has_said_of_survivors_is_of_mutants_that_there_are(sources):
    known = load_survivors(ROOT / "tests" / "mutants" / "survivors.toml")
    assert not [line for line in complaints({}, known, sources) if "survivors.toml" in line]


# ---- the engine on a small project of its own ----
LEVEL = textwrap.dedent("""\
    int seen(int level)
    {
        int sum = 0;
        for (int n = 1; n < level; n++) {
            sum += n;
        }
        return sum;
    }
    int driven(int level)
    {
        return level + 12345;
    }
    int unseen(int level)
    {
        return level + 12345;
    }
    """)
TEST = textwrap.dedent("""\
    import ctypes
    import sys
    from pathlib import Path

    sys.path.append("qemu/client")
    import words

    def test_it():
        library = ctypes.CDLL(str(Path("{product}").resolve()))
        assert {condition}
    """)
SEEN, DRIVEN = "library.seen(5) == 10 and words.words('a b') == ['a', 'b']", "library.driven(1) == 12346"
MAKEFILE = textwrap.dedent("""\
    build/host.so build/image.so:
    \t$(CC) -shared $^ -o $@
    build/host.so: CC = $(HOSTCC)
    build/image.so: CC = $(CC_ARM)
    build/host.so: build/host/level.o
    build/image.so: build/arm/level.o
    build/host/level.o build/arm/level.o: firmware/level.c
    \t@mkdir -p $(@D)
    \t$(CC) -O1 -g -fPIC -ffunction-sections -c $< -o $@
    -include $(wildcard build/arm/*.d)
    """)
WORDS = "import os\n\n\ndef words(text, most=3):\n    return text.split()[:most] if text else [os.name]\n"


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A project with one file for both machines, one in Python, two tests, and a folder for the engine."""
    monkeypatch.setattr(ladder, "CPU_MORE_S", 1.0)
    root = tmp_path / "project"
    texts = {"firmware/level.c": LEVEL, "qemu/client/words.py": WORDS, "Makefile": MAKEFILE,
             "tests/test_seen.py": TEST.format(product="build/host.so", condition=SEEN),
             "tests/image/test_driven.py": TEST.format(product="build/image.so", condition=DRIVEN)}
    for name, text in texts.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root, tmp_path / "work"


def judge(root, work, wanted, rungs=("unit", "image"), **more):
    """Runs the engine on these mutants: {replacement: outcome}, and what it said."""
    work.mkdir(exist_ok=True)
    sources, heard = Sources(root, rooms=("firmware", "qemu/client")), []
    drawn = sorted((one for name in sources.texts for one in sources.mutants(name) if one.replacement in wanted),
                   key=lambda one: (one.file, one.line))
    image = ("build/image.so",)
    made = Project(root, ("make", "-s"), ("build/host.so",), image, ("build/arm/*.o",), image, "objcopy")
    ladder_of = [Rung("unit", ("tests/test_seen.py", "tests/test_more.py")), Rung("image", ("tests/image",), "build/image.so")]
    engine = Engine(made, work, drawn, [rung for rung in ladder_of if rung.name in rungs], Store(work, root, drawn),
                    heard.append, **more)
    judged = engine.run(drawn)
    return {mutant.replacement: entry["outcome"] for mutant, entry in judged.values()}, heard, judged, sources


def test_an_object_that_is_left_of_a_file_which_is_gone_breaks_nothing(small):
    """Else all of the image's mutants do not build, and do not count."""
    for name, text in (("gone.o", ""), ("gone.d", "build/arm/gone.o: firmware/gone.c\n")):
        (small[0] / "build/arm").mkdir(parents=True, exist_ok=True)
        (small[0] / "build/arm" / name).write_text(text)
    outcomes, *_ = judge(*small, {"return level - 12345;"}, rungs=("image",))
    assert set(outcomes.values()) <= {"noticed", "survived"}


WANTED = {"sum -= n;": "noticed", "for (int n = 2; n < level; n++) {": "noticed", "return level - 12345;": "noticed"}


def test_what_matters_is_noticed_and_what_does_not_is_not(small, tmp_path):
    wanted = {**WANTED, "return text.split()[:most] if not text else [os.name]": "noticed",
              "return text.split()[:most] if text is None else [os.name]": "noticed",
              "return text.split()[:most]": "survived", "def words(text, most=4):": "survived"}
    outcomes, heard, judged, sources = judge(*small, wanted)
    twice = [entry["outcome"] for one, entry in judged.values() if one.replacement == "return level - 12345;"]
    assert sorted(twice) == ["noticed", "survived"] and outcomes["return text.split()[:most]"] == "survived"
    assert {k: v for k, v in outcomes.items() if k not in ("return level - 12345;", "return text.split()[:most]")} == {
        "sum -= n;": "noticed", "for (int n = 2; n < level; n++) {": "noticed"}
    assert any("noticed firmware/level.c:5 sign by tests/test_seen.py::test_it" in line for line in heard)
    assert any("noticed firmware/level.c:11 sign by tests/image/test_driven.py::test_it" in line for line in heard)
    found = list(complaints(judged, {}, sources))
    assert found[0] == "all: 60 % of 5 noticed, at least 90 % are asked for" and "does not say of 2" in found[1]
    said_last = list(lines(judged, {}))
    assert said_last[3].split() == ["all", "5", "3", "60", "%", "1", "2"]
    assert "- return text.split()[:most] if text else [os.name]\n+ return text.split()[:most]" in said_last
    found = [(one, {"outcome": outcome, "by": by}) for one, outcome, by in (
        (None, "noticed", "tests/unit/test_pi.py::test_it"), (None, "noticed", "tests/lib/test_lib32.py::test_it"),
        (None, "noticed", "tests/fabric/test_x.py::test_it"), (None, "survived", None))]
    assert report.of_short(found) == 25 and report.of_short([]) == 0, "of the first three short.txt leaves out two"
    page = tmp_path / "page.md"
    page.write_text("<!-- mutants: written by make mutants -->\nold\n<!-- end -->\n")
    write_page(page, judged, {}, small[0], "make mutants")
    for row in ("| all | 5 | 60 % |\n", "| firmware/level.c:15 | `return level - 12345;` for"):
        assert row in page.read_text()
    (some, verdict), *_ = [one for one in judged.values() if one[1]["outcome"] == "noticed"]
    write_page(page, {some.identity: (some, verdict)}, {}, small[0], "make mutants", [one for one, _ in judged.values()])
    assert "`make mutants`, of which 1 of 5 were judged to the end, " in page.read_text()
    assert "| all | 1 | 100 % | 4 |\n" in page.read_text()
    assert (small[1] / "w0" / "tree" / "firmware" / "level.c").read_text() == LEVEL


def test_what_is_known_is_not_done_again_and_what_has_changed_is(small, monkeypatch):
    """A run that was ended in the middle, parts of one, other rungs, a test more."""
    root, work = small
    first, _, judged, _ = judge(root, work, WANTED, rungs=("unit",))
    assert sorted(entry["outcome"] for _, entry in judged.values()) == ["noticed", "noticed", "survived", "survived"]
    with open(work / "verdicts.jsonl", "a") as out:
        out.write('{"name": "cut o')
    with monkeypatch.context() as patch:
        patch.setattr(Engine, "_server", lambda *_: pytest.fail("nothing was left to do"))
        again, heard, *_ = judge(root, work, WANTED, rungs=("unit",))
    assert again == first and all("as before" in line for line in heard)

    _, heard, judged, _ = judge(root, work, WANTED)
    assert sum("as before" in line for line in heard) == 2, "survivors of one rung go on to the next"
    assert sorted(entry["outcome"] for _, entry in judged.values()) == ["noticed"] * 3 + ["survived"]
    more = TEST.format(product="build/host.so", condition="library.unseen(1) == 12346")
    (root / "tests" / "test_more.py").write_text(more)
    _, heard, judged, _ = judge(root, work, WANTED)
    assert {entry["outcome"] for _, entry in judged.values()} == {"noticed"}
    assert sum("as before" in line for line in heard) == 3, heard


def test_a_mutant_that_does_not_end_is_stopped_and_noticed(small):
    root, work = small
    endless = LEVEL.replace("int sum = 0;", "int sum = 0;\n    volatile int rest = 3;\n    while (rest > 0) {\nrest--;\n    }")
    (root / "firmware" / "level.c").write_text(endless)
    _, _, judged, _ = judge(root, work, {";"}, rungs=("unit",))
    ended = {mutant.original: entry for mutant, entry in judged.values()}
    assert ended["rest--;"]["outcome"] == "noticed" and ended["rest--;"]["how"].startswith("did not end (signal")


def test_a_mutant_of_the_same_code_does_not_count(small):
    root, work = small
    (root / "firmware" / "level.c").write_text(LEVEL.replace("return sum;", "int unused = 7 - 0;\n(void)unused;\nreturn sum;"))
    outcomes, _, judged, sources = judge(root, work, {"int unused = 7 + 0;", "sum -= n;"})
    assert outcomes == {"int unused = 7 + 0;": "same code", "sum -= n;": "noticed"}
    assert not list(complaints(judged, {}, sources))


def test_a_test_that_fails_without_a_mutant_is_left_out_and_named_and_without_any_there_is_no_verdict(small):
    root, work = small
    (root / "tests" / "test_more.py").write_text(TEST.format(product="build/host.so", condition="library.seen(5) == 11"))
    outcomes, heard, *_ = judge(root, work, {"sum -= n;"})
    assert outcomes == {"sum -= n;": "noticed"}
    assert "left out: tests/test_more.py::test_it fails without any mutant" in heard
    (root / "tests" / "test_seen.py").write_text("import nothing_of_this_name\n")
    with pytest.raises(Trouble, match="rungs unit: no tests"):
        judge(root, work, {"sum -= n;"})


def test_a_survivor_says_what_it_would_do_or_why_nothing(small, tmp_path):
    *_, judged, sources = judge(*small, {"return level - 12345;"}, rungs=("unit",))
    rows = [{**{name: getattr(one, name) for name in FIELDS}, key: "because"}
            for (one, _), key in zip(judged.values(), ("user", "equivalent"))]
    (tmp_path / "s.toml").write_text("\n".join("[[mutant]]\n" + "\n".join(f"{k} = {json.dumps(v)}" for k, v in row.items())
                                               for row in [*rows, {**rows[0], "function": "gone"}]))
    known = load_survivors(tmp_path / "s.toml")
    found = list(complaints(judged, known, sources))
    assert len(found) == 2 and "0 % of 1 noticed" in found[0] and "no such mutant any more" in found[1]
    _, _, judged, _ = judge(*small, {"return level - 12345;"})
    noticed = [one for one, entry in judged.values() if entry["outcome"] == "noticed"]
    assert len(noticed) == 1 and any("is noticed by" in line for line in complaints(judged, known, sources))
    (tmp_path / "e.toml").write_text('[[mutant]]\nfile = "a"\nfunction = "f"\noriginal = "x"\nreplacement = "y"\nuser = ""\n')
    with pytest.raises(ValueError, match="without either user or equivalent"):
        load_survivors(tmp_path / "e.toml")


def test_tests_are_asked_by_what_they_share_cost_and_have_noticed(small):
    (root, work), order = small, ladder.Order()
    one, two, other = (ladder.Test(f"{name}", Rung("unit", ()), 1.0, 5.0) for name in ("a.py::one", "a.py::two", "b.py::three"))
    mutant = Sources(root, rooms=("firmware",)).mutants("firmware/level.c")[0]
    for budget_s, asked in ((6.9, [one]), (12.9, [one, two]), (13.0, [one, two, other]), (0.0, [one, two, other])):
        assert order.sorted(mutant, [one, two, other], budget_s) == asked
    order.learn(mutant, {"asked": ["a.py::one", "b.py::three"], "by": "b.py::three"})
    assert order.sorted(mutant, [one, two, other])[0] == other
    _, _, judged, _ = judge(root, work, {"return level - 12345;"}, budget_s=1e-6)
    assert all(entry["outcome"] == "survived" for _, entry in judged.values())
    assert any("1 tests were not asked" in entry["how"] for _, entry in judged.values())


def compiled(folder, name, text):
    (folder / f"{name}.c").write_text(text)
    subprocess.run(["cc", "-O1", "-ffunction-sections", "-c", f"{name}.c", "-o", f"{name}.o"], cwd=folder, check=True)
    return folder / f"{name}.o"


@pytest.mark.parametrize("edit, changed", [
    (("sum += n", "sum -= n"), {"seen"}), (("int unseen", "int other"), {"unseen"}), (("sum += n", "sum += n + 0"), set()),
    (("fixed = 7", "fixed = 8"), None), (("sum = 0;", "sum = level;"), {"seen"})])
def test_which_functions_a_mutant_changes(tmp_path, edit, changed):
    text = LEVEL + "const int fixed = 7;\n"
    was, now = compiled(tmp_path, "was", text), compiled(tmp_path, "now", text.replace(*edit))
    assert reach.changed_functions([(was, was), (was, now)]) == changed


def test_a_test_executes_what_the_twin_saw():
    """By the functions of the image that it runs: the same place is something else in another one."""
    class Known(reach.Functions):
        def __init__(self, *places):
            self.places = places

    number = sum(1 << reach._place(address) for address in (0x106, 0x20000102)).to_bytes(1 << 17, "little")
    assert Known(("low", 0x100, 8), ("next", 0x108, 6), ("high", 0x20000100, 4)).executed(number) == {"low", "high"}
    assert Known(("other", 0x104, 4)).executed(number) == {"other"}


@pytest.mark.parametrize("row, said", [
    ({"old": "x->mode = MODE_NONE;", "new": "x->mode = MODE_FAST;"}, ""), ({"old": "sum < -7", "new": "sum < 7"}, ""),
    ({"old": "sum += i;", "new": "sum += i"}, "does not compile"),
    ({"old": "const int count = x->count;", "new": "g();"}, "does not compile"),
    ({"old": "sum", "new": "0"}, "stands there 15 times"), ({"old": "sum < -7"}, "no new"), ({"file": "a.c"}, "no file that"),
])
def test_a_person_s_own_stand_in_the_build_or_it_is_said_why_not(row, said, tmp_path):
    (tmp_path / "firmware").mkdir()
    (tmp_path / "firmware/some.c").write_text(SAMPLE)
    row = {"file": "firmware/some.c", **row} if "old" in row else {"old": "sum", "new": "0", **row}
    lines = (f"{key} = {json.dumps(value)}" for key, value in row.items())
    (tmp_path / "own.toml").write_text("\n".join(["[[mistake]]", *lines]))
    sources = Sources(tmp_path, ("firmware",))
    if said:
        with pytest.raises(ValueError, match=said):
            by_hand.load(tmp_path / "own.toml", sources)
    else:
        mutant, = by_hand.load(tmp_path / "own.toml", sources)
        assert with_all(SAMPLE, [(7, mutant)]).count(row["new"]) == 1 == with_all(SAMPLE, [(7, mutant)]).count(row["old"])


def test_a_person_s_own_may_stand_at_the_same_place_of_two_files(tmp_path):
    (tmp_path / "firmware").mkdir()
    for name in "ab":
        (tmp_path / f"firmware/{name}.c").write_text(SAMPLE)
    (tmp_path / "own.toml").write_text("".join(f"[[mistake]]\nfile = 'firmware/{name}.c'\nold = 'sum < -7'\nnew = 'sum < 7'\n"
                                               for name in "ab"))
    assert [mutant.file for mutant in by_hand.load(tmp_path / "own.toml", Sources(tmp_path, ("firmware",)))] == [
        "firmware/a.c", "firmware/b.c"]
