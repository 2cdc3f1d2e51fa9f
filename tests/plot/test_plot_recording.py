"""The page of a run: what it shows, what it leaves out, and that nothing overlaps or is lost."""

import math
from itertools import combinations

import numpy as np
import pytest
from click.testing import CliRunner

from hdsim.errors import InputError
from hdsim.log.orders import order_spectrum
from hdsim.plot import plot_recording
from hdsim.plot.commands import plot
from hdsim.plot.curves import thinned
from hdsim.plot.teeth import MAP_ANGLES, MAP_TIMES, force_map
from hdsim.recording import Column, Event, Recording, Table

SCENARIO = """
name: a run
description: What it is for.
drive:
  preset: seed-2021
  arrangement: circular_spline_fixed
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  mesh: {model: teeth}
effects: {kinematic_error: {}, torsional_hysteresis_maxwell: {}}
load: {inertia_kg_m2: 0.5}
"""


def recording(samples: int = 1000, duration: float = 2.0, **changed: np.ndarray | None) -> Recording:
    """A sine run of a 1:-100 drive; a channel set to None is missing."""
    time = np.linspace(0.0, duration, samples)
    phase = 2 * math.pi * time
    error = 1e-3 * np.sin(phase) + 1e-4 * np.sin(13 * phase)
    output = 0.5 * (1 - np.cos(phase))
    values: dict[str, tuple[np.ndarray, str]] = {
        "motor_angle": (-100 * (output - error), "rad"),
        "motor_velocity": (np.gradient(-100 * (output - error), time), "rad/s"),
        "motor_torque": (-0.3 * np.sin(phase), "N m"),
        "output_angle": (output, "rad"),
        "output_velocity": (np.gradient(output, time), "rad/s"),
        "output_torque": (-25 * np.sin(phase + 0.1), "N m"),
        "load_torque": (np.full(samples, -5.0), "N m"),
        "reference_angle": (output + 1e-4, "rad"),
        "tracking_error": (np.full(samples, -1e-4), "rad"),
        "transmission_error": (error, "rad"),
        "kinematic_error": (1e-4 * np.sin(13 * phase), "rad"),
        "input_friction_torque": (0.05 * np.sign(np.sin(phase)), "N m"),
    }
    for name, value in changed.items():
        if value is None:
            del values[name]
        else:
            values[name] = (value, "")
    columns = {name: Column(array, unit) for name, (array, unit) in values.items()}
    angle = np.tile(np.linspace(-math.pi, math.pi, 200, endpoint=False), (50, 1))
    force = 30 * np.maximum(0.0, np.cos(2 * angle)) * np.linspace(0.1, 1.0, 50)[:, None]
    teeth = Table(
        np.linspace(0.0, duration, 50), {"normal_force": Column(force, "N"), "angle": Column(angle, "rad")}
    )
    metadata = {"scenario": SCENARIO, "scenario_name": "a run", "seed": "7", "method": "rodas4"}
    metadata["energy_residual_j"] = "1.0e-9"
    return Recording({"state": Table(time, columns), "teeth": teeth}, metadata=metadata)


def panels(figure) -> dict[str, object]:
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.get_title(loc="left")}


def test_a_full_run_shows_motion_torques_errors_teeth_and_torsion():
    figure = plot_recording(recording())
    assert set(panels(figure)) == {
        "Output angle",
        "Torque",
        "Speed",
        "Tracking error (output less commanded)",
        "Transmission error",
        "Friction torque on the motor shaft",
        "Largest tooth load, 2 s: 98 of 200 teeth",
        "Tooth load over time (colour: flank)",
        "Torque of the drive over its wind-up",
    }
    written = " ".join(text.get_text() for text in figure.texts)
    for part in ("a run", "What it is for.", "seed-2021", "kinematic error", "seed 7", "rodas4", "1.0e-9 J"):
        assert part in written


def test_values_are_shown_in_the_units_of_the_axis():
    run = recording()
    axes = panels(plot_recording(run))
    error = axes["Tracking error (output less commanded)"]
    assert error.get_ylabel() == "arcsec"
    np.testing.assert_allclose(error.lines[0].get_ydata(), -1e-4 * 206264.806247, rtol=1e-9)
    angle = axes["Output angle"]
    assert angle.get_ylabel() == "deg"
    np.testing.assert_allclose(angle.lines[0].get_ydata(), np.degrees(run["output_angle"]))
    speed = {line.get_label(): line.get_ydata() for line in axes["Speed"].lines}
    np.testing.assert_allclose(speed["motor"], run["motor_velocity"] * 60 / (2 * math.pi))
    np.testing.assert_allclose(speed["output x -100"], run["output_velocity"] * -100 * 60 / (2 * math.pi))
    torque = {line.get_label(): line.get_ydata() for line in axes["Torque"].lines}
    np.testing.assert_allclose(torque["motor x -100"], run["motor_torque"] * -100)


def test_the_wind_up_is_the_transmission_error_without_the_kinematic_one():
    run = recording()
    loop = panels(plot_recording(run))["Torque of the drive over its wind-up"].lines[0]
    np.testing.assert_allclose(
        loop.get_xdata(), 206264.806247 * (run["kinematic_error"] - run["transmission_error"]), atol=1e-9
    )


