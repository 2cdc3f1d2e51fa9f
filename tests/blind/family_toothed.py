"""Blind plants that are hdsim's own toothed drive, held against a lumped base.

The lumped base has the catalogue's secant stiffnesses, which the toothed drive has too, its teeth, gap and
structure together. Hidden is the gap of the rough flanks (the Weierstrass-Mandelbrot half-gaps of every
tooth, 0.5 to 3 times the nominal ones, other flanks for every seed), an effect of the catalogue in a drive
whose teeth have no gap, or both. Without a gap and with linear contact the teeth are the null: their
parting and meeting remains, far below the noise.

Strength: hdsim's toothed drive with and without what is hidden, both along the motor motion of the plant
without it under its controller; least squares take out offsets and the sensitivities of the lumped base's
own numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from contract import Case, Kind, Measured
from drawing import (
    SENSORS,
    SKIP_S,
    Drive,
    Sensing,
    Try,
    base_yaml,
    draw_drive,
    draw_lengths,
    draw_parameters,
    draw_sensing,
    first_near,
    kind_of,
    log_uniform,
    off,
    said,
    slower,
    visible,
)
from moving import MOTIONS
from toothed_plant import LOG_HZ, STANDING_S, TOLD_HZ, Effects, Teeth, Told, followed, simulate, told

from hdsim.errors import PhysicsError
from hdsim.simulation.run import RunFailed

FAMILY = "toothed"
KINDS: tuple[Kind, ...] = ("null", "effect", "effect", "parameter", "effect", "pair", "effect", "effect")
STRENGTH_S = 8.0
TRIES, STEPS, TOLERANCE, CHANGE = 3, 4, 0.12, 0.02
STRENGTHS = (0.5, 100.0)
#: Half-gaps over the nominal ones.
GAPS = (0.5, 3.0)


@dataclass(frozen=True)
class Hidden:
    """An effect of the catalogue: its settings at a size, largest size, the channel it needs, if any."""

    name: str
    most: float
    needs: str = ""
    loaded: bool = False

    def settings(self, d: Drive, r: list[float], x: float) -> dict[str, Any]:
        """The effect's fields."""
        minute = 0.1 * x
        twist = d.torques[0] / d.stiffness[0]
        if self.name == "kinematic_error":
            sizes = (1.0, 0.3 + 0.5 * r[0], 0.3)
            kinds = ("wave_generator_turn", "relative_turn", "wave_generator_turn")
            return {
                "components": [
                    {
                        "order": order,
                        "amplitude_arcmin": minute * size,
                        "per": per,
                        "phase_deg": 360.0 * phase,
                    }
                    for order, size, per, phase in zip((2, 2, 4), sizes, kinds, r[1:4], strict=True)
                ]
            }
        return {
            "torsional_hysteresis_maxwell": {"slip_torque_nm": 0.1 * d.torques[0] * x},
            "torsional_hysteresis_duhem": {
                "saturation_torque_nm": 0.1 * d.torques[0] * x,
                "saturation_twist_mrad": 1e3 * twist * (0.15 + 0.4 * r[0]),
            },
            "motor_torque_ripple": {
                "components": [
                    {
                        "order": (6.0, 12.0)[int(2 * r[0])],
                        "cogging_nm": 0.15 * d.coulomb * x,
                        "phase_deg": 360.0 * r[1],
                    }
                ]
            },
            "stribeck_friction": {
                "extra_static_nm": 0.3 * d.coulomb * x,
                "stribeck_velocity_rad_per_s": 3 + 6 * r[0],
            },
            "load_side_friction": {
                "coulomb_nm": 0.1 * d.torques[0] * x,
                "viscous_nm_s_per_rad": 0.05 * d.torques[0] * x * abs(d.ratio) / d.top_speed,
            },
            "damaged_tooth": {
                "amplitude_arcmin": -2 * minute,
                "position_deg": 180.0 * r[0],
                "width_deg": 6 + 8 * r[1],
            },
        }[self.name]


