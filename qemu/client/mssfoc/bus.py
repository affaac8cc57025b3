# SPDX-License-Identifier: MIT
"""A drive by the words of CiA 402, which Modbus and CAN share (docs/modbus.md): modbus.py and can.py carry them."""
import time

from .drive import ANSWER_S, LOOK_S, OPERATES, REACTS, STOPS, Drive, Fault, Status
from .errors import Error, Refused
from .registers import Registers
from .texts import Parameter

SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, RESET = 0x06, 0x07, 0x0F, 0x02, 0x80
SET_POINT, RELATIVE = 0x10, 0x40
REFUSED, REACHED, TAKEN = 1 << 8, 1 << 10, 1 << 12
PP, PV, TQ, HM, CSP, CSV, CST = 1, 3, 4, 6, 8, 9, 10
SERVO_DRIVE, SEVERAL = 0x00020192, 0xFFFF0192  # object 0x1000; of a CAN node with two axes
CYCLIC = {"csp": (CSP, "target_position"), "csv": (CSV, "target_velocity"), "cst": (CST, "target_torque")}
METHODS = {"index": 34, "block": -1}
LINES, COMMANDED = {1: "the console", 2: "Modbus", 3: "CAN"}, 100  # object `owner`; the refusal of another's command
SAVE = int.from_bytes(b"save", "little")
# (mask, value) of the status word -> state
STATES = {(0x4F, 0x40): "switch on disabled", (0x6F, 0x21): "ready to switch on", (0x6F, 0x23): "switched on",
          (0x6F, 0x27): OPERATES, (0x6F, 0x07): STOPS, (0x4F, 0x0F): REACTS, (0x4F, 0x08): "fault"}


