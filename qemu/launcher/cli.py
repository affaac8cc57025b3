# SPDX-License-Identifier: MIT
"""Command line: run, console, scope, debug, models, bringup, campaign, show, list, keys. Options fall back to MOTOR, SCENARIO,
SEED, PLANT, SPREAD, DETUNE, FABRIC, SENSORS, ENVM, CHIP, QEMU and BUILD."""
import argparse
import errno
import os
import signal
import sys
from pathlib import Path

from .errors import LauncherError, choice


def main(argv=None):
    """Returns the exit status: 0 all limits hold, 1 a limit failed, 2 the run could not be made."""
    options = _parser().parse_args(argv)
    _end_in_order()
    try:
        return options.function(options)
    except LauncherError as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            return 2
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        print(f"mssfoc: the disk is full{f' at {error.filename}' if error.filename else ''}; BUILD=path is another place",
              file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("mssfoc: interrupted", file=sys.stderr)
        return 130


def _end_in_order():
    """A signal that ends the launcher unwinds it, and with it QEMU."""
    def leave(number, _frame):
        print(f"mssfoc: ended by {signal.Signals(number).name}", file=sys.stderr)
        sys.exit(128 + number)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:  # nohup
            signal.signal(number, leave)


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        print(f"mssfoc: {message} (see --help)", file=sys.stderr)
        sys.exit(2)


def _parser():
    parser = _Parser(prog="qemu/run.py", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, function, text in (("run", _run, "play a scenario, report figures, write trace.csv and report.json"),
                                 ("console", _console, "live console of a running drive in this terminal"),
                                 ("scope", _scope, "a page in the browser: plots, captures, parameters, commands"),
                                 ("debug", _debug, "QEMU halted with a GDB port"),
                                 ("models", _models, "motor models against their data sheets"),
                                 ("list", _list, "motors and scenarios there are"),
                                 ("keys", _keys, "what a motor or inverter file may hold")):
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(function=function)
        command.add_argument("--build", default=None, help="build folder (default: $BUILD or build)")
        if name in ("list", "keys"):
            continue
        command.add_argument("--motor", default=os.environ.get("MOTOR") or None,
                             help="file of qemu/motors, path to a .toml, or lot:N"
                             + (" (default: all)" if name == "models" else ""))
        if name == "models":
            continue
        command.add_argument("--qemu", default=None, help="qemu-system-arm to use (default: $QEMU)")
        command.add_argument("--seed", default=os.environ.get("SEED") or "1", help="of noise, tolerances, start angle")
        command.add_argument("--plant", default=os.environ.get("PLANT") or "full",
                             help="full, ideal, or either and changes: full,-saturation (default: $PLANT or full)")
        command.add_argument("--spread", default=os.environ.get("SPREAD") or "1",
                             help="factor of the tolerances that the seed draws from, 0: nominal (default: $SPREAD or 1)")
        command.add_argument("--detune", default=os.environ.get("DETUNE") or "",
                             help="what the firmware is told wrongly: 'resistance_mohm*1.3 flux_uwb*0.8' (default: $DETUNE)")
        command.add_argument("--fabric", default=os.environ.get("FABRIC") or "model",
                             help="model: the twin's C models; rtl: the verilated RTL (default: $FABRIC or model)")
        command.add_argument("--sensors", default=os.environ.get("SENSORS") or "",
                             help="file of qemu/sensors laid over the inverter's, with --fabric rtl (default: $SENSORS)")
        command.add_argument("--start", default=os.environ.get("START") or "found",
                             help="found: the drive finds where its rotor stands; aligned: it knows (default: $START or found)")
        command.add_argument("--envm", default=os.environ.get("ENVM") or "",
                             help="file of what the device keeps while it is off: settings (default: $ENVM, or nothing)")
        command.add_argument("--chip", default=os.environ.get("CHIP") or "",
                             help="m2s010, on which traffic on FIC_0 undoes changes, or m2s025 (default: $CHIP or m2s010)")
        command.add_argument("--scenario", help="file of qemu/scenarios",
                             default=os.environ.get("SCENARIO") or None if name == "run" else None)
        if name in ("run", "scope"):
            command.add_argument("--out", default=None, help=f"folder for its files (default: {name}/ of the build folder)")
        if name == "run":
            command.add_argument("--picture", action="store_true", help="draw the run, too: run.png")
        if name == "scope":
            command.add_argument("--port", default=os.environ.get("PORT") or None,
                                 help="serial port of a board; without it the drive in QEMU (default: $PORT)")
            command.add_argument("--at", type=int, default=0, help="port of the page (default: a free one)")
            command.add_argument("--no-browser", action="store_true", help="only print the page's address")
        if name == "console":
            command.add_argument("--console", default=os.environ.get("CONSOLE") or "",
                                 help="where a program has the console: pty, or tcp:PORT (default: $CONSOLE or this terminal)")
        if name in ("scope", "console", "debug"):
            command.add_argument("--modbus", default=os.environ.get("MODBUS") or "",
                                 help="where the line of MMUART_1 is to be had: pty, or tcp:PORT (default: $MODBUS or nowhere)")
        if name in ("run", "console", "debug"):
            command.add_argument("--can", default=os.environ.get("CAN") or "",
                                 help="where the CAN bus is to be had: tcp:PORT speaks socketcand, pty slcan; join:PORT, not of"
                                      " run, is on another twin's bus (default: $CAN or nowhere)")
        if name == "debug":
            command.add_argument("--port", type=int, default=1234, help="GDB port")
    _add_show(commands)
    _add_bringup(commands)
    _add_campaign(commands)
    return parser


def _add_show(commands):
    show = commands.add_parser("show", help="the file of a motor or of its inverter; of lot:N, what was drawn")
    show.set_defaults(function=_show)
    show.add_argument("name", help="file of qemu/motors, path to a .toml, or lot:N")
    show.add_argument("--inverter", action="store_true", help="of the motor's inverter")


def _add_bringup(commands):
    bringup = commands.add_parser("bringup", help="the bring-up image: the device beside what docs/silicon.md says of it")
    bringup.set_defaults(function=_bringup)
    bringup.add_argument("--wrong", default=os.environ.get("WRONG") or None,
                         help="a device made otherwise, of qemu/chips/wrong.toml (default: $WRONG, or as documented)")
    bringup.add_argument("--build", default=None, help="build folder (default: $BUILD or build)")
    bringup.add_argument("--qemu", default=None, help="qemu-system-arm to use (default: $QEMU)")
    bringup.add_argument("--out", type=Path, default=None, help="folder for its files (default: bringup/ of the build folder)")


def _add_campaign(commands):
    """`campaign` and `case`, which it calls for each run."""
    campaign = commands.add_parser("campaign", help="motors x scenarios x seeds x detunings: one table of worst cases")
    campaign.set_defaults(function=_campaign)
    for option, variable, text in (("--motors", "MOTORS", "names, files, lot:1-200 (default: all that are shipped)"),
                                   ("--scenarios", "SCENARIOS", "names, separated by blanks (default: all)"),
                                   ("--seeds", "SEEDS", "runs of each (default: 8, for faults 1)"),
                                   ("--detunes", "DETUNES", "what the drive is told wrongly, separated by ';'"),
                                   ("--part", "PART", "start, wiring, supervision or detune: hostile cases"),
                                   ("--case", "CASE", "one case of a part, kept whole: start:teknic_m2310p/hoist20/45"),
                                   ("--what", "WHAT", "of a part, these cases only: quickstop/* slip60/*"),
                                   ("--angles", "ANGLES", "of PART=start, electrical degrees (default: docs/campaign.md)"),
                                   ("--loads", "LOADS", "of PART=start: free, hoist20, friction20, hoist50 ..."),
                                   ("--from", "FROM", "of PART=lot: the first lot (default: 1)"),
                                   ("--lots", "N", "of PART=lot: how many (default: 200)"),
                                   ("--jobs", "JOBS", "runs at a time (default: one a processor)"),
                                   ("--sshlogin", "SSHLOGIN", "machines to use, as GNU parallel takes them")):
        campaign.add_argument(option, default=os.environ.get(variable) or None, help=text)
    case = commands.add_parser("case", help="one run of a campaign")
    case.set_defaults(function=_case)
    case.add_argument("key", help="MOTOR/SCENARIO/SEED or MOTOR/SCENARIO/SEED/DETUNE, or PART:MOTOR/WHAT")
    case.add_argument("--cases", required=True, help="folder for its result")
    for command in (campaign, case):
        command.add_argument("--build", default=None, help="build folder (default: $BUILD or build)")
        command.add_argument("--qemu", default=None, help="qemu-system-arm to use (default: $QEMU)")


def _run(options):
    from .qemu import ProgressLine
    from .simulate import DEFAULT_MOTOR, DEFAULT_SCENARIO, simulate

    motors = _names(options.motor or DEFAULT_MOTOR, "MOTOR")
    scenarios = _names(options.scenario or DEFAULT_SCENARIO, "SCENARIO")
    if len(scenarios) > len(motors):
        raise LauncherError("SCENARIO names two, MOTOR one: each of two motors may have a scenario of its own")
    scenarios = scenarios * len(motors) if len(scenarios) == 1 else scenarios
    progress = ProgressLine(", ".join(f"{scenario} on {motor}" for scenario, motor in zip(scenarios, motors)))
    second = {"motor": motors[1], "scenario": scenarios[1]} if len(motors) == 2 else None
    result = simulate(scenarios[0], motors[0], options.seed, options.out, options.build, options.qemu,
                      show=_beside(progress) if options.picture else progress, csv=True, can=options.can, second=second,
                      **_plant(options))
    progress.done()
    return _report_all([result, result.second] if second else [result], options.picture)


def _beside(show):
    """The same, and while QEMU is at it what drawing will need is imported: it takes as long as all else that Python does."""
    def look(now_s, end_s):
        from . import plot  # noqa: F401
        show(now_s, end_s)
    return look


def _report_all(results, picture):
    """Of each motor what a person reads and what is kept; the exit status."""
    from .paths import shown
    from .refusals import complaint
    from .report import print_report, write_json

    for number, result in enumerate(results, 1):
        write_json(result, result.out_dir / "report.json")
        (result.out_dir / "trace.bin").unlink()  # trace.csv has the same
        print_report(result, print, f"axis {number}: " if len(results) > 1 else "", with_load=number == len(results))
        names = ["trace.csv", "report.json"]
        if picture:
            from .plot import draw

            names.append("run.png")
            draw(result, result.out_dir / names[-1])
        print(f"written: {', '.join(shown(result.out_dir / name) for name in names)}")
        if number < len(results):
            print()
    for refused in filter(None, (complaint(result.figures) for result in results)):
        print(f"mssfoc: {refused}", file=sys.stderr)
    return 0 if all(result.passed for result in results) else 1


def _names(text, variable):
    """One or two of them, separated by blanks; a path may have blanks."""
    names = [text] if Path(text).is_file() else text.split()
    if len(names) > 2:
        raise LauncherError(f"{variable} names {len(names)}, but the image drives two motors at most")
    return names


STARTS = ("found", "aligned")


def _plant(options):
    if options.start not in STARTS:
        raise LauncherError(f"no START '{options.start}'; there are: {choice(options.start, STARTS)}")
    return {"plant": options.plant, "spread": options.spread, "detune": options.detune, "fabric": options.fabric,
            "sensors": options.sensors, "aligned": options.start == "aligned", "envm": options.envm, "chip": options.chip}


def _only(motor):
    if len(_names(motor, "MOTOR")) > 1:
        raise LauncherError(f"MOTOR '{motor}' names two, which make run, console and scope play alone")
    return motor


def _console(options):
    from .console import live_console
    from .simulate import DEFAULT_MOTOR

    motors = _names(options.motor or DEFAULT_MOTOR, "MOTOR")
    return live_console(motors[0], options.seed, options.build, options.qemu, options.scenario, options.console, options.modbus,
                        options.can, *motors[1:], **_plant(options))


def _scope(options):
    if not 0 <= options.at <= 65535:
        raise LauncherError(f"port {options.at} is outside 0..65535")
    try:
        from scope.web import serve
    except ImportError as error:
        raise LauncherError(f"make scope needs python3-aiohttp and python3-serial ({error})") from error
    from scope.board import Board
    from scope.twin import Twin
    from .simulate import DEFAULT_MOTOR

    far = Board(options.port, options.build) if options.port else Twin(
        _names(options.motor or DEFAULT_MOTOR, "MOTOR"), options.seed, options.build, options.qemu, options.out, options.modbus,
        **_plant(options))
    return serve(far, options.at, not options.no_browser)


def _debug(options):
    from .console import debug_session
    from .simulate import DEFAULT_MOTOR

    return debug_session(_only(options.motor or DEFAULT_MOTOR), options.seed, options.build, options.qemu, options.scenario,
                         options.port, options.modbus, options.can, **_plant(options))


def _show(options):
    from .lot_text import text_of

    print(text_of(options.name, options.inverter), end="")
    return 0


def _models(options):
    from .model_check import check_models
    from .motulator_check import check_motulator

    status = check_models(options.motor, options.build, print)
    return status if options.motor else 1 if check_motulator(options.build, print) else status


def _bringup(options):
    from .bringup import bringup

    return bringup(options.wrong, options.build, options.qemu, options.out, print)


def _campaign(options):
    from .campaign import plan, play
    from .campaign_report import report

    if options.part or options.case:
        return _part(options)
    cases = plan((options.motors or "").split(), (options.scenarios or "").split(), _count(options.seeds, "SEEDS"),
                 [detune.strip() for detune in (options.detunes or "").split(";")])
    folder, outcomes = play(cases, options.build, options.qemu, _count(options.jobs, "JOBS"), options.sshlogin)
    return report(outcomes, folder.parent, print)


def _part(options):
    from .campaign import play
    from .part_report import report_case, report_part
    from .parts import parse, plan_part

    if options.case:
        return report_case(parse(options.case), options.build, options.qemu, print)
    if options.part == "lot":
        return _lots(options)
    cases = plan_part(options.part, (options.motors or "").split(), vars(options))
    folder, outcomes = play(cases, options.build, options.qemu, _count(options.jobs, "JOBS"), options.sshlogin)
    return report_part(options.part, outcomes, folder.parent, print)


def _lots(options):
    from . import part_lot
    from .campaign import play
    from .campaign_table import EXPECTED_PARTS, load_expected
    from .parts import parse
    from .simulate import write

    first = _count(getattr(options, "from"), "FROM", part_lot.LAST) or 1
    cases = part_lot.plan(first, _count(options.lots, "N") or part_lot.COUNT)
    folder, outcomes = play(cases, options.build, options.qemu, _count(options.jobs, "JOBS"), options.sshlogin)
    page, status = part_lot.report(outcomes, {**load_expected(), **load_expected(EXPECTED_PARTS, parse)}, print)
    write(folder.parent / "lot.md", page)
    return status


def _count(text, what, most=10000):
    if text is None:
        return None
    if not text.isdigit() or not 1 <= int(text) <= most:
        raise LauncherError(f"{what} '{text}' is not a whole number from 1 to {most}")
    return int(text)


def _case(options):
    from .campaign import parse_case, run_case
    from .parts import is_part, parse, run_part_case

    if is_part(options.key):
        run_part_case(parse(options.key), options.cases, options.build, options.qemu)
    else:
        run_case(parse_case(options.key), options.cases, options.build, options.qemu)
    return 0


def _list(_options):
    from .data import available, load_motor, read_toml
    from .paths import MOTORS, SCENARIOS

    print("motors")
    for name in available(MOTORS):
        print(f"  {name:<22} {load_motor(name).summary}")
    print("scenarios")
    for name in available(SCENARIOS):
        print(f"  {name:<22} {read_toml(SCENARIOS / f'{name}.toml').get('title', '')}")
    return 0


def _keys(_options):
    from .schema import page_lines

    print("\n".join(page_lines()))
    return 0
