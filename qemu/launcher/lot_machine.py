# SPDX-License-Identifier: MIT
"""A machine from the dimensions of its air gap, by the laws of docs/lots.md, so that its values belong together."""
import math
from dataclasses import dataclass, replace

from .consistency import most_torque_nm

MU0, COPPER, COPPER_TEMPCO = 4e-7 * math.pi, 1.72e-8, 3.9e-3
STEEL_KG_M3, COPPER_KG_M3 = 7650.0, 8900.0
TEETH_T, YOKE_T = 1.7, 1.5
CYCLE_J_KG, EDDY_W = 0.02, 6e-5  # at 1.5 T; of 0.5 mm, over Hz^2 T^2
OVERLOAD = 1.5                   # i_max by rated current: rules.py
IRON_SHARE = 0.5                 # of the heat, at most
LARGEST_J_A_M2 = 25e6


@dataclass(frozen=True)
class Shape:
    """Dimensions in metres; areas and masses of one machine."""
    bore: float
    length: float
    pole_pairs: int
    slots: float       # a pole and phase
    gap: float
    magnet: float      # thickness
    flux_t: float
    winding_factor: float
    copper_m2: float   # all slots
    turn: float        # mean length of half a turn
    surface_m2: float
    iron_kg: float
    rotor: float       # thickness of an outer rotor's ring


@dataclass(frozen=True)
class Built:
    """Values of one phase of a star, peak, with `turns` in series; `rise_k` at rated current and speed."""
    shape: Shape
    turns: float
    flux_wb: float
    resistance_ohm: float
    ld_h: float
    lq_h: float
    current_a: float
    speed_rpm: float
    rise_k: float
    thermal_k_w: float
    heat_j_k: float
    hysteresis_nm: float
    eddy_nms: float
    inertia_kgm2: float

    @property
    def torque_nm(self):
        """Of the linear machine at rated current, with the best i_d."""
        return most_torque_nm(self.shape.pole_pairs, self.flux_wb, self.lq_h - self.ld_h, self.current_a)

    def wound(self, turns):
        """With other turns of the same copper: the same torque and heat from another voltage."""
        by = turns / self.turns
        return replace(self, turns=turns, flux_wb=self.flux_wb * by, resistance_ohm=self.resistance_ohm * by**2,
                       ld_h=self.ld_h * by**2, lq_h=self.lq_h * by**2, current_a=self.current_a / by)


def built(kind, draw):
    """A machine of a kind, with one turn: wound() it for its voltage."""
    shape = _shape(kind, draw)
    rise_k, thermal_k_w = draw.between("rise", 60, 130), 1 / (draw.log("cooling", *kind.cooling_w_m2k) * shape.surface_m2)
    speed_rad_s, hysteresis_nm, eddy_nms = _iron(kind, draw, shape, rise_k / thermal_k_w)
    copper_w = rise_k / thermal_k_w - hysteresis_nm * speed_rad_s - eddy_nms * speed_rad_s**2
    hot = COPPER * (1 + COPPER_TEMPCO * rise_k)
    density = min(math.sqrt(copper_w / (hot * shape.copper_m2 * shape.turn)), LARGEST_J_A_M2)
    current_a = math.sqrt(2) * density * draw.between("rated", *kind.rated) * shape.copper_m2 / 6
    resistance_ohm = 12 * COPPER * shape.turn / shape.copper_m2  # two half turns, of a sixth of the copper each
    shape, ld_h, lq_h = _inductances(kind, draw, shape, current_a)
    heat_j_k = 430 * shape.iron_kg + 390 * COPPER_KG_M3 * shape.copper_m2 * shape.turn
    return Built(shape, 1.0, _flux(shape), resistance_ohm, ld_h, lq_h, current_a, speed_rad_s * 30 / math.pi, rise_k,
                 thermal_k_w, heat_j_k, hysteresis_nm, eddy_nms, _inertia(kind, draw, shape))


def _shape(kind, draw):
    bore = draw.log("bore", *kind.bore_m)
    length, pairs = bore * draw.log("slimness", *kind.slimness), draw.pick("pole pairs", kind.pole_pairs)
    slots, pitch = draw.pick("slots", kind.slots), math.pi * bore / (2 * pairs)
    gap = (0.15e-3 + 0.004 * bore) * (draw.between("gap", 0.5, 1.2) if kind.buried else draw.between("gap", 0.8, 1.3))
    magnet = 0.3 * bore if kind.slotless else gap * draw.between("magnet", 3, 7)
    flux_t = _field_t(kind, draw, gap, magnet)
    winding, depth = _winding(kind, draw, bore, flux_t, (0.32, 0.48) if slots >= 1 else (0.25, 0.42))
    yoke = max(flux_t, 0.6) * pitch / math.pi / YOKE_T
    overhang = draw.between("ends", 1.2, 1.7) * pitch / (1 if slots >= 1 else 3 * slots)
    turn, ring = length + overhang, magnet + yoke
    outside = bore + 2.1 * (ring if kind.outer else depth + yoke)
    surface = math.pi * outside * 1.2 * turn + math.pi / 2 * outside**2
    teeth = 0.0 if kind.slotless else min(max(flux_t, 0.6) / TEETH_T, 0.65) * math.pi * bore * depth
    iron_kg = STEEL_KG_M3 * length * (teeth + math.pi * (bore + depth) * yoke * (0.7 if kind.outer else 1.2))
    return Shape(bore, length, pairs, slots, gap, magnet, flux_t, 0.93 if slots < 1 else 0.95, winding, turn, surface, iron_kg,
                 ring)


