# SPDX-License-Identifier: MIT
"""The INIT of a CCC that a pad feeds is that of one which the RC oscillator feeds, with the pad in its place. Which bits say so
is in the flash-bit reports of public designs, and the Creative Board's own demo shows its settings in words."""
from rigs import flash_bits

SYSTEM = flash_bits.project.toml("system.toml")
# INIT from its lowest bit on, up to what is used here
FIELDS = {"RFDIV": 8, "FBDIV": 14, "GPD0": 8, "GPD1": 8, "GPD2": 8, "GPD3": 8, "RFMUX": 4, "FBMUX": 4, "GPMUX0": 5,
          "GPMUX1": 5, "GPMUX2": 5, "GPMUX3": 5, "NGMUX": 40, "GPD_SYNC": 4, "INVRF": 6,
          "PDLY": 7, "LOCKWIN": 3, "LOCKCNT": 4, "DIVQ": 3, "MODE32K": 1, "MODE_1V2": 1, "MODE_3V3": 1,
          "FSE": 1, "SSE": 1, "SSMD": 2, "SSMF": 5, "DIVR": 6, "DIVF": 8, "RANGE": 4}
RC, PAD_0, PAD_1 = 11, 0, 1
# mjijeesh/m2s-fabric-ip 4b8f68e: pad 0, 50 MHz, VCO 800 MHz, GL0 at 50, GL2 at 100 MHz; its report has the registers
DEMO = "0000007FB8000044D74000F18C2718C231839DC00404040800301"
REPORT = {"RFMUX": 0x00, "RFDIV": 0x01, "FBMUX": 0x07, "FBDIV": 0x03, "GPD0": 0x02, "GPD1": 0x01, "LOCKWIN": 6, "LOCKCNT": 5,
          "DIVQ": 3, "DIVR": 0, "DIVF": 0, "RANGE": 7, "SSMD": 1, "SSMF": 0, "FSE": 0}
# of other public designs: how each CCC is fed
FED = {"0000007FB8000045174000318C6318C1F18C61C00404040400101": PAD_0,
       "0000007FB8000044D74000318C6318C1F18C61C40404040400303": PAD_1,
       "0000007FB8000044D74000318C6307C1F18C61EC0404040400301": RC}


def fields(init):
    bits, found = int(init, 16), {}
    for name, width in FIELDS.items():
        found[name] = bits & (1 << width) - 1
        bits >>= width
    return found | {"above": bits}


def test_the_fields_are_those_of_the_reports():
    assert REPORT.items() <= fields(DEMO).items()
    assert {init: fields(init)["RFMUX"] for init in FED} == FED


def test_only_the_source_differs():
    ours, own = fields(SYSTEM["instance"]["CCC_0"]["params"]["INIT"]), fields(SYSTEM["pad"]["CCC_0"]["INIT"])
    assert {name: (ours[name], own[name]) for name in ours if ours[name] != own[name]} == {"RFMUX": (RC, PAD_0)}
    assert {name: fields(DEMO)[name] for name in REPORT if name != "GPD0"} == {
        name: own[name] for name in REPORT if name != "GPD0"}, "the demo's GL0 has half the rate"


def test_the_board_with_an_oscillator_takes_it():
    assert [name for name in flash_bits.BOARDS if "clock" in flash_bits.boards.load(name)] == ["creative"]
