# SPDX-License-Identifier: MIT
"""A drive with all its lines, each of which may command it, as the thread serves them. A step is a millisecond."""
import ctypes
import struct

from rigs.axes_at_rest import AxesAtRest
from rigs.can_node import NODE, SDO_IN, SDO_OUT, SIZES
from rigs.console import Keyboard
from rigs.drive import LOOPS_PER_MS
from rigs.modbus_line import crc, framed, long, write, write_one
from rigs.restarting import DELAY_MS, ENOUGH_V, is_on

OWNERS = ("CONSOLE", "MODBUS", "CAN")
NAMES = dict(zip(OWNERS, ("the console", "Modbus", "CAN")))
NUMBERS = dict(zip(OWNERS, (1, 2, 3)))
WORDS = (0x06, 0x07, 0x0F)
MASTER = 0x7F
COMMANDED, STOPPED = 100, 101
LOCAL_CONTROL, BUSY = 0x08000021, 6


class Commanding(Keyboard):
    """`refused` is the reason that the last line gave for what it was told: the number, or on the console its text."""

    def __init__(self, c, **params):
        self.c, rest = c, AxesAtRest(c, 1)
        self.rest, self.axis, self.fabric = rest, rest.axis, rest.fabric
        self.axis.params.can_node, self.axis.params.retry_count, self.axis.params.retry_delay_ms = NODE, 3, DELAY_MS
        for name, value in params.items():
            setattr(self.axis.params, name, value)
        adc = self.fabric.adc
        adc.OFFSET_A = adc.OFFSET_B = adc.OFFSET_C = 32768
        adc.VBUS = self.axis.loop.vbus_q15 = ENOUGH_V
        self.energised, self.live, self.beats = False, True, False
        self._open_lines()
        self.step(5)

    def _open_lines(self):
        c, axes, slots = self.c, self.rest.axes, self.rest.slots
        for name in ("saids", "taken", "heards", "opened", "closed", "state", "cut"):
            getattr(c, f"host_can_{name}").value = 0
        for name in ("heard_bytes", "heard_taken", "sent_bytes", "marks"):
            getattr(c, f"host_bus_{name}").value = 0
        c.host_heard_bytes.value = c.host_heard_taken.value = c.host_said_bytes.value = 0
        self.can, self.canopen, self.rs485, self.modbus = (c.structs["can"](), c.structs["canopen"](), c.rs485(),
                                                           c.structs["modbus"]())
        c.canopen_start(self.canopen, self.can, axes, slots)
        c.modbus_start(self.modbus, self.rs485, axes, slots)
        self.last_run, self.console, session = c.postmortem(), c.console(), c.session()
        self.kept = c.nvm_report()
        session.axis, session.axes, session.last_run = (ctypes.pointer(self.axis), ctypes.pointer(self.axis),
                                                         ctypes.pointer(self.last_run))
        session.slots, session.loaded = slots, ctypes.pointer(self.kept)
        c.console_start(self.console, session)
        self.heard()

    # ---- a millisecond ----

    def thread(self):
        c, axis = self.c, self.axis
        while c.console_poll(self.console):
            pass
        c.modbus_poll(self.modbus)
        c.canopen_poll(self.canopen)
        c.drive_retry(axis)
        while c.drive_prepare(axis):
            pass

    def step(self, ms=1):
        for _ in range(ms):
            if self.beats and self.live and self.axis.time_ms % 20 == 0:
                self.frames((0x700 + MASTER, b"\5"))
            self.thread()
            self.fabric.adc.SEQUENCE += LOOPS_PER_MS
            self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
            self.c.drive_step(self.axis)
            self.energised = self.energised or is_on(self.c, self.axis)
            assert not (self.axis.faults.cause and self.fabric.gate.CONTROL and self.state not in (
                "OPERATION_ENABLED", "QUICK_STOP")), "a latched fault and live gates"
        return self.state

    @property
    def state(self):
        return self.c.name("axis_state", self.axis.state)

    @property
    def fault(self):
        return self.c.name("fault", self.axis.faults.cause)

    @property
    def owner(self):
        return self.c.name("owner", self.axis.owner.who)

    # ---- the lines ----

    def frames(self, *frames):
        """What CAN answers, [(identifier, data)]."""
        c = self.c
        c.host_can_heards.value = 0
        for number, (identifier, data) in enumerate(frames):
            place = c.host_can_said[number]
            place.id, place.count = identifier, len(data)
            place.data[:len(data)] = list(data)
        c.host_can_saids.value, c.host_can_taken.value = len(frames), 0
        c.canopen_poll(self.canopen)
        return [(f.id, bytes(f.data)[:f.count]) for f in c.host_can_heard[:c.host_can_heards.value]]

    def nmt(self, command):
        return self.frames((0, bytes([command, NODE])))

    def sdo(self, index, sub, value, size):
        data = struct.pack(SIZES[size], value & (256 ** size - 1)).ljust(4, b"\0")
        answers = [data for identifier, data in self.frames(
            (SDO_IN, struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + data)) if identifier == SDO_OUT]
        self.refused = struct.unpack("<I", answers[0][4:])[0] if answers and answers[0][0] == 0x80 else 0
        return self.refused == 0

    def read(self, index, sub=0):
        answer = next(data for identifier, data in self.frames(
            (SDO_IN, struct.pack("<BHBI", 0x40, index, sub, 0))) if identifier == SDO_OUT)
        assert answer[0] & 0xE0 == 0x40, answer.hex()
        return int.from_bytes(answer[4:8 - (answer[0] >> 2 & 3)], "little")

    def ask(self, request):
        c = self.c
        ctypes.memmove(c.host_bus_heard, bytes(request), len(request))
        c.host_bus_heard_bytes.value, c.host_bus_heard_taken.value = len(request), 0
        c.modbus_poll(self.modbus)
        reply = bytes(c.host_bus_sent)[:c.host_bus_sent_bytes.value]
        c.host_bus_sent_bytes.value = c.host_bus_heard_bytes.value = c.host_bus_heard_taken.value = 0
        self.rs485.driving = False
        c.modbus_poll(self.modbus)
        assert crc(reply[:-2]) == reply[-2:], reply.hex()
        self.refused = reply[2] if reply[1] & 0x80 else 0
        return self.refused == 0

    def registers(self, at, count=1):
        self.c.host_bus_sent_bytes.value = 0
        request = framed(1, struct.pack(">BHH", 3, at, count))
        ctypes.memmove(self.c.host_bus_heard, request, len(request))
        self.c.host_bus_heard_bytes.value, self.c.host_bus_heard_taken.value = len(request), 0
        self.c.modbus_poll(self.modbus)
        reply = bytes(self.c.host_bus_sent)[:self.c.host_bus_sent_bytes.value]
        self.c.host_bus_sent_bytes.value = self.c.host_bus_heard_bytes.value = self.c.host_bus_heard_taken.value = 0
        self.rs485.driving = False
        return list(struct.unpack(f">{count}H", reply[3:-2]))

    def line(self, text):
        said = self.type(text.encode() + b"\r")
        lines = [one for one in said.split("\r\n") if one.startswith(("error: ", "ok"))]
        self.refused = lines[0] if lines and lines[0] != "ok" else ""
        return self.refused == ""

    def word(self, who, word):
        return self.ask(write_one(0, word)) if who == "MODBUS" else self.sdo(0x6040, 0, word, 2)

    def write(self, who, register, index, value, size):
        if who == "CAN":
            return self.sdo(index, 0, value, size)
        return self.ask(write(register, long(value)) if size == 4 else write_one(register, value))

    # ---- what each line can say ----

    def enable(self, who):
        if who == "CONSOLE":
            return self.line("on")
        return all([self.word(who, word) for word in WORDS])

    def speed(self, who, rpm):
        return self.line(f"speed {rpm}") if who == "CONSOLE" else self.write(who, 2, 0x60FF, rpm, 4)

    def mode(self, who):
        return self.line("torque 0.1") if who == "CONSOLE" else self.write(who, 1, 0x6060, 4, 1)

    def halt(self, who):
        return self.line("speed 0") if who == "CONSOLE" else self.word(who, 0x10F)

    def off(self, who):
        return self.line("off") if who == "CONSOLE" else self.word(who, 0)

    def quick_stop(self, who):
        return self.line("quickstop") if who == "CONSOLE" else self.word(who, 2)

    def clear(self, who):
        self.fabric.gate.STATUS = 0
        return self.line("clear") if who == "CONSOLE" else self.word(who, 0x80)

    def take_over(self, who):
        return self.line("take") if who == "CONSOLE" else self.write(who, 9, 0x2009, NUMBERS[who], 2)

    def refusal(self, who):
        """The number and value that a bus shows."""
        if who == "CAN":
            return self.read(0x202B), self.read(0x202C)
        number, high, low = self.registers(0x2B, 3)
        return number, high << 16 | low

    # ---- ways into a state ----

    def started(self, who, operational=True):
        """Enabled by `who`; on CAN its master is watched."""
        if who == "CAN":
            assert self.sdo(0x1016, 1, MASTER << 16 | 100, 4)
            if operational:
                self.nmt(1)
            self.beats = True
            self.frames((0x700 + MASTER, b"\5"))
        assert self.enable(who), self.refused
        self.step(3)
        assert self.state == "SWITCHED_ON" and self.owner == who
        return self

    def operate(self):
        """As at the end of its start."""
        assert self.c.states_take(self.axis, self.c.DRIVE_EVENT_STARTED)
        self.fabric.gate.CONTROL = 1
        self.step()
        return self

    def turning(self):
        """It has come to speed, so that a stop takes its time."""
        self.axis.speed.ref_rpm_q16 = self.axis.speed.target_rpm_q16 = 1000 << 16
        return self

    def tripped(self):
        self.c.fault_raise(self.axis, self.c.FAULT_UNDERVOLTAGE)
        self.step(3)
        assert self.state == "FAULT"
        self.energised = False
        return self

    def restarted(self):
        self.tripped().step(DELAY_MS + 20)
        assert self.state == "SWITCHED_ON", self.state
        return self.operate()

    def into(self, state):
        if state == "start":
            return self
        self.operate()
        if state == "quick stop":
            self.turning()
            self.c.drive_quick_stop(self.axis)
            self.step(2)
            assert self.state == "QUICK_STOP"
        elif state == "retry":
            self.tripped()
        elif state == "restart":
            self.restarted()
        self.energised = False
        return self


def refused_by_name(w, other, owner):
    if other == "CONSOLE":
        return NAMES[owner] in w.refused and "take" in w.refused
    return w.refused == {"CAN": LOCAL_CONTROL, "MODBUS": BUSY}[other] and w.refusal(other) == (COMMANDED, NUMBERS[owner])
