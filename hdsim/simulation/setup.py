"""From a scenario to a model and a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive.model import Model
from hdsim.simulation.run import Run, SampledLoop

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]


def build_model(scenario: Scenario, *, audited: bool = True) -> Model:
    """The scenario's drive with its effects, load and commands, as an ODE; see ``Model`` for ``audited``."""
    drive = scenario.drive
    loads, inertia = scenario.load.over(scenario.run.duration_s)
    motions: dict[str, object] = {m.axis: m.signal for m in scenario.command.motions(drive.ratio)}
    return Model(
        drive,
        [*scenario.effects.active().values(), *loads, scenario.command],
        load_inertia_kg_m2=inertia,
        motions=motions,
        seed=scenario.run.seed,
        audited=audited,
    )


def initial_state(model: Model, scenario: Scenario) -> Array:
    """The state in which the scenario's run starts, shape (n,)."""
    start = scenario.run.start
    return model.initial_state(
        motor_angle=start.motor_angle_rad,
        motor_velocity=start.motor_velocity_rad_per_s,
        output_twist=start.output_twist_rad,
    )


def build_run(scenario: Scenario) -> Run:
    """The scenario ready to be integrated."""
    from hdsim.actuation._kernels import held_torque

    model = build_model(scenario)
    settings = scenario.run
    loop = None
    controller = scenario.command.sampled(model.ratio)
    if controller is not None:
        place = next(at for kernel, at in model.element_places if kernel is held_torque)
        loop = SampledLoop(controller, controller.period, place)
    return Run(
        model,
        duration_s=settings.duration_s,
        sample_rate_hz=settings.sample_rate_hz,
        teeth_rate_hz=settings.teeth_rate_hz,
        y0=initial_state(model, scenario),
        method=settings.method,
        rtol=settings.rtol,
        atol=settings.atol,
        max_step_s=math.inf if settings.max_step_s is None else settings.max_step_s,
        reference=scenario.command.reference(model.ratio),
        loop=loop,
    )