EFFECTS = (
    Hidden("kinematic_error", 60, "output_angle"),
    Hidden("stribeck_friction", 6),
    Hidden("torsional_hysteresis_maxwell", 10, "output_angle", loaded=True),
    Hidden("motor_torque_ripple", 40),
    Hidden("damaged_tooth", 60, "output_angle"),
    Hidden("load_side_friction", 10),
    Hidden("torsional_hysteresis_duhem", 10, "output_angle", loaded=True),
)
HYSTERESIS = frozenset({"torsional_hysteresis_duhem", "torsional_hysteresis_maxwell"})
GAP = frozenset({"output_backlash"})


class Visibility:
    """Strengths in one experiment: see the module."""

    def __init__(self, base: str, d: Drive, sensing: Sensing, given: Told, plain: Teeth) -> None:
        short = round((STANDING_S + STRENGTH_S) * TOLD_HZ)
        self.base, self.drive, self.sensing = base, d, sensing
        self.told = Told(given.angle[:short], given.load[:short])
        self.without = plain
        self.rate = min(sensing.rate, LOG_HZ)
        self.like = simulate(base, d, plain, {}, self.told, self.rate)["standing"]
        self.plain = self.weighed(base, plain, {})
        lumped = self.weighed(base, None, {})
        self.columns = []
        for name in (
            "motor_inertia",
            "load_inertia",
            "damping",
            "coulomb",
            "viscous",
            "load_loss",
            "arm",
            "stiffness",
        ):
            value = getattr(d, name)
            if not np.any(value):
                continue
            changed = tuple(v * (1 + CHANGE) for v in value) if name == "stiffness" else value * (1 + CHANGE)
            text = base_yaml(replace(d, **{name: changed}))
            self.columns.append(self.weighed(text, None, {}) - lumped)
        self.columns.append(lumped * np.array([[c == "motor_torque"] for c in sensing.compared]))

    def weighed(self, base: str, teeth: Teeth | None, effects: Effects) -> np.ndarray:
        """Compared channels over their noise along the one motion, shape (channels, n)."""
        found = simulate(base, self.drive, teeth, effects, self.told, self.rate, self.like)
        skip = round(SKIP_S * self.rate)
        return np.array([found[c][skip:] / self.sensing.sigma(c) for c in self.sensing.compared])

    def of(self, teeth: Teeth, effects: Effects) -> float:
        """Strength of a mesh and effects, beyond what the base's numbers explain."""
        return visible(self.weighed(self.base, teeth, effects) - self.plain, self.columns)[1]

    def sized(self, h: Hidden, uniform: list[float], wanted: float) -> tuple[dict[str, Any], float]:
        """Settings with the wanted strength, by a secant iteration; the nearest that is physical."""
        size, best = 1.0, (math.inf, {}, 0.0)
        last: tuple[float, float] | None = None
        for _ in range(STEPS):
            settings = h.settings(self.drive, uniform, size)
            try:
                reached = max(self.of(self.without, {h.name: settings}), 1e-9)
            except RunFailed:
                size *= 0.4
                continue
            off = abs(math.log(reached / wanted))
            if off < best[0]:
                best = (off, settings, reached)
            if off < TOLERANCE or (size >= h.most and reached < wanted):
                break
            now = (math.log(size), math.log(reached))
            slope = 1.0
            if last is not None and now[0] != last[0]:
                slope = min(max((now[1] - last[1]) / (now[0] - last[0]), 0.4), 3.0)
            last = now
            size = min(size * math.exp(min(max((math.log(wanted) - now[1]) / slope, -6.0), 6.0)), h.most)
        return best[1], best[2]


def draw(number: int, seed: int) -> Case:
    """A case; everything follows from the two numbers."""

    def one(rng: np.random.Generator) -> Try | None:
        try:
            return _drawn(number, seed, rng)
        except PhysicsError:
            return None  # teeth softer than the catalogue's whole drive

    return first_near(FAMILY, number, seed, TRIES, one)


