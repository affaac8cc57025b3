# SPDX-License-Identifier: MIT
"""mbpoll and pymodbus at the bus of a running drive: the session of docs/modbus.md, line by line, and the page's program."""
import inspect
import re

import pytest
from pymodbus.client import ModbusSerialClient

from closed_loop.live import PATIENCE_S, live, until
from closed_loop.modbus_transcript import transcript
from rigs.firmware import ROOT

# pymodbus 3.0 has no method of its own for some functions, and other names in them
NAMES = set(inspect.signature(ModbusSerialClient.readwrite_registers).parameters)
SLAVE = {"slave" if "slave" in NAMES else "unit": 1}
VALUES = "values" if "values" in NAMES else "write_registers"
PAGE = (ROOT / "docs/modbus.md").read_text()


def test_the_session_of_the_page_is_what_happens(tmp_path):
    documented = re.search(r"<!-- session: .*?-->\n```text\n(.*?)```\n", PAGE, re.S).group(1)
    with live(tmp_path) as (port, progress):
        assert transcript(port, progress) == documented, "tests/tools/modbus_page.py --session writes it anew"


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    with live(tmp_path_factory.mktemp("live")) as (port, _):
        client = ModbusSerialClient(port, baudrate=19200, parity="N", timeout=PATIENCE_S)
        assert client.connect()
        yield client
        client.close()


def test_pymodbus_identifies_it(drive):
    if hasattr(drive, "read_device_information"):
        answer = drive.read_device_information(read_code=1, object_id=0, **SLAVE)
    else:
        from pymodbus.mei_message import ReadDeviceInformationRequest
        answer = drive.execute(ReadDeviceInformationRequest(read_code=1, object_id=0, **SLAVE))
    assert answer.information[0] == b"mssfoc" and list(answer.information) == [0, 1, 2]


def test_the_program_of_the_page_turns_the_motor(drive):
    program = re.search(r"```python\n(.*?)```", PAGE, re.S).group(1)
    said = []
    exec(program[program.index("for word"):], {"drive": drive, "print": said.append})  # pylint: disable=exec-used
    assert len(said[0]) == 8

    def registers(count):
        return drive.read_holding_registers(16, count=count, slave=1).registers

    def turns():
        status, _, high, low = registers(4)
        return status & 0x427 == 0x427 and (high << 16 | low) == pytest.approx(1500000, rel=0.01)

    until(turns, "1500 rpm")
    quick_stop = drive.mask_write_register(address=0, and_mask=0xFFF0, or_mask=0x0002, **SLAVE)
    assert quick_stop.function_code == 22
    until(lambda: registers(1)[0] & 0x4F == 0x40, "it stops")


def test_pymodbus_sees_exceptions_and_reads_what_it_writes(drive):
    assert drive.read_holding_registers(10, count=1, slave=1).exception_code == 2
    assert drive.write_register(1, 2, slave=1).exception_code == 3
    answer = drive.readwrite_registers(read_address=0, read_count=8, write_address=4, **{VALUES: [0xFFFF, 0xFF00]}, **SLAVE)
    assert answer.registers[4:6] == [0xFFFF, 0xFF00]
    assert drive.read_input_registers(128, count=2, slave=1).registers == [0x0002, 0x0192]
