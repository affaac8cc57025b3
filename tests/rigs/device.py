# SPDX-License-Identifier: MIT
"""The registers of a healthy device at their own addresses, and what is in RAM after power-on."""
import ctypes

from unit.register_pages import PAGES

SYSREG, TIMER, WATCHDOG, DWT, NVIC, SCB, MPU, FABRIC = (
    0x40038000, 0x40004000, 0x40005000, 0xE0001000, 0xE000E100, 0xE000ED00, 0xE000ED90, 0x50000000)
KEY, LOAD = 0xAC15DE42, 0x6000003F


class Device:
    """The registers of a healthy device, and what is in RAM after power-on."""

    def __init__(self, system):
        for page in PAGES:
            ctypes.memset(page, 0, 4096)
        self.c = system
        self.sysreg = system.sysreg_regs.from_address(SYSREG)
        self.timer = system.mss_timer_regs.from_address(TIMER)
        self.watchdog = system.watchdog_regs.from_address(WATCHDOG)
        self.nvic, self.scb = system.nvic_regs.from_address(NVIC), system.scb_regs.from_address(SCB)
        self.mpu, self.fabric = system.mpu_regs.from_address(MPU), system.fabric.from_address(FABRIC)
        self.dwt = system.dwt_regs.from_address(DWT)
        self.sysreg.MSSDDR_PLL_STATUS = 3
        self.watchdog.WDOGENABLE, self.watchdog.WDOGLOAD = 1, LOAD
        self.mpu.TYPE = 8 << 8
        self.fabric.gate.ID = 0x464F4332
        system.postmortem_collect()  # forgets the test before

    def fault(self):
        return self.name(self.c.device_fault())

    def name(self, cause):
        return self.c.name("fault", cause)

    def boot(self):
        """(boot_check()'s fault, how the last life ended)."""
        last = self.c.postmortem()
        return self.name(self.c.boot_check(self.fabric, last)), last