def _drawn(number: int, seed: int, rng: np.random.Generator) -> Try:
    """The least part of a wanted strength that is reached, and the case."""
    kind, turn = kind_of(number, seed, KINDS)
    gapped = kind == "pair" or (kind == "effect" and number % len(KINDS) in (1, 4, 7))
    place = 3 * turn + {2: 0, 6: 1, 5: 2}.get(number % len(KINDS), 0)
    h = EFFECTS[place % len(EFFECTS)] if kind == "pair" or (kind == "effect" and not gapped) else None
    kinds = [k for k in SENSORS if not (gapped or (h and h.needs)) or "output_angle" in SENSORS[k]]
    names: tuple[str, ...] = ()
    if kind == "parameter":
        names = draw_parameters(rng)
    arm = bool({"mass", "load-dependent loss"} & set(names) or (h and h.loaded) or rng.random() < 0.6)
    d = draw_drive(rng, arm=arm)
    sensing = draw_sensing(
        rng, d, kinds, fast=bool(h and h.name == "motor_torque_ripple"), quietest_rad=5e-7 if gapped else 3e-6
    )
    d = slower(d, sensing.rate)
    given, held, how = draw_lengths(rng, sensing.rate)
    allowed = MOTIONS if sensing.rate >= 200 else tuple(k for k in MOTIONS if k != "plateaus")
    chosen = [str(k) for k in rng.choice(allowed, len(given) + len(held))]
    motions = [told(k, s, d, sensing, rng) for k, s in zip(chosen, (*given, *held), strict=True)]
    base = base_yaml(d)
    # Behind a gap a hysteresis needs a ring that moves: in static balance it does not hold it.
    ring = "dynamic" if gapped and h is not None and h.name in HYSTERESIS else "static"
    mesh = Teeth(str(rng.choice(["teeth", "tabulated"], p=[0.7, 0.3])), ring, 0.0, int(rng.integers(2**31)))
    teeth = replace(mesh, gap=log_uniform(rng, *GAPS)) if gapped else mesh
    effects: Effects = {}
    strengths, near, truth = [], 1.0, {}
    plant_base, plant, gain = base, d, 1.0
    if kind not in ("null",):
        seen = Visibility(base, d, sensing, motions[0], mesh)
    if gapped:
        strengths.append(round(seen.of(teeth, {}), 3))
    if h is not None:
        wanted = log_uniform(rng, *(STRENGTHS if kind == "effect" else (1.0, 50.0)))
        settings, reached = seen.sized(h, rng.random(6).tolist(), wanted)
        effects, near = {h.name: settings}, reached / wanted
        strengths.append(round(reached, 3))
        truth = {k: v for k, v in settings.items() if isinstance(v, float)}
    if names:
        plant, gain, truth = off(d, names, rng)
        plant_base = base_yaml(plant)
        trace = seen.weighed(plant_base, mesh, {}) - seen.plain
        trace += (gain - 1.0) * seen.plain * np.array([[c == "motor_torque"] for c in sensing.compared])
        strengths = [round(visible(trace, [])[0], 3)]
    records: list[Measured] = []
    for k, one in enumerate(motions):
        true = simulate(plant_base, plant, teeth, effects, one, sensing.rate)
        true["motor_torque"] = gain * true["motor_torque"]
        record = sensing.measure(f"run {k + 1}", true, rng)
        if gapped and (k >= len(given) or not held):
            left = followed(plant_base, plant, teeth, effects, one, sensing.rate, record)
            record = replace(record, followed=left)
        records.append(record)
    what = "+".join([*(["gap"] if gapped else []), *effects, *names]) or "nothing"
    right = [
        *([GAP] if gapped else []),
        *([HYSTERESIS if "hysteresis" in n else frozenset({n}) for n in effects]),
    ]
    setup = said(d, sensing, records[: len(given)]) | {
        "held": how, "motion": tuple(chosen), "formula": "other" if gapped else "catalogue",
        "mesh": mesh.model, "gap": teeth.gap, "changes": effects,
    }  # fmt: skip
    return near, Case(
        f"{FAMILY}/{kind}/{what}/{number}/{seed}", FAMILY, kind, tuple(right), tuple(records[: len(given)]),
        tuple(records[len(given) :]), base, None, tuple(strengths), truth, setup,
    )  # fmt: skip
