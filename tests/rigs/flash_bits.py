# SPDX-License-Identifier: MIT
"""The MSS' flash bits of a design, by the rules that eleven public ones show (flash_bits.toml):

    of_board("creative")    {"SOFT_RESET_CR": 0x06097E10, ...}, of this project's own parameters
"""
import os
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "drivers/fabric"))

from libero import board as boards  # noqa: E402  (the path must be set first)
from libero import mss, project, rtl  # noqa: E402

PUBLIC = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
BUILD = (ROOT / os.environ.get("BUILD", "build")).resolve()
BOARDS = ("creative", "sk1")
BY_THE_BOARD = 1 << 8 | 1 << 13 | 1 << 17  # of SOFT_RESET_CR, which docs/silicon.md leaves open: bringup/table.h
FIXED_FACC1 = 1 << 27 | 1 << 26 | 1 << 25  # fed by CLK_BASE, the PLL to be started, PERSIST_CC
CODES = {1: 0, 2: 1, 4: 2, 8: 4, 16: 5, 32: 6}
REMAP_256_KB = 0x11
OURS_SINCE = "2024"  # of the MSS core that system.toml names
APART = ("WATCHDOG",)  # has no bit in SOFT_RESET_CR


def since_11_8(libero):
    return tuple(map(int, libero.split("."))) >= (11, 8)


def soft_reset(design):
    used = set(design["used"]) - set(APART) | set(PUBLIC["ALWAYS"])
    used |= set(PUBLIC["ALWAYS_SINCE_11_8"] if since_11_8(design["libero"]) else ())
    used |= {more for block, others in PUBLIC["WITH"].items() if block in used for more in others}
    unknown = used - set(PUBLIC["BLOCKS"])
    assert not unknown, unknown
    return sum(1 << bit for bit, block in enumerate(PUBLIC["BLOCKS"]) if block not in used)


def facc1(design):
    ratio = design["fic_0"]
    base = CODES[ratio] if ratio else PUBLIC["BASE_DIVISOR_WITHOUT_FIC"]
    ddr = 1 << 8 | design["ddr_divisor_a"] if "MDDR" in design["used"] else 0
    return FIXED_FACC1 | base << 22 | CODES[ratio or 1] << 13 | ddr


def envm(design):
    wait = PUBLIC["FREQRNG"][str(design["m3_mhz"])]
    return REMAP_256_KB | wait << 5 | (wait << 9 if design.get("envms") == 2 else 0)


def words(design):
    """Of what differs from design to design; a design whose clock is not known has no ENVM_CR."""
    found = {"SOFT_RESET_CR": soft_reset(design), "MSSDDR_FACC1_CR": facc1(design)}
    found["WDOG_CR"] = int("WATCHDOG" in design["used"])
    return found | ({"ENVM_CR": envm(design)} if "m3_mhz" in design else {})


def alike(on):
    """Of what public designs have alike, with the bits that this project's parameters ask to be otherwise."""
    found = dict(PUBLIC["alike"])
    edac, ccc, switch, gpio, watchdog = (on[name] for name in ("EDAC", "CCC", "SWITCH", "GPIO", "WATCHDOG"))
    found["EDAC_CR"] |= sum(1 << n for n in (0, 1) if edac[f"EDAC_ENABLE_ESRAM{n}_EDAC_EN"] == "true")
    locks = ("MPLL_LOCK_EN", "MPLL_LOCK_LOST_EN", "FAB_PLL_LOCK_EN", "FAB_PLL_LOCK_LOST_EN")
    found["PLL_LOCK_EN_CR"] |= sum(1 << bit for bit, name in enumerate(locks) if ccc[name] == "true")
    found["MASTER_WEIGHT0_CR"] = found["MASTER_WEIGHT0_CR"] & ~0x1F | int(switch["SW_WEIGHT_IC"]) % 32
    found["MSS_GPIO_DEF"] &= ~int(gpio["GPIO_7_0_SET_RESET_VAL"] == "RESET_STATE_0")
    return found | {"WDOGLOAD": int(watchdog["WDOG_LOAD"], 0), "WDOGMVRP": int(watchdog["WDOG_MVRP"], 0)}


def of_board(name):
    """What `make libero` asks of Libero; before the System Controller has touched any of it."""
    system = project.toml("system.toml")
    use = boards.Use(boards.load(name), rtl.read(boards.load(name)["axes"], BUILD / "fabric"))
    on, off = mss.blocks(system, use)
    used = [block for block in ("GPIO", "WATCHDOG", "MMUART_0", "MMUART_1", "CAN") if block not in off]
    ccc = on["CCC"]
    assert ccc["FCLK_PCLK0_DIVISOR"] == ccc["FCLK_PCLK1_DIVISOR"] == "1" and on["CM3"]["MPU_USED"] == "true"
    return alike(on) | words({"libero": OURS_SINCE, "m3_mhz": round(float(ccc["FCLK_FREQ"])), "used": used,
                              "fic_0": int(ccc["FIC32_0_DIVISOR"])})


def at_start(flash):
    """What a program finds after power-on: the System Controller has started the PLL and released the fabric."""
    return flash | {"SOFT_RESET_CR": flash["SOFT_RESET_CR"] & ~(1 << 16),
                    "MSSDDR_FACC1_CR": flash["MSSDDR_FACC1_CR"] & ~(1 << 26)}
