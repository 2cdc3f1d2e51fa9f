"""The drive as a block of ``control`` in discrete time."""

from pathlib import Path

import control as ct
import numpy as np
import pytest

import hdsim
from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.linear import io_system

ROOT = Path(__file__).parents[2]


def lumped(changes: dict[str, float] | None = None) -> Scenario:
    """A joint with the catalogue's stiffness alone."""
    base = hdsim.load_scenario(ROOT / "scenarios" / "seed_move.yaml")
    drive = {"preset": "csg-20-100", "mesh": {"model": "lumped"}}
    return base.with_({"effects": {}, "drive": drive, **(changes or {})})


def test_a_sampled_block_tends_to_the_block_in_continuous_time():
    """In a loop with a sampled controller the error falls with the period, as a held input's does."""
    one = lumped({"drive.friction.smoothing_velocity_rad_per_s": 0.5})
    gains = [[0.2, -0.2, -0.01]]
    signals = ["reference", "motor_angle", "motor_velocity"]

    def response(dt):
        block = io_system(one, dt_s=dt, outputs=("motor_angle", "motor_velocity"))
        clock = [] if dt is None else [dt]
        names = {"inputs": signals, "outputs": ["motor_torque"], "name": "controller"}
        controller = ct.ss([], [], [], gains, *clock, **names)
        joined = {"inputs": ["reference", "load_torque"], "outputs": ["motor_angle"]}
        loop = ct.interconnect([block, controller], **joined)
        times = np.arange(0.0, 0.0501, 1e-3 if dt is None else dt)
        options = {} if dt else {"solve_ivp_method": "BDF", "solve_ivp_kwargs": {"rtol": 1e-8, "atol": 1e-10}}
        inputs = np.vstack([np.full(len(times), 1.0), np.zeros(len(times))])
        found = ct.input_output_response(loop, times, inputs, **options)
        return found.outputs[0][:: 1 if dt is None else round(1e-3 / dt)]

    exact = response(None)
    coarse, fine = (np.abs(response(dt) - exact).max() for dt in (1e-3, 2e-4))
    assert fine < coarse / 4.0
    # Held over a period, an input comes half a period late on the average: the motion is late by no more.
    fastest = np.abs(np.diff(exact)).max() / 1e-3
    assert fine < 0.5 * 2e-4 * fastest


def test_a_sampled_block_can_have_its_output_moved():
    """With the motor locked and the output turned, the torque is that of the drive's own stiffness."""
    scenario = lumped()
    block = io_system(scenario, dt_s=1e-3, motor="motion", output="motion", outputs=("output_torque",))
    assert block.input_labels[3:] == [f"prescribed_output_{w}" for w in ("angle", "velocity", "acceleration")]
    twist = 2e-4
    moved = np.zeros((6, 5))
    moved[3] = twist
    torque = ct.input_output_response(block, np.arange(5) * 1e-3, moved).outputs[-1]
    stiffness = scenario.drive.torsion.stiffness_k1_nm_per_rad
    assert torque[-1] == pytest.approx(-stiffness * twist, rel=1e-6)


def test_a_block_in_continuous_time_has_torques_alone():
    with pytest.raises(InputError, match="a side that is moved needs dt_s"):
        io_system(lumped(), output="motion")