def test_missing_and_zero_channels_leave_their_panels_out():
    nothing = np.zeros(1000)
    run = recording(
        reference_angle=None, tracking_error=None, input_friction_torque=nothing, load_torque=nothing
    )
    del run.tables["teeth"]
    found = panels(plot_recording(run))
    assert set(found) == {
        "Output angle",
        "Torque",
        "Speed",
        "Transmission error",
        "Torque of the drive over its wind-up",
    }
    assert "load" not in [line.get_label() for line in found["Torque"].lines]


def test_a_locked_motor_is_said_and_its_error_not_drawn_twice():
    found = panels(plot_recording(recording(motor_angle=np.zeros(1000), motor_velocity=np.zeros(1000))))
    assert "Output angle (motor at rest)" in found
    assert "Transmission error" not in found
    assert "Speed" not in found


def test_a_warm_up_shows_temperature_over_minutes():
    run = recording(duration=1800.0, temperature=np.linspace(20, 40, 1000))
    axes = panels(plot_recording(run))["Temperature of the drive"]
    assert axes.get_ylabel() == "degC"
    assert axes.lines[0].get_xdata()[-1] == pytest.approx(30.0)


def test_a_run_that_stopped_says_so():
    run = recording()
    run.events.append(Event(1.5, "error", "solver", "the step became too small"))
    texts = [text.get_text() for text in plot_recording(run).texts]
    assert "stopped at 1.5 s: the step became too small" in texts


def test_without_any_metadata_it_still_draws():
    run = recording()
    run.metadata.clear()
    found = panels(plot_recording(run))
    assert "Motor speed" in found
    assert [line.get_label() for line in found["Torque"].lines][:2] == ["drive on output", "load"]


def test_nothing_to_draw_is_refused():
    with pytest.raises(InputError, match="no samples"):
        plot_recording(Recording({"state": Table(np.zeros(0))}))
    with pytest.raises(InputError, match="unknown or zero"):
        plot_recording(Recording({"state": Table(np.arange(3.0), {"x": Column(np.zeros(3), "m")})}))


@pytest.mark.parametrize("without", [(), ("tracking_error", "reference_angle"), ("load_torque",)])
def test_no_title_legend_or_label_overlaps_another(without):
    run = recording(**dict.fromkeys(without), temperature=np.linspace(20, 40, 1000))
    figure = plot_recording(run)
    figure.draw_without_rendering()
    boxes = []
    for axes in figure.axes:
        texts = [axes._left_title, axes.xaxis.label, axes.yaxis.label, *figure.texts]
        legend = axes.get_legend()
        boxes += [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text() and t.get_visible()]
        if legend is not None:
            boxes.append((f"legend of {axes.get_title(loc='left')}", legend.get_window_extent()))
    page = figure.bbox
    for (one, a), (other, b) in combinations(boxes, 2):
        if one == other:
            continue
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide < 1 or high < 1, f"{one!r} overlaps {other!r}"
    for name, box in boxes:
        assert box.x0 >= page.x0 - 1 and box.x1 <= page.x1 + 1, f"{name!r} leaves the page"  # noqa: PT018


def test_thinning_keeps_a_single_spike_and_the_ends():
    time = np.linspace(0.0, 10.0, 300_001)
    values = np.sin(time)
    values[123_457] = 40.0
    values[222_222] = -30.0
    few, (kept,) = thinned(time, [values])
    assert len(few) <= 4100
    assert (kept.max(), kept.min()) == (40.0, -30.0)
    assert (few[0], few[-1]) == (0.0, 10.0)
    assert few[np.argmax(kept)] == pytest.approx(time[123_457], abs=0.01)


@pytest.mark.parametrize("direction", [1, -1])
def test_orders_of_a_known_error_have_its_amplitudes(direction):
    angle = direction * (np.linspace(0, 50 * 2 * math.pi, 40_000) ** 2) / (50 * 2 * math.pi)
    values = 3.0 * np.sin(2 * angle) + 0.7 * np.cos(5 * angle + 0.3) + 11.0
    orders, amplitudes = order_spectrum(angle, values)
    for order, amplitude in ((2.0, 3.0), (5.0, 0.7), (3.5, 0.0)):
        assert amplitudes[np.argmin(np.abs(orders - order))] == pytest.approx(amplitude, abs=0.01)


def test_the_tooth_map_keeps_the_largest_force_of_either_sign():
    rng = np.random.default_rng(4)
    angle = np.degrees(np.angle(np.exp(1j * (rng.uniform(0, 7, (1000, 1)) + np.arange(200) * math.pi / 100))))
    force = rng.normal(size=(1000, 200))
    force[700, 60], force[200, 3] = -55.0, 44.0
    edges, cells = force_map(np.linspace(0, 5, 1000), force, angle)
    assert cells.shape == (MAP_ANGLES, MAP_TIMES) == (MAP_ANGLES, len(edges) - 1)
    assert (cells.min(), cells.max()) == (-55.0, 44.0)
    column = np.unravel_index(np.argmin(cells), cells.shape)[1]
    assert edges[column] <= 5 * 700 / 999 <= edges[column + 1]


def test_the_command_draws_next_to_the_log(tmp_path):
    log = recording().save(tmp_path / "run.mcap")
    done = CliRunner().invoke(plot, [str(log)], catch_exceptions=False)
    assert done.exit_code == 0
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    CliRunner().invoke(plot, [str(log), "-o", str(tmp_path / "deep" / "run.svg")], catch_exceptions=False)
    assert b"<svg" in (tmp_path / "deep" / "run.svg").read_bytes()
    with pytest.raises(InputError, match="cannot be written"):
        CliRunner().invoke(plot, [str(log), "-o", str(tmp_path / "run.doc")], catch_exceptions=False)
