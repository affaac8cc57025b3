# SPDX-License-Identifier: MIT
"""Whatever comes in is parsed or refused, and nothing else happens: libFuzzer changes what corpus.py begins with towards code
that no input has entered, and the programs beside judge each input. The same inputs in each run, so many and no time.
`make fuzz N=1000000` goes on longer; an input that fails stands in $BUILD/fuzz/, and its program plays it again."""
import ctypes
import os
import re
import subprocess

import pytest

from fuzz import corpus
from rigs.firmware import built

# runs, and how often in them at least what is judged comes up
FUZZERS = {"console": (10_000, {"accepted": 2000, "nonsense": 4000, "refused": 4000, "set": 700}),
           "modbus": (8_000, {"read": 4000, "refused": 2500, "written": 150}),
           "canopen": (6_000, {"answered": 3000, "refused": 9000, "written": 300, "process": 5000, "layer": 2000}),
           "records": (4_000, {"loaded": 800, "saved": 800, "refused": 1000}),
           "tuning": (1_000, {"driven": 600, "refused": 60})}


def same_addresses():
    """Addresses are among the numbers that a fuzzer tries; where the system does not let them stay, others are tried."""
    ctypes.CDLL(None).personality(0x0040000)  # ADDR_NO_RANDOMIZE


@pytest.mark.parametrize("name", FUZZERS)
def test_no_input_does_what_it_must_not(name, tmp_path):
    usual, least = FUZZERS[name]
    runs = int(os.environ.get("FUZZ_RUNS") or usual)
    program = built(name, "fuzz")
    inputs = getattr(corpus, name)()
    for number, data in enumerate(inputs):
        (tmp_path / f"{number:04}").write_bytes(data)
    seeds = tmp_path / "seeds"
    seeds.write_text(",".join(str(tmp_path / f"{number:04}") for number in range(len(inputs))))
    kept = program.parents[2] / "fuzz" / f"{name}-"
    result = subprocess.run([program, f"-seed_inputs=@{seeds}", f"-runs={runs}", "-seed=1", "-max_len=4096", "-len_control=0",
                             "-timeout=0", "-rss_limit_mb=0", "-print_final_stats=1", f"-artifact_prefix={kept}"],
                            capture_output=True, text=True, errors="replace", preexec_fn=same_addresses)
    assert result.returncode == 0, result.stderr[-4000:]
    seen = {what: int(count) for what, count in re.findall(r"^seen (\w+) (\d+)$", result.stdout, re.M)}
    print(name, *re.findall(r"DONE.*", result.stderr), seen)
    assert runs < usual or all(seen.get(what, 0) >= often for what, often in least.items()), seen
