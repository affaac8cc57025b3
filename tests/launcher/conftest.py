# SPDX-License-Identifier: MIT
"""A build folder without a real QEMU: a small ELF with the variables that are watched, and a program that plays QEMU."""
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from rows import param_rows

WATCHED = """
#include <stdint.h>
enum axis_state { AXIS_OFF, AXIS_ON = 4, AXIS_OPERATION_ENABLED, AXIS_FAULT };
enum fault { FAULT_NONE, FAULT_BAD_DAY };
typedef volatile uint32_t word;
struct inner { int16_t small; uint8_t tiny[4]; };
struct current_loop {
    int32_t i_d_ref_q15, i_q_ref_q15, i_d_q15, i_q_q15;
    int32_t vbus_q15; uint32_t angle_u16; int32_t v_d_q15, v_q_q15;
    struct inner nested[3]; int8_t sign; float real;
    struct { uint32_t angle_q32; } pll; uint32_t angle_offset_q32;
};
struct speed_loop { int32_t speed_rpm_q4, speed_ref_rpm_q4; };
struct axis { struct current_loop loop; struct speed_loop speed; struct { word cause; } faults; word state; };
struct param_info { const char *name; int32_t min, max, initial; unsigned offset; };
extern const struct param_info param_table[]; extern const unsigned param_count;
const struct param_info param_table[] = { PARAMS };
const unsigned param_count = sizeof param_table / sizeof param_table[0];
extern struct current_loop current_loop;
struct current_loop current_loop = { .i_d_q15 = 1 };
extern struct axis axes[AXIS_COUNT];
struct axis axes[AXIS_COUNT];
static int32_t hidden;
enum axis_state shown_state; enum fault shown_fault;
int function(void) { hidden++; return hidden; }
void _start(void);
void _start(void) { for (;;) { function(); } }
"""

# Plays QEMU: answers --version and -M help, reads the twin's configuration, writes recordings and a console, ends as told.
FAKE_QEMU = """
#!{python}
import array, math, os, sys, time
argv = sys.argv[1:]
behaviour = {behaviour!r}
if "--version" in argv:
    print("QEMU emulator version 9.9.9 (pretended)"); sys.exit()
if argv[-2:] == ["-M", "help"]:
    print("emcraft-sf2          a board" if behaviour != "no machine" else "virt   another"); sys.exit()
value = lambda key: argv[argv.index(key) + 1]
config = [line.split(None, 1) for line in open(value("-plugin").split("config=")[1]) if not line.startswith("#")]
places = [n for n, (key, rest) in enumerate(config) if key == "axis"]
axes = [config[start:end] for start, end in zip([0, *places], [*places, len(config)])]
items = dict((key, rest.strip()) for key, rest in axes[0])
events = sorted((rest.split(None, 2) for key, rest in config if key == "event"), key=lambda event: float(event[0]))
typed = [event[2].strip() for event in events if event[1] == "console"]
if behaviour == "hang":
    open(items["progress"] + ".pid", "w").write(str(os.getpid()) + "\\n")
    while True: time.sleep(60)
answer = lambda line: "error: it does not want to" if behaviour == "refuses " + line else "ok"
open(value("-chardev").split("path=")[1], "w").write("".join("> %s\\r\\n%s\\r\\n" % (line, answer(line)) for line in typed))
if behaviour == "lockup":
    sys.stderr.write("qemu: fatal: Lockup: can't escalate 3 to HardFault\\n"); sys.stderr.flush(); os.abort()
if behaviour == "bad config":
    sys.stderr.write("mssfoc twin: twin.cfg:3: unknown key\\n"); sys.exit(1)
end = float(items["end"]) if behaviour != "short" else float(items["end"]) / 2
def write(path, names, rows):
    with open(path, "wb") as out:
        out.write((",".join(names) + "\\n").encode())
        array.array("d", [number for row in rows for number in row]).tofile(out)
def trace(columns, w):
    for n in range(1, round(end * 20000)):
        t = n / 20000; angle = w * t
        row = dict(t_s=t, speed_rad_s=w, theta_mech_rad=angle, vbus_V=24, gates=5, gate_live=1)
        for k, phase in enumerate("abc"):
            row["i_%s_A" % phase] = -2.0 * math.sin(4 * angle - k * 2 * math.pi / 3)
            row["i_%s_mean_A" % phase] = row["i_%s_A" % phase]
            row["i_%s_rms_A" % phase] = row["i_%s_peak_A" % phase] = abs(row["i_%s_A" % phase])
        yield [row.get(name, 0) for name in columns]
def interrupts():
    for n in range(1, round(end * 20000)):
        for exception in range(50, 50 + len(axes)):
            yield n / 20000, exception, 800, 1800, 700 if n % 2 else 650, 400, 550, 0, 690, 0
        if n % 20 == 0:
            yield n / 20000, 30, 0, 0, 400, 300, 0, 700, 400, 0
for number, axis in enumerate(axes):
    columns = "{columns}".split(",") + [rest.split()[0] for key, rest in axis if key == "probe"]
    write(dict(axis)["trace"].strip(), columns, trace(columns, 100.0 / (1 + number)))
write(items["irqlog"], "{irq_columns}".split(","), interrupts())
open(items["progress"], "w").write(str(end) + "\\n")
"""


