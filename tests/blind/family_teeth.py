"""Blind plants that are hdsim's own drive with every tooth, held against a base that has teeth too.

The base is the nominal drive (``tabulated`` mesh, nominal flanks). The plant has all teeth one by one, other
engagement (its share and edges), flanks and pitch errors drawn anew: that is the null, for nobody knows the
flanks that a drive has. Hidden is a gap 1.5 to 3 times the nominal one or 0.5 times (right: the effects that
widen or narrow it), or one tooth out of place on either spline. A wider or narrower gap is each tooth's own
times a factor, and the structure behind the mesh keeps its spring: the catalogue's secants are made anew for
that.

Strength: the plant's drive with and without what is hidden, along the motion of the plant without it, both
with every tooth; least squares take out offsets and the sensitivities of the base's own numbers.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from contract import Case, Kind, Measured
from drawing import (
    SKIP_S,
    Drive,
    Sensing,
    Try,
    base_yaml,
    draw_drive,
    draw_sensing,
    first_near,
    kind_of,
    log_uniform,
    said,
    slower,
    visible,
)
from moving import MOTIONS
from toothed_plant import Effects, Teeth, pitch_radius, simulate, told

import hdsim
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive as Gear
from hdsim.errors import PhysicsError
from hdsim.simulation.run import RunFailed

FAMILY = "teeth"
KINDS: tuple[Kind, ...] = ("null", "effect", "effect", "effect", "effect")
TRIES = 3
#: Gaps over the nominal ones, how far a tooth is out of place (um, either way), strengths that are wanted.
WIDER, NARROWER, SHIFT_UM = (1.5, 3.0), 0.5, (4.0, 60.0)
STRENGTHS = (1.0, 60.0)
#: Nominal standard deviation of the pitch errors, m, and ranges of what else a plant draws anew.
PITCH_ERROR_M, SHARE, EDGE = 2e-7, (0.25, 0.35), (5.0, 12.0)
SECONDS = (6.0, 9.0)
#: Numbers that the base may bend, and by how much they are changed to see what that does.
OWN = ("motor_inertia", "load_inertia", "damping", "coulomb", "viscous", "load_loss", "arm", "stiffness",
       "torques")  # fmt: skip
CHANGE = 0.02
MEMBERS = ("flexspline", "circular_spline")


@dataclass(frozen=True)
class Drawn(Teeth):
    """A mesh of this family: nominal flanks times ``gap``, with what a plant draws anew."""

    share: float = 0.30
    edge: float = 8.0

    def section(self, d: Drive) -> dict[str, Any]:
        """The scenario's mesh."""
        return {
            "model": self.model, "ring": self.ring, "gap_factor": self.gap,
            "tooth_bending_stiffness_n_per_m": 14e9 * 0.4 * pitch_radius(d),
            "pitch_error_m": PITCH_ERROR_M, "flanks": {"seed": self.seed},
            "engagement": {"kind": "window", "share": self.share, "edge_teeth": self.edge},
        }  # fmt: skip


def with_teeth(d: Drive, teeth: Drawn) -> str:
    """The base's YAML with teeth."""
    data = yaml.safe_load(base_yaml(d))
    radius = pitch_radius(d)
    data["drive"]["mesh"] = teeth.section(d)
    data["drive"]["geometry"]["pitch_radius_m"] = radius
    data["drive"]["inertia"]["ring_kg_m2"] = 7850.0 * 2 * math.pi * radius**3 * 0.4 * radius * 0.048 * radius
    return str(yaml.safe_dump(data, sort_keys=False))


def mesh_of(text: str) -> Any:
    """The teeth of a base's YAML, and its drive."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "base.yaml"
        path.write_text(text, encoding="utf-8")
        scenario = hdsim.load_scenario(path)
    return Model(scenario.drive, load_inertia_kg_m2=1.0, seed=scenario.run.seed).teeth, scenario.drive


def behind_the_same_structure(d: Drive, teeth: Drawn, other: Drawn) -> Drive:
    """The drive's secants with another mesh in front of the same structure."""
    (first, gear), (second, _) = (_built(d, each) for each in (teeth, other))
    t1, t2 = d.torques
    corners = np.array([t1, t2, max(gear.rated_torque_nm, 1.2 * t2)])
    twist = first.structure_wind_up(corners) + [second.wind_up(float(t)) for t in corners]
    secants = np.diff([0.0, *corners]) / np.diff([0.0, *twist])
    return replace(d, stiffness=tuple(float(k) for k in secants))


def _built(d: Drive, teeth: Drawn) -> tuple[Any, Gear]:
    """Teeth in front of a structure; where the drive's secants leave them no room, of a softer drive."""
    for softer in (1.0, 0.7, 0.5):
        try:
            return mesh_of(with_teeth(replace(d, stiffness=tuple(k * softer for k in d.stiffness)), teeth))
        except PhysicsError:
            continue
    raise PhysicsError("the teeth are softer than the whole drive")


