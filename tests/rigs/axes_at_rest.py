# SPDX-License-Identifier: MIT
"""Drives at rest for a bus to find: each with a fabric and settings of its own."""
import ctypes

from rigs.drive import at_rest
from rows import objects, param_rows

SLOTS_BYTES = 2 * 4096  # of one axis; a further one's stand in front of the first's
# {name: (register, index in CANopen or 0, bytes, writable)}
OBJECTS = {name: (at, place >> 8, int(kind[1:]) // 8, access == "RW") for at, place, kind, access, name, *_ in objects()}
PARAMS = param_rows()
# of the line itself: the first axis' count
OF_THE_LINE = [name for name in PARAMS if name.startswith(("can_", "modbus_"))]
# alike in every drive of one firmware
ALIKE = {"device_type", "vendor", "product", "revision", "serial", "map_version", "parameter_count", "store", "restore"}


class AxesAtRest:
    """`axes`, the first of which is `axis`; `slots` is where each stores."""

    def __init__(self, c, count):
        self.c, self.fabrics, self.axes = c, (c.fabric * count)(), (c.axis * count)()
        self.fabric, self.axis = self.fabrics[0], self.axes[0]
        for axis, fabric in zip(self.axes, self.fabrics):
            at_rest(c, axis, fabric)
            axis.time_ms = 1000
        if count > 1:
            c.drive_link(*self.axes)
        c.host_envm_new(self.axis, 8e-3, 1)
        found = [c.host_slots() for _ in self.axes]
        for n, one in enumerate(found):
            one.offset_bytes -= n * SLOTS_BYTES
            one.memory = ctypes.cast(ctypes.addressof(c.host_bench.envm.array) + one.offset_bytes, type(one.memory))
        self.slots = (c.structs["slots"] * count)(*found)
        if count > 1:  # saving waits for each axis' own clock
            self.hook = ctypes.CFUNCTYPE(None)(self._sleep)
            ctypes.c_void_p.in_dll(c._library, "host_on_sleep").value = ctypes.cast(self.hook, ctypes.c_void_p).value

    def others(self):
        """All of the axes beside `axis`, but what time it is."""
        found = []
        for axis in self.axes:
            if ctypes.addressof(axis) != ctypes.addressof(self.axis):
                copy = type(axis).from_buffer_copy(axis)
                copy.time_ms = 0
                found.append(bytes(copy))
        return found

    def pass_ms(self):
        for axis in self.axes:
            axis.time_ms += 1

    def _sleep(self):
        self.pass_ms()
        self.c.host_bench.now += 10**9


def fill(c, axis, drive, seed):
    """All that a bus shows; with another seed all but ALIKE is another number."""
    for name, (least, most, _) in PARAMS.items():
        if name not in OF_THE_LINE:
            setattr(axis.params, name, least + seed % (most - least + 1))
    axis.params.i_range_ma, axis.params.v_range_mv, axis.params.i_rated_ma = 32768 + seed, 65536 + seed, 4000 + seed
    for fault in range(c.FAULT_COUNT):
        axis.reactions.choice[fault] = (fault + seed) % 4
    axis.speed.speed_rpm_q4, axis.speed.speed_ref_rpm_q4 = 1600 * seed, 800 * seed
    axis.loop.i_d_q15, axis.loop.i_q_q15, axis.loop.vbus_q15 = 100 * seed, 300 * seed, 5000 * seed
    axis.motion.turns.counts, axis.motion.position.error_counts = 7 * seed, 3 * seed
    axis.thermal.winding_q4, axis.thermal.factor_q15 = 320 * seed, 9000 * seed
    axis.reports.warned[0], axis.reports.warned[1], axis.time_ms = seed, 2 * seed, 9000 * seed
    axis.mode = (c.AXIS_MODE_POSITION, c.AXIS_MODE_CYCLIC_POSITION)[seed % 2]
    axis.tuning.angle_source, axis.state = seed % 2, (c.AXIS_FAULT, c.AXIS_OPERATION_ENABLED)[seed % 2]
    axis.owner.who = seed
    axis.faults.cause, axis.faults.count = (c.FAULT_OVERVOLTAGE, c.FAULT_ENCODER_DEAD)[seed % 2], seed
    for at in range(2):
        axis.faults.detail[at] = 11 * seed + at
    for name, *_ in axis.faults.snapshot._fields_:
        setattr(axis.faults.snapshot, name, 2000 * seed)
    drive.cia402.refusal.error, drive.cia402.refusal.value = seed, 5 * seed
    points = drive.cia402.setpoints
    points.control_word, points.mode, points.homing_method = seed, (1, 3)[seed % 2], (37, 34)[seed % 2]
    points.target_rpm, points.target_counts, points.target_torque_pm = 10 * seed, 20 * seed, 30 * seed
