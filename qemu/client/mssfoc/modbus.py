# SPDX-License-Identifier: MIT
"""Registers by Modbus RTU, at a serial port or a TCP port that carries the same frames."""
from .errors import Refused, Silent

ANSWER_S = 5.0  # `save` is answered when it is done
PARITIES = {"N": 2, "O": 1, "E": 1}  # -> stop bits


class ModbusLine:
    def __init__(self, place, address=1, baud=19200, parity="E"):
        import minimalmodbus
        import serial

        if parity not in PARITIES:
            raise Refused(f"parity is one of {', '.join(PARITIES)}, not {parity}")
        try:
            port = serial.serial_for_url(place, baud, parity=parity, stopbits=PARITIES[parity], timeout=ANSWER_S)
        except (serial.SerialException, ValueError, OSError) as error:
            raise Silent(f"{place} cannot be opened: {error}") from error
        self._errors = minimalmodbus
        self._slave = minimalmodbus.Instrument(port, address)

    def close(self):
        self._slave.serial.close()

    def read(self, entry):
        words = self._answered(entry, self._slave.read_registers, entry.register, _words(entry))
        value = words[0] if len(words) == 1 else words[0] << 16 | words[1]
        bits = 16 * len(words)
        return value - (1 << bits) if entry.signed and value >> bits - 1 else value

    def write(self, entry, value):
        words = [value & 0xFFFF] if _words(entry) == 1 else [value >> 16 & 0xFFFF, value & 0xFFFF]
        self._answered(entry, self._slave.write_registers, entry.register, words)

    def _answered(self, entry, ask, *arguments):
        try:
            return ask(*arguments)
        except self._errors.SlaveReportedException as error:
            raise Refused(f"{entry.name}: {error}") from error
        except (self._errors.ModbusException, OSError) as error:
            raise Silent(f"{entry.name}: {error}") from error


def _words(entry):
    return 2 if entry.bits == 32 else 1
