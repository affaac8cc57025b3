# SPDX-License-Identifier: MIT
"""A drive in operation, in any mode, as in the midst of it."""
from rigs.drive import World

MODES = ("SPEED", "TORQUE", "POSITION", "HOMING", "CYCLIC_POSITION", "CYCLIC_SPEED", "CYCLIC_TORQUE")
# request: the mode that it brings about, and a value that is allowed
REQUESTS = {"speed": ("SPEED", 500), "current": ("TORQUE", 1000), "position": ("POSITION", 4000, False),
            "home": ("HOMING", 0), "cyclic_position": ("CYCLIC_POSITION", 10), "cyclic_speed": ("CYCLIC_SPEED", 500),
            "cyclic_current": ("CYCLIC_TORQUE", 1000)}


class Drive(World):
    """A world in operation, in a mode as in the midst of it: it turns at some speed and makes some torque."""
    def __init__(self, c, mode="SPEED", rpm=300, torque_q15=900, **params):
        super().__init__(c, **params)
        self.c.tuning_compute(self.axis.params, self.axis.tuning)
        self.c.torque_build(self.axis.torque, self.axis.params, self.axis.tuning, 14000)
        self.c.speed_loop_tune(self.axis.speed, self.axis.tuning)
        self.axis.loop.radius_q15 = 7300
        self.put("OPERATION_ENABLED")
        self.turn(rpm)
        self.axis.torque_command_q15 = self.axis.torque.torque_q15 = torque_q15
        c.speed_loop_reset(self.axis.speed, torque_q15)
        self.axis.motion.turns.counts = 10**12 + 7
        c.modes_limit_torque(self.axis)
        if mode != "SPEED":
            c.modes_enter(self.axis, self.mode_code(mode))
            if mode == "HOMING":
                c.homing_begin(self.axis.motion.homing, c.HOMING_INDEX, self.axis.motion.turns)

    def mode_code(self, mode):
        return self.c.enums["axis_mode"]["AXIS_MODE_" + mode]

    def turn(self, rpm):
        self.axis.speed.estimate.speed_rpm_q15 = self.axis.speed.estimate.travel_q15 = rpm << 15
        self.axis.speed.estimate.interval_clocks = 1000
        self.axis.speed.speed_rpm_q4 = rpm * 16

    def request(self, name):
        return self.command(name, *REQUESTS[name][1:])

    def command(self, name, *values):
        """A set-point, and what the slow loop's next step begins with."""
        error = getattr(self.c, "drive_command_" + name)(self.axis, *values).error
        self.c.set_point_take(self.axis)
        return error

    def learn(self):
        error = self.c.drive_learn_cogging(self.axis).error
        self.c.set_point_take(self.axis)
        return error

    def control(self):
        """One step of the mode alone, with the speed as it is."""
        self.axis.time_ms += 1
        self.c.modes_step(self.axis)
        self.c.reaction_step(self.axis)
        return self.axis.torque.torque_q15