def _field_t(kind, draw, gap, magnet):
    if kind.slotless:
        return draw.between("field", 0.4, 0.65)
    if kind.buried:
        return draw.between("field", 0.45, 0.85)
    remanence_t, leakage = draw.between("remanence", 1.0, 1.25), draw.between("leakage", 0.72, 0.92)
    return 1.15 * leakage * remanence_t * magnet / (magnet + 1.1 * gap)


def _winding(kind, draw, bore, flux_t, fill):
    """(copper of all slots, depth of a slot)."""
    if kind.slotless:
        depth = draw.between("depth", 0.06, 0.11) * bore
        return draw.between("fill", 0.3, 0.5) * math.pi * bore * depth, depth
    depth = draw.between("depth", 0.1, 0.21) * bore
    open_share = 1 - min(max(flux_t, 0.6) / TEETH_T, 0.65)
    middle = bore - depth if kind.outer else bore + depth
    return draw.between("fill", *fill) * open_share * math.pi * middle * depth, depth


def _iron(kind, draw, shape, heat_w):
    """(rated speed in rad/s, hysteresis as torque, eddy currents as torque over speed)."""
    worked, pairs = draw.log("processing", 1.2, 4.0), shape.pole_pairs
    sheet_mm, share = draw.pick("sheet", kind.sheet_mm), 0.4 if kind.slotless else 1.0
    hysteresis_nm = share * worked * CYCLE_J_KG * shape.iron_kg * pairs / (2 * math.pi)
    eddy_nms = share * worked * EDDY_W * YOKE_T**2 * (sheet_mm / 0.5)**2 * shape.iron_kg * (pairs / (2 * math.pi))**2
    wanted = draw.log("speed", *kind.speed_m_s) * 2 / shape.bore
    allowed_w = IRON_SHARE * heat_w
    root = math.sqrt(hysteresis_nm**2 + 4 * eddy_nms * allowed_w)
    return min(wanted, (root - hysteresis_nm) / (2 * eddy_nms)), hysteresis_nm, eddy_nms


def _flux(shape):
    return shape.winding_factor * shape.flux_t * shape.bore * shape.length / shape.pole_pairs


def _inductances(kind, draw, shape, current_a):
    """(shape, L_d, L_q) of one turn; buried magnets are made weaker where L_q would need a narrower gap than there is."""
    per_gap = 3 / math.pi * MU0 * shape.winding_factor**2 * shape.bore * shape.length / shape.pole_pairs**2
    lambdas = draw.between("leakage path", 1.5, 4) if shape.slots < 1 else draw.between("leakage path", 1.2, 2.5)
    leakage = 2 * MU0 * shape.length * lambdas / (shape.pole_pairs * shape.slots)
    if kind.slotless:
        mean = per_gap / (shape.gap + 0.08 * shape.bore + shape.magnet) + leakage / 8
        return shape, mean, mean
    if not kind.buried:
        mean = per_gap / (shape.gap + shape.magnet / 1.05) + leakage
        return shape, mean, mean * _salient(kind, draw)
    ld_h = per_gap / (1.1 * shape.gap + draw.between("d path", 0.8, 1.6) * shape.magnet) + leakage
    wanted = draw.log("characteristic", *kind.buried) * OVERLOAD * current_a
    most = per_gap / (1.15 * shape.gap) + leakage - ld_h
    difference = _flux(shape) / wanted
    if difference > most:
        shape, difference = replace(shape, flux_t=shape.flux_t * most / difference), most
    return shape, ld_h, ld_h + difference


def _salient(kind, draw):
    """Surface magnets have next to none; on an outer rotor's iron the published have up to 1.8."""
    return draw.log("saliency", 0.97, 1.8) if kind.outer else draw.between("saliency", 0.97, 1.1)


def _inertia(kind, draw, shape):
    heavier = draw.between("heavier", *kind.heavier)
    if kind.outer:
        return heavier * math.pi / 4 * STEEL_KG_M3 * 1.3 * shape.length * shape.rotor * (shape.bore + shape.rotor)**3
    rotor = shape.bore * 0.9 - 2 * shape.gap if kind.slotless else shape.bore - 2 * shape.gap
    return heavier * math.pi / 32 * STEEL_KG_M3 * (shape.length * 1.1) * rotor**4
