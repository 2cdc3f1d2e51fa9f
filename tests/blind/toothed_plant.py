"""hdsim's toothed drive as a plant: its mesh, what it is told, its simulation through a scenario's files."""

from __future__ import annotations

import math
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from contract import Measured
from drawing import SKIP_S, Drive, Sensing, log_uniform, started
from moving import motion

import hdsim
from hdsim.contact.law import ValidityWarning
from hdsim.drive.parameters import RESOLVED_RAD_PER_S
from hdsim.drive.presets import PRINTED_FLANKS
from hdsim.estimate.spline import spline_through
from hdsim.scenario.writer import to_yaml

#: Time for which the drive stands before its log begins, s.
STANDING_S = 0.5
#: Rates that a plant's motion is told at, that a prescribed one is, and its log's at the least, Hz.
TOLD_HZ, LIKE_HZ, LOG_HZ = 100, 250, 1000

#: Friction's sign as a prediction has it: how a drive sticks is not what is hidden here.
SIGN = {"smoothing_velocity_rad_per_s": RESOLVED_RAD_PER_S}

Effects = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Teeth:
    """The mesh of a plant: model, ring, half-gaps over the nominal ones (0: no gap), its flanks' seed.

    Nominal are the gaps of ``seed-2021-printed-roughness``: twice the default drive's.
    """

    model: str
    ring: str
    gap: float
    seed: int

    def section(self, d: Drive) -> dict[str, Any]:
        """The scenario's mesh; the flanks' roughness is scaled such that their heights are."""
        radius = pitch_radius(d)
        mesh: dict[str, Any] = {
            "model": self.model, "ring": self.ring,
            "tooth_bending_stiffness_n_per_m": 14e9 * 0.4 * radius,
        }  # fmt: skip
        if self.gap == 0.0:
            return mesh | {
                "half_gap_m": 0.0,
                "contact": {"law": "constant", "contact_stiffness_n_per_m": 6e9 * radius},
            }
        # Heights of a Weierstrass-Mandelbrot profile go with G^(D - 2).
        flanks: dict[str, Any] = PRINTED_FLANKS | {"seed": self.seed}
        for name in ("circular_spline", "flexspline"):
            dimension = flanks[name]["fractal_dimension"]
            scaled = flanks[name]["fractal_roughness_m"] * self.gap ** (1 / (dimension - 2))
            flanks[name] = {"fractal_dimension": dimension, "fractal_roughness_m": scaled}
        return mesh | {"flanks": flanks}


def pitch_radius(d: Drive) -> float:
    """Pitch radius of a size: 25.4 mm at size 20 (catalogue), m."""
    return 1.27e-3 * d.size


@dataclass(frozen=True)
class Told:
    """A motion with its load at ``TOLD_HZ``, the time before the log included."""

    angle: np.ndarray
    load: np.ndarray


def told(kind: str, seconds: float, d: Drive, sensing: Sensing, rng: np.random.Generator) -> Told:
    """What the plant is told for a record."""
    angle, _ = motion(kind, seconds + 0.1, d.top_speed / abs(d.ratio), rng, tick_hz=LOG_HZ,
                      smooth_s=max(0.06, 20.0 / sensing.rate))  # fmt: skip
    standing = round(STANDING_S * LOG_HZ)
    every = LOG_HZ // TOLD_HZ
    angle = (rng.uniform(-0.8, 0.8) * started(d, sensing) + np.pad(angle, (standing, 0)))[::every]
    t = np.arange(len(angle)) / TOLD_HZ - STANDING_S
    load = np.zeros_like(t)
    if sensing.kind == "known load":
        for _ in range(3):
            load = load + np.sin(
                2 * np.pi * log_uniform(rng, 0.08, min(1.5, sensing.rate / 80)) * t + rng.uniform(0, 6.3)
            )
        rise = np.clip(t / 0.5, 0.0, 1.0)
        load = load * rise**2 * (3 - 2 * rise) * d.torques[1] * rng.uniform(0.3, 0.8) / np.max(np.abs(load))
    return Told(angle, load)


