# SPDX-License-Identifier: MIT
"""Command line: run, console, debug, models, list. Options fall back to MOTOR, SCENARIO, SEED, QEMU and BUILD."""
import argparse
import os
import signal
import sys

from .errors import LauncherError


def main(argv=None):
    """Returns the exit status: 0 all limits hold, 1 a limit failed, 2 the run could not be made."""
    options = _parser().parse_args(argv)
    _end_in_order()
    try:
        return options.function(options)
    except LauncherError as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("mssfoc: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 2


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
    for name, function, text in (("run", _run, "play a scenario, report figures, write trace.csv, report.json, run.png"),
                                 ("console", _console, "live console of a running drive in this terminal"),
                                 ("debug", _debug, "QEMU halted with a GDB port"),
                                 ("models", _models, "motor models against their data sheets"),
                                 ("list", _list, "motors and scenarios there are")):
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(function=function)
        command.add_argument("--build", default=None, help="build folder (default: $BUILD or build)")
        if name == "list":
            continue
        # models: all of them, unless one is asked for here
        command.add_argument("--motor", default=os.environ.get("MOTOR") or None if name != "models" else None,
                             help="file of qemu/motors")
        if name == "models":
            continue
        command.add_argument("--qemu", default=None, help="qemu-system-arm to use (default: $QEMU)")
        command.add_argument("--seed", default=os.environ.get("SEED") or "1", help="of the noise")
        command.add_argument("--scenario", help="file of qemu/scenarios",
                             default=os.environ.get("SCENARIO") or None if name == "run" else None)
        if name == "run":
            command.add_argument("--out", default=None, help="folder for the results (default: run/ of the build folder)")
        if name == "debug":
            command.add_argument("--port", type=int, default=1234, help="GDB port")
    return parser


def _run(options):
    from .paths import shown
    from .plot import draw
    from .qemu import ProgressLine
    from .report import print_report, write_json
    from .simulate import DEFAULT_MOTOR, DEFAULT_SCENARIO, simulate

    motor, scenario = options.motor or DEFAULT_MOTOR, options.scenario or DEFAULT_SCENARIO
    progress = ProgressLine(f"{scenario} on {motor}")
    result = simulate(scenario, motor, options.seed, options.out, options.build, options.qemu, show=progress, csv=True)
    progress.done()
    write_json(result, result.out_dir / "report.json")
    draw(result, result.out_dir / "run.png")
    print_report(result, print)
    print(f"written: {', '.join(shown(result.out_dir / name) for name in ('trace.csv', 'report.json', 'run.png'))}")
    return 0 if result.passed else 1


def _console(options):
    from .console import live_console
    from .simulate import DEFAULT_MOTOR

    return live_console(options.motor or DEFAULT_MOTOR, options.seed, options.build, options.qemu, options.scenario)


def _debug(options):
    from .console import debug_session
    from .simulate import DEFAULT_MOTOR

    return debug_session(options.motor or DEFAULT_MOTOR, options.seed, options.build, options.qemu, options.scenario,
                         options.port)


def _models(options):
    from .model_check import check_models

    return check_models(options.motor, options.build, print)


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
