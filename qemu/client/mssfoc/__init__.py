# SPDX-License-Identifier: MIT
"""A client for drives that run mssfoc.

    import mssfoc

    with mssfoc.connect("/dev/ttyUSB0") as drive:
        drive["ramp_rpm_s"] = 3000
        drive.on()
        drive.speed(1000)

What a drive can do, by whatever line: drive.py. What the console alone has, lines of one's own and captures: console.py.
"""
from .drive import Drive, Fault, Status
from .errors import Error, Faulted, Refused, Silent
from .watch import TIMEOUT_MS, Watch

__all__ = ["Drive", "Error", "Fault", "Faulted", "Refused", "Silent", "Status", "connect"]


def connect(place, command_timeout_ms=TIMEOUT_MS, **options):
    """A Drive at the line's other end, which stops so long after this program has fallen silent; 0: it goes on (watch.py).

    /dev/ttyUSB0, COM3 or socket://HOST:PORT         its console
    modbus:/dev/ttyUSB1, modbus:socket://HOST:PORT   options address=1, baud=19200, parity="E", registers=FILE
    can:INTERFACE:CHANNEL                            options node=N, registers=FILE, and python-can's, as bitrate=500000
    """
    watch = Watch(command_timeout_ms)
    return _opened(place, options).watched(watch)


def _opened(place, options):
    kind, _, rest = place.partition(":")
    if kind == "modbus":
        from .bus import BusDrive
        from .modbus import ModbusLine

        registers = options.pop("registers", None)
        return BusDrive(ModbusLine(rest, **options), registers)
    if kind == "can":
        from .bus import BusDrive
        from .can import CanLine

        interface, _, channel = rest.partition(":")
        if not channel or "node" not in options:
            raise Refused("on CAN a drive is can:INTERFACE:CHANNEL, with node=1...127")
        registers = options.pop("registers", None)
        return BusDrive(CanLine(interface, channel, options.pop("node"), **options), registers)
    from .console import ConsoleDrive

    return ConsoleDrive(place, **options)
