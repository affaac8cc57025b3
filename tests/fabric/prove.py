# SPDX-License-Identifier: MIT
"""Proves what drivers/fabric/rtl/formal promises of each module, by temporal induction: yosys, yosys-smtbmc, z3.

prove.py [NAME ...]   prints one line a proof; exits 1 if one does not hold
"""
import os
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from places import ROOT, RTL, includes

PROOFS = ROOT / "tests/fabric/proofs.toml"
# so that a lost solver ends: more than ten times what the longest proof takes
SECONDS = 1200


def load(path=PROOFS):
    """{top: {depth, files, says}}"""
    proofs = tomllib.loads(path.read_text(encoding="utf-8"))
    for top, proof in proofs.items():
        proof["files"] = [proof.get("top", top), *proof.get("files", [])]
    return proofs


class Unproved(Exception):
    """Why a property is not proved: a counterexample in the base case or in the induction step, or a tool's complaint."""


def flattened(top, proof, rtl):
    """Commands of yosys that read a module and make one flat netlist of it and its promises."""
    below = " ".join(f"{rtl}/{name}.v" for name in proof["files"][1:])
    module = Path(top).name
    choice = "".join(f"chparam -set {name} {value} {module}; " for name, value in proof.get("parameters", {}).items())
    # the modules below are read without their own promises, and so without what those take for granted
    folders = " ".join([*includes(rtl), f"-I{rtl / top}/.."])
    return ((f"read_verilog {folders} {below}; " if below else "")
            + f"read_verilog -formal {folders} {rtl}/{top}.v; {choice}prep -top {module} -flatten; ")


def model(top, proof, out, rtl=RTL):
    """Writes the SMT-LIB model of a module; raises Unproved when yosys refuses it."""
    script = flattened(top, proof, rtl) + f"async2sync; dffunmap; write_smt2 -wires {out}"
    run = subprocess.run(["yosys", "-q", "-p", script], capture_output=True, text=True, cwd=rtl)
    if run.returncode or not out.is_file():
        raise Unproved("yosys: " + (run.stderr.strip().split("\n") or ["?"])[-1])
    if "(define-fun |" + Path(top).name + "_a|" not in out.read_text(encoding="utf-8"):
        raise Unproved("no property was found in the model")


STEPS = {"base case": [], "induction": ["-i"]}


def prove_by_sat(top, proof, rtl, clocks):
    """The same induction by the SAT solver that is built into yosys: where z3 gets lost in arithmetic."""
    script = (flattened(top, proof, rtl) + "memory_map; async2sync; dffunmap; opt_clean; "
              f"sat -tempinduct -prove-asserts -set-assumes -seq 0 -maxsteps {clocks} -verify")
    code, log = solve(["yosys", "-p", script])
    if "Import proof for assert" not in log:
        raise Unproved("yosys: " + log.strip().split("\n")[-1])
    if code or "Induction step proven: SUCCESS!" not in log:
        broken = log.rfind("[base case") > log.rfind("[induction step")
        raise Unproved("base case: a run from reset" if broken else "induction: not proved")


def prove(top, proof, rtl=RTL, further=2, steps=tuple(STEPS)):
    """Raises Unproved unless every property of the module holds for all inputs, for ever; `further` lengthens the base case."""
    top = proof["files"][0]
    if proof.get("engine") == "sat":
        prove_by_sat(top, proof, rtl, proof["depth"] + further)
        return
    with tempfile.TemporaryDirectory() as folder:
        smt = Path(folder) / f"{Path(top).name}.smt2"
        model(top, proof, smt, rtl)
        for what in steps:
            option = STEPS[what]
            # unrolled: z3 gets lost in functions of an uninterpreted state, but not in plain bit vectors
            clocks = proof["depth"] + (0 if option else further)
            command = ["yosys-smtbmc", "-s", "z3", "--unroll", "--noprogress", *option, "-t", str(clocks), str(smt)]
            code, log = solve(command)
            if code or "Status: PASSED" not in log:
                raise Unproved(f"{what}: {complaint(log)}")


def solve(command):
    """(exit code, output); the solver below the command ends with it."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True) as run:
        try:
            log, _ = run.communicate(timeout=SECONDS)
            return run.returncode, log
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            return 1, f"Error: no answer in {SECONDS} s"


def complaint(log):
    for line in log.split("\n"):
        if "Assert failed" in line or "rror" in line:
            return line.partition("Assert failed in ")[2] or line
    return "not proved"


def one(item):
    top, proof = item
    began = time.monotonic()
    try:
        prove(top, proof)
    except Unproved as why:
        return f"proof {top}: FAILS, {why}", False
    return f"proof {top}: holds ({proof['says']}; {time.monotonic() - began:.1f} s)", True


def main(names):
    proofs = load()
    unknown = set(names) - set(proofs)
    if unknown:
        print(f"no proof is called {', '.join(sorted(unknown))}; there are {', '.join(proofs)}", file=sys.stderr)
        return 1
    with ThreadPoolExecutor(2) as pool:
        results = []
        for line, good in pool.map(one, ((top, proof) for top, proof in proofs.items() if not names or top in names)):
            print(line, flush=True)
            results.append(good)
    return 0 if results and all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
