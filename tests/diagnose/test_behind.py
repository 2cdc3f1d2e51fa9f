"""Effects behind a torque sensor whose reading is the load: only what acts on the output itself is there."""

from typing import Any

import pytest
from moves import SWELL, positioned, to_and_fro
from noisy import noisy

import hdsim
from hdsim.diagnosis.behind import behind_sensor
from hdsim.diagnosis.workflow import diagnose
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 1e-5, "output_angle": 2e-6, "output_torque": 0.05}
MOTOR = {"motor_torque": 2e-3}
#: Moves of the output: slow and far; quick, with a load whose resonance (28 Hz) is among them.
MOTIONS = {
    "slow": ({"type": "sine", "amplitude_deg": 8.0, "frequency_hz": 0.1}, 0.05),
    "quick": (
        {
            "type": "chirp",
            "amplitude_deg": 0.05,
            "start_frequency_hz": 1.0,
            "end_frequency_hz": 40.0,
            "duration_s": 6.0,
        },
        0.5,
    ),
}


def scenario(motion: str, effects: dict[str, Any] | None = None) -> Scenario:
    """A load whose torque swells and ebbs, on a drive that turns."""
    trajectory, inertia = MOTIONS[motion]
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects or {},
        "command": positioned(trajectory),
        "load": {
            "inertia_kg_m2": inertia,
            "torque": SWELL,
        },
        "run": {"duration_s": 6.0, "sample_rate_hz": 500.0},
    })  # fmt: skip


def opened(motion: str, channels: dict[str, float]) -> Bench:
    """A log of the drive without any effect."""
    record = noisy(hdsim.simulate(scenario(motion)), channels, seed=0)
    return bench_for([record], [], scenario(motion), "output_torque")


def of_the_load(name: str, fitting: Fitting) -> bool:
    """Whether an effect is one of the load: its friction, and a weight on the output."""
    return name == "load_side_friction" or (name == "unbalance" and "output" in fitting.label)


@pytest.mark.parametrize("channels", [NOISE, NOISE | MOTOR], ids=["no motor torque", "motor torque"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_only_what_acts_on_the_load_is_behind_the_sensor(motion: str, channels: dict[str, float]) -> None:
    bench = opened(motion, channels)
    state = refit(bench, state_of(scenario(motion))).fit.state
    ranges = bench.ranges(state)
    asked = [
        (name, fitting)
        for name, effect in catalogue().items()
        for fitting in effect.fittings
        if fitting.of_mesh(False)
        and not fitting.follows
        and fitting.within(ranges) is not None
        and bench.turns >= fitting.turns
    ]
    behind = [
        (name, fitting.label) for name, fitting in asked if behind_sensor(bench, state, name, fitting, ranges)
    ]
    seen = {name for name, _ in asked}
    assert {
        "load_side_friction",
        "output_backlash",
        "torsional_hysteresis_maxwell",
        "base_flexibility",
    } <= seen
    assert behind == [(name, fitting.label) for name, fitting in asked if of_the_load(name, fitting)]


@pytest.mark.parametrize("channels", [NOISE, NOISE | MOTOR], ids=["no motor torque", "motor torque"])
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("torsional_hysteresis_maxwell", {"slip_torque_nm": 2.0}),
        ("output_backlash", {"backlash_arcmin": 0.3}),
        ("kinematic_error", {"components": [{"order": 2, "amplitude_arcmin": 0.2}]}),
    ],
)
def test_effects_of_the_drive_are_found_where_its_torque_sensor_is_the_load(
    name: str, settings: dict[str, Any], channels: dict[str, float]
) -> None:
    record = noisy(hdsim.simulate(scenario("slow", {name: settings})), channels, seed=1)
    verdict = diagnose([record], scenario("slow"), load="output_torque").verdict
    assert verdict.verdict == "effect"
    assert name in {verdict.effects[0].name, *verdict.effects[0].indistinguishable_from}


def test_an_arm_that_rings_behind_the_sensor_lacks_nothing() -> None:
    """Its weight and its inertia stand in the base and in the reading, and it rings at 20 Hz."""
    base = Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "command": positioned(to_and_fro([20.0, -35.0, 15.0] * 3, 120.0, 1500.0, 60000.0)),
        "load": {"inertia_kg_m2": 0.8, "gravity": {"mass_kg": 3.0, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": 6.0, "sample_rate_hz": 250.0},
    })  # fmt: skip
    record = noisy(hdsim.simulate(base), NOISE | MOTOR, seed=2)
    verdict = diagnose([record], base, load="output_torque").verdict
    assert verdict.verdict == "nothing", verdict.sentence
