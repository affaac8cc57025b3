# SPDX-License-Identifier: MIT
"""Registers by Modbus RTU, at a serial port or a TCP port that carries the same frames."""
import copy
import threading

from .drive import ANSWER_S
from .errors import Refused, Silent

FRAME_S, ATTEMPTS = 1.0, 3
# what the drive's exceptions mean (docs/modbus.md)
MEANS = {"IllegalRequestError": "unknown or read-only, a value out of range, or parameters that do not fit together",
         "SlaveReportedException": "not in this state; parameters change only while the drive is off"}
ADDRESS_MOST = 247
PARITIES = {"N": 2, "O": 1, "E": 1}  # -> stop bits


class ModbusLine:
    owner = 2  # its number in object `owner`

    def __init__(self, place, address=1, baud=19200, parity="E"):
        import minimalmodbus
        import serial

        if parity not in PARITIES:
            raise Refused(f"parity is one of {', '.join(PARITIES)}, not {parity}")
        try:
            port = serial.serial_for_url(place, baud, parity=parity, stopbits=PARITIES[parity], timeout=FRAME_S)
        except (serial.SerialException, ValueError, OSError) as error:
            raise Silent(f"{place} cannot be opened: {error}") from error
        self._errors, self._one_at_a_time = minimalmodbus, threading.RLock()
        self._slave = minimalmodbus.Instrument(port, address)

    def close(self):
        self._slave.serial.close()

    def second(self):
        """The same line for axis 2: the drive answers for it under its next address."""
        if self._slave.address == ADDRESS_MOST:
            raise Refused(f"behind address {ADDRESS_MOST} there is none for axis 2")
        other = copy.copy(self)
        other._slave, other.close = copy.copy(self._slave), lambda: None
        other._slave.address += 1
        return other

    def read(self, entry):
        words = self._answered(entry, self._slave.read_registers, entry.register, _words(entry))
        value = words[0] if len(words) == 1 else words[0] << 16 | words[1]
        bits = 16 * len(words)
        return value - (1 << bits) if entry.signed and value >> bits - 1 else value

    def write(self, entry, value):
        words = [value & 0xFFFF] if _words(entry) == 1 else [value >> 16 & 0xFFFF, value & 0xFFFF]
        with self._one_at_a_time:
            self._slave.serial.timeout = ANSWER_S if entry.name == "store" else FRAME_S
            self._answered(entry, self._slave.write_registers, entry.register, words)
            self._slave.serial.timeout = FRAME_S

    def _answered(self, entry, ask, *arguments):
        """Asks again where a frame was disturbed: the same word twice is no new edge, the same value no new one."""
        for attempt in range(1, ATTEMPTS + 1):
            try:
                with self._one_at_a_time:
                    return ask(*arguments)
            except self._errors.SlaveReportedException as error:
                raise Refused(f"{entry.name}: {MEANS.get(type(error).__name__, error)}") from error
            except (self._errors.ModbusException, OSError) as error:
                if attempt == ATTEMPTS:
                    raise Silent(f"{entry.name}: {error}") from error


def _words(entry):
    return 2 if entry.bits == 32 else 1