def draw(number: int, seed: int) -> Case:
    """A case; everything follows from the two numbers."""

    def one(rng: np.random.Generator) -> Try | None:
        try:
            return _drawn(number, seed, rng)
        except (PhysicsError, RunFailed):
            return None

    return first_near(FAMILY, number, seed, TRIES, one)


def _drawn(number: int, seed: int, rng: np.random.Generator) -> Try:
    """The least part of a wanted strength that is reached, and the case."""
    kind, turn = kind_of(number, seed, KINDS)
    what = "nothing" if kind == "null" else ("gap", "tooth")[number % len(KINDS) % 2]
    d = draw_drive(rng, arm=True)
    sensing = draw_sensing(rng, d, ["both", "torque sensor", "known load"], quietest_rad=5e-7)
    sensing = replace(sensing, rate=int(rng.choice([200, 250, 500])))
    d = slower(d, sensing.rate)
    nominal = Drawn("tabulated", "static", 1.0, 0)
    base = with_teeth(d, nominal)
    mesh_of(base)
    plain = Drawn("teeth", "static", 1.0, int(rng.integers(2**31)), rng.uniform(*SHARE), rng.uniform(*EDGE))
    kinds = [k for k in MOTIONS if k != "plateaus"]
    one = told(str(rng.choice(kinds)), round(rng.uniform(*SECONDS), 1), d, sensing, rng)
    teeth, effects, plant, names, truth = plain, {}, d, frozenset[str](), {}
    if what == "gap":
        factor = NARROWER if turn % 4 == 3 else log_uniform(rng, *WIDER)
        teeth = replace(plain, gap=factor)
        plant = behind_the_same_structure(d, plain, teeth)
        names = frozenset({"flank_wear", "output_backlash" if factor > 1 else "mesh_preload"})
    elif what == "tooth":
        effects, truth = _tooth(d, turn, rng)
        names = frozenset({"tooth_error"})
    strengths: tuple[float, ...] = ()
    near = 1.0
    if names:
        strength = _strength(d, plant, sensing, one, plain, teeth, effects)
        near = 1.0 if STRENGTHS[0] <= strength <= STRENGTHS[1] else 0.4
        strengths = (round(strength, 3),)
    true = simulate(base_yaml(plant), plant, teeth, effects, one, sensing.rate)
    record: Measured = sensing.measure("run 1", true, rng)
    own, _ = _built(plant, teeth)
    setup = said(d, sensing, [record]) | {
        "held": "stretches", "motion": (one_name(one),), "formula": "other" if what == "gap" else "catalogue",
        "gap": teeth.gap, "share": plain.share, "edge_teeth": plain.edge, "changes": effects,
        "half_gap_um": 1e6 * float(np.mean(own.half_gaps_m)),
    }  # fmt: skip
    return near, Case(
        f"{FAMILY}/{kind}/{what}/{number}/{seed}", FAMILY, kind, (names,) if names else (), (record,), (),
        base, None, strengths, truth, setup,
    )  # fmt: skip


def one_name(one: Any) -> str:
    """Motions here have no other name than their length."""
    return f"{len(one.angle)} ticks"


def _tooth(d: Drive, turn: int, rng: np.random.Generator) -> tuple[Effects, dict[str, float]]:
    """One tooth out of place."""
    count = round(2 * abs(d.ratio)) - (2 if d.ratio > 0 else 0)
    member = MEMBERS[turn % 2]
    size = float(rng.choice([-1.0, 1.0])) * log_uniform(rng, *SHIFT_UM)
    tooth = int(rng.integers(count + 2 * (member == "circular_spline")))
    settings = {"member": member, "tooth": float(tooth), "shift_um": size}
    return {"tooth_error": settings}, {"shift_um": size}


def _strength(
    d: Drive, plant: Drive, sensing: Sensing, one: Any, plain: Drawn, teeth: Drawn, effects: Effects
) -> float:
    """Of what is hidden, in the channel where it shows most."""
    rate, skip = sensing.rate, round(SKIP_S * sensing.rate)
    like = simulate(base_yaml(d), d, plain, {}, one, rate)["standing"]

    def weighed(numbers: Drive, mesh: Drawn, extra: Effects) -> np.ndarray:
        run = simulate(base_yaml(numbers), d, mesh, extra, one, rate, like)
        return np.array([run[c][skip:] / sensing.sigma(c) for c in sensing.compared])

    without = weighed(d, plain, {})
    table = replace(plain, model="tabulated")
    given = weighed(d, table, {})
    columns = [given * np.array([[c == "motor_torque"] for c in sensing.compared])]
    for name in OWN:
        value = getattr(d, name)
        changed = tuple(v * (1 + CHANGE) for v in value) if isinstance(value, tuple) else value * (1 + CHANGE)
        columns.append(weighed(replace(d, **{name: changed}), table, {}) - given)
    return visible(weighed(plant, teeth, effects) - without, columns)[1]