@pytest.fixture(scope="session")
def elf(tmp_path_factory):
    """The small ELF, compiled for the target as the image is."""
    return elf_of(1, tmp_path_factory)


@pytest.fixture(scope="session")
def elf_of_two(tmp_path_factory):
    """The same of an image that drives two motors."""
    return elf_of(2, tmp_path_factory)


def elf_of(axes, tmp_path_factory):
    compiler = shutil.which("arm-none-eabi-gcc")
    if compiler is None:
        pytest.fail("arm-none-eabi-gcc is not installed")
    folder = tmp_path_factory.mktemp("elf")
    params = ", ".join(f'{{"{name}", {low}, {high}, {start}, 0}}' for name, (low, high, start) in param_rows().items())
    (folder / "watched.c").write_text(WATCHED.replace("PARAMS", params))
    subprocess.run([compiler, f"-DAXIS_COUNT={axes}", "-mcpu=cortex-m3", "-mthumb", "-g3", "-O1", "-nostdlib", "-ffreestanding",
                    "-Ttext=0x100", "-Tdata=0x20000000", "-Wl,--no-warn-rwx-segments", "watched.c", "-o", "mssfoc.elf"],
                   cwd=folder, check=True)
    return folder / "mssfoc.elf"


@pytest.fixture
def build(elf, tmp_path):
    """A build folder with everything a run looks for."""
    return build_with(elf, tmp_path / "build")


@pytest.fixture
def build_of_two(elf_of_two, tmp_path):
    """The same of an image that drives two motors."""
    return build_with(elf_of_two, tmp_path / "two")


def build_with(elf, folder):
    (folder / "qemu").mkdir(parents=True)
    shutil.copy(elf, folder / "mssfoc.elf")
    (folder / "mssfoc.hex").write_text(":00000001FF\n")
    (folder / "qemu" / "twin.so").write_bytes(b"")
    return folder


@pytest.fixture
def fake_qemu(tmp_path):
    """Makes a program that plays QEMU: fake_qemu("lockup") -> its path."""
    from launcher.load import COLUMNS
    from launcher.trace import PLANT_COLUMNS

    def make(behaviour="well"):
        path = Path(tmp_path) / f"qemu-{behaviour.replace(' ', '-')}"
        if path.exists():  # a launcher may be about to start it: written anew it would be missing or half there
            return str(path)
        text = textwrap.dedent(FAKE_QEMU).lstrip().format(python=sys.executable, behaviour=behaviour,
                                                          columns=",".join(PLANT_COLUMNS), irq_columns=",".join(COLUMNS))
        # Another process writes it: a fork of this one at that moment would keep it open, and nobody could run it.
        subprocess.run(["install", "-m", "755", "/dev/stdin", path], input=text, text=True, check=True)
        return str(path)
    return make