class BusDrive(Drive):
    """`line` has read(entry), write(entry, value), close(), second(); registers: a file, or what the package has."""

    def __init__(self, line, registers=None):
        self._line, self._mode, self._rated_a = line, 0, 0.0
        try:
            self._registers = registers if isinstance(registers, Registers) else Registers(registers)
            self._see_whose_list()
        except BaseException:
            line.close()
            raise

    def _see_whose_list(self):
        """Parameters are found by their place in the list: that of another firmware would have others there."""
        if self._read("device_type") not in (SERVO_DRIVE, SEVERAL):
            raise Refused("what answers there is no servo drive of CiA 402")
        count = self._read("parameter_count")
        if count != len(self._registers.parameters):
            raise Refused(f"the drive has {count} parameters and the list {len(self._registers.parameters)}: it is of another "
                          "version; `make client` beside the drive's image writes the right one, for registers=")

    def _make_second(self):
        return BusDrive(self._line.second(), self._registers)

    def close(self):
        if self._first is None or self._first is self:
            self._watch.end()
        self._line.close()

    def _feed(self):
        self._read("status_word")

    def _up_s(self):
        return self._read("uptime")

    # ---- objects ----

    def _read(self, name):
        return self._line.read(self._registers.objects[name])

    def read(self, name):
        """The value of any object of docs/modbus.md, in A, V, rpm, %, deg or as it is."""
        if name not in self._registers.objects:
            raise Refused(f"there is no object '{name}'")
        entry = self._registers.objects[name]
        return entry.scaled(self._line.read(entry))

    def _write(self, name, value):
        entry = self._registers.objects[name]
        least = -(1 << entry.bits - 1) if entry.signed else 0
        most = least + (1 << entry.bits) - 1
        if int(value) != value or not least <= value <= most:
            raise Refused(f"{name} is a whole number, {least}...{most}, not {value}")
        try:
            self._line.write(entry, int(value))
        except Refused:
            if self._read("refusal") == COMMANDED:  # by whom
                self._see_refusal()
            raise

    # ---- what drive.py asks for ----

    def _command(self, word, value=None):
        getattr(self, f"_{word.replace(' ', '_')}")(*(() if value is None else (value,)))
        self._see_refusal()

    def _see_refusal(self):
        """A word acts after its answer: what it came to shows from the next look on."""
        time.sleep(LOOK_S)
        if self._read("status_word") & REFUSED:
            number, value = self._read("refusal"), self._read("refusal_value")
            text = self._registers.refusals.get(number, f"refusal {number}")
            raise Refused(text.replace("@", str(value)).replace("&", LINES.get(value, "another line")))

    def _word(self, *words):
        for word in words:
            self._write("control_word", word)

    def _on(self):
        """As the console's: at rest at first, whatever was asked before."""
        self._rated_a = 0.0  # parameters may have changed
        self._target(PV, target_velocity=0)
        for word, state in ((SHUTDOWN, "ready to switch on"), (SWITCH_ON, "switched on")):
            if self.state() != OPERATES:
                self._word(word)
                self._see_refusal()
                self.wait(lambda wanted=state: self.state() == wanted, f"it is not {state}", ANSWER_S)
        self._word(ENABLE)

    _line_name = property(lambda self: self._line.owner)

    def _commander(self):
        return self._read("owner") or None

    def _take(self):
        self._write("owner", self._line.owner)

    def _off(self):
        self._word(0)

    def _quickstop(self):
        self._word(QUICK_STOP)

    def _clear(self):
        """Not before a controlled stop has ended: the first of these words would end it."""
        self.wait(lambda: self.state() not in (STOPS, REACTS), "it does not come to rest", faults=False)
        self._word(0, RESET, 0)

    def _target(self, mode, **targets):
        """A mode begins with the target that is there: that comes first."""
        for name, value in targets.items():
            self._write(name, value)
        if self._read("mode") != mode:
            self._write("mode", mode)
        self._mode = mode

    def _of_rated(self, ampere):
        self._rated_a = self._rated_a or self.read("rated_current")
        return round(1000 * ampere / self._rated_a)

    def _in_operation(self):
        if self.state() != OPERATES:
            raise Refused("the drive is not in operation; use on()")

    def _speed(self, rpm):
        self._in_operation()
        self._target(PV, target_velocity=rpm)

    def _torque(self, ampere):
        self._in_operation()
        self._target(TQ, target_torque=self._of_rated(ampere))

    def _pp(self, counts, relative=0):
        self._in_operation()
        self._target(PP, target_position=counts)
        self._word(ENABLE, ENABLE | SET_POINT | relative)
        self.wait(lambda: self._read("status_word") & (TAKEN | REFUSED), "the target was not taken", ANSWER_S)
        self._see_refusal()
        self._word(ENABLE | relative)

    def _pp_by(self, counts):
        self._pp(counts, RELATIVE)

    def _hm(self, method):
        if method not in METHODS:
            raise Refused(f"homing is to {' or '.join(METHODS)}, not {method}")
        self._in_operation()
        self._target(HM, homing_method=METHODS[method])
        self._word(ENABLE, ENABLE | SET_POINT)

    def _cyclic(self, word, value):
        """Nothing but the set-point, once the mode is there: they come in a row."""
        mode, target = CYCLIC[word]
        if word == "cst":
            value = self._of_rated(value)
        if self._mode == mode:
            self._write(target, value)
        else:
            self._in_operation()
            self._target(mode, **{target: value})

    def _arrived(self):
        word = self._read("status_word")
        if _state(word) != OPERATES and not self.fault():
            raise Error(f"it has ended in another state: {_state(word)}")
        done = REACHED | (TAKEN if self._read("mode_display") == HM else 0)
        return word & done == done

    def state(self):
        return _state(self._read("status_word"))

    def status(self):
        return Status(self.state(), self.read("velocity"), self.read("velocity_demand"), self._read("position"),
                      self.read("current_d"), self.read("current_q"), self.read("bus_voltage"))

    def fault(self):
        """What is latched, or None."""
        number = self._read("fault")
        if not number:
            return None
        record = {name.removeprefix("fault_"): self.read(name) for name in self._registers.objects if name.startswith("fault_")}
        return Fault(self._registers.faults.get(number, f"fault {number}"), record)

    def parameters(self, names=None):
        """{name: Parameter}, all of them or those that are named."""
        known = self._registers.parameters
        return {name: Parameter(name, self._line.read(entry), entry.unit, entry.least, entry.most)
                for name, entry in known.items() if names is None or name in names}

    def _names(self):
        return self._registers.parameters

    def _set(self, name, value):
        self._line.write(self._registers.parameters[name], value)

    def _save(self):
        self._write("store", SAVE)


def _state(word):
    return next((state for (mask, value), state in STATES.items() if word & mask == value), "not ready")