def simulate(
    base: str,
    d: Drive,
    teeth: Teeth | None,
    effects: Effects,
    given: Told,
    rate: int,
    like: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """True channels from where the log begins, at ``rate``.

    Args:
        base: the lumped base's YAML.
        d: its numbers.
        teeth: the mesh; None: the base's own.
        effects: settings of the effects, by name.
        given: what the plant is told.
        rate: of the samples, Hz.
        like: motor angles at ``LIKE_HZ`` that are prescribed, the time before the log included.
    """
    wide = 0.8 * math.sqrt(d.stiffness[0] / d.load_inertia)
    inertia = d.motor_inertia + d.load_inertia / d.ratio**2
    seconds = len(given.angle) / TOLD_HZ - 0.05
    radius = pitch_radius(d)
    # A steel rim 0.4 radii wide and 0.048 radii thick.
    ring = 7850.0 * 2 * math.pi * radius**3 * 0.4 * radius * 0.048 * radius
    sampled = max(rate, LOG_HZ)
    column = {"type": "recorded", "interpolation": "spline"}
    motor: dict[str, Any] = {
        "type": "position", "at": "output",
        "trajectory": column | {"file": "told.csv", "value_column": "angle"},
        "controller": {"type": "cascade", "position_gain_per_s": 0.15 * wide,
                       "velocity_gain_nm_s_per_rad": wide * inertia,
                       "velocity_integral_gain_nm_per_rad": 0.2 * wide**2 * inertia}}  # fmt: skip
    if like is not None:
        motor = {"type": "motion", "trajectory": column | {"file": "like.csv", "value_column": "angle"}}
    changes: dict[str, Any] = {
        "extends": "base.yaml", "drive": {"friction": SIGN}, "effects": effects, "command": {"motor": motor},
        "load": {"torque": column | {"file": "told.csv", "value_column": "load"}},
        "run": {"duration_s": seconds, "sample_rate_hz": float(sampled), "teeth_rate_hz": 0.0},
    }  # fmt: skip
    if like is None:
        changes["run"]["start"] = {"motor_angle_rad": float(given.angle[0]) * d.ratio}
    if teeth is not None:
        changes["drive"] |= {"mesh": teeth.section(d), "geometry": {"pitch_radius_m": radius},
                            "inertia": {"ring_kg_m2": ring}}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        _table(Path(folder) / "told.csv", TOLD_HZ, {"angle": given.angle, "load": given.load})
        if like is not None:
            _table(Path(folder) / "like.csv", LIKE_HZ, {"angle": like})
        (Path(folder) / "base.yaml").write_text(base, encoding="utf-8")
        path = Path(folder) / "plant.yaml"
        path.write_text(to_yaml(changes), encoding="utf-8")
        with warnings.catch_warnings():
            # Flanks three times as rough are plastic up to more than the contact's floor: no matter here.
            warnings.simplefilter("ignore", ValidityWarning)
            run = hdsim.simulate(hdsim.load_scenario(path))
    every = sampled // rate
    names = ("motor_angle", "motor_torque", "output_angle", "output_torque", "load_torque")
    found = {name: np.asarray(run[name])[round(STANDING_S * sampled) :: every] for name in names}
    # Nothing here warms the drive.
    found["temperature"] = np.full(len(found["motor_angle"]), 22.0)
    found["standing"] = np.asarray(run["motor_angle"])[:: sampled // LIKE_HZ]
    return found


def followed(
    base: str, d: Drive, teeth: Teeth | None, effects: Effects, given: Told, rate: int, record: Measured
) -> dict[str, float]:
    """What the plant leaves of a record when its motor is moved as the readings tell, root mean square.

    A load that rattles in a play is where its last bounce has left it: the motor's motion does not tell.

    Args:
        base: as for ``simulate``.
        d: its numbers.
        teeth: the mesh.
        effects: settings of the effects, by name.
        given: what the plant was told.
        rate: of the samples, Hz.
        record: what was measured then.
    """
    spline, _ = spline_through(record.time, record.channels["motor_angle"], motion=True)
    ticks = np.arange(-STANDING_S, record.time[-1], 1.0 / LIKE_HZ)
    like = spline(np.clip(ticks, record.time[0], record.time[-1]))
    found = simulate(base, d, teeth, effects, given, rate, like)
    count = round((record.time[-1] - SKIP_S) * rate)
    rows = slice(round(SKIP_S * rate), count)
    return {
        channel: float(np.std((record.channels[channel] - found[channel][: len(record.time)])[rows]))
        for channel in ("motor_torque", "output_angle", "output_torque")
        if channel in record.channels
    }


def _table(path: Path, rate: int, columns: dict[str, np.ndarray]) -> None:
    rows = np.column_stack([np.arange(len(next(iter(columns.values())))) / rate, *columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(["time", *columns]), comments="", fmt="%.15g")
