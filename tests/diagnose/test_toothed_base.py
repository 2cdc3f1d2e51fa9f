"""A base with teeth: which tooth is out of place is found from where it passes, with its interval."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hdsim
from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.contest import contest
from hdsim.diagnosis.designs import designs, traces
from hdsim.diagnosis.other_spline import of_other_spline
from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.starts import neighbours, starts
from hdsim.diagnosis.teeth import teeth_found
from hdsim.diagnosis.traces import Screened, screen
from hdsim.diagnosis.verdict import IdentifiedEffect
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.asked import gone_with
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, added_spreads, at_present, fit
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import Added, state_of
from hdsim.estimate.write import fitted_numbers
from hdsim.scenario import Scenario


def scenario(
    effects: dict[str, Any],
    model: str = "tabulated",
    *,
    amplitude_deg: float = 2600,
    engagement: dict[str, float] | None = None,
) -> Scenario:
    mesh: dict[str, Any] = {"model": model}
    if model in ("teeth", "tabulated"):
        mesh |= {"ring": "static", "engagement": {"kind": "window", **(engagement or {})}}
    return Scenario.model_validate(
        {
            "drive": {"preset": "seed-2021", "mesh": mesh, "torsion": {"damping_nm_s_per_rad": 40.0}},
            "effects": effects,
            "command": {
                "motor": {
                    "type": "motion",
                    "trajectory": {"type": "sine", "amplitude_deg": amplitude_deg, "frequency_hz": 0.4},
                }
            },
            "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 8.0, "centre_of_mass_m": 0.4}},
            "run": {"duration_s": 3.1, "sample_rate_hz": 250, "teeth_rate_hz": 0},
        }
    )


def bench_of(effects: dict[str, Any], **drive: Any) -> tuple[Bench, Fit]:
    """A record of a drive with all its teeth, and the base's fit without its own numbers moved."""
    run, rng = hdsim.simulate(scenario(effects, "teeth", **drive)), np.random.default_rng(1)
    late = run.time >= 0.6 - 1e-9
    time = run.time[late] - 0.6
    noise = {"motor_angle": 2e-6, "output_angle": 1e-6, "motor_torque": 3e-3}
    channels = {c: run[c][late] + s * rng.standard_normal(len(time)) for c, s in noise.items()}
    base = scenario({})
    bench = bench_for([Record("r", time, channels)], [], base, None)
    state = state_of(base)
    bench.weigh(bench.residuals(bench.predict(state)))
    frees = [free for free in base_freedoms(state, bench.channels) if "mass" in free.name]
    return bench, fit(bench, state, frees, prune=False, evaluations=4, rough=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("member", "tooth", "shift_um"),
    [("flexspline", 57.0, 12.0), pytest.param("circular_spline", 49.0, -25.0, marks=pytest.mark.study)],
)
def test_the_tooth_that_is_out_of_place_is_found_on_its_spline(
    member: str, tooth: float, shift_um: float
) -> None:
    bench, base = bench_of({"tooth_error": {"member": member, "tooth": tooth, "shift_um": shift_um}})
    left = left_of(bench, base)
    ranges = bench.ranges(base.state)
    tried = [
        added
        for way in catalogue()["tooth_error"].fittings
        for added in starts("tooth_error", way, (), ranges)
    ]
    assert len(tried) == 48
    assert len({added.fitting.label for added in tried}) == 4, "a screen tells the ways apart by their labels"
    wanted = float(np.sqrt(left.power / len(left.values)))
    found: list[tuple[Added, Any]] = []
    for times in range(3):  # as the screen does
        with bench.coarse():
            found += traces(bench, base.state, base.predictions, tried, wanted)
        best, columns = max(
            ((added, x) for added, x in found if x is not None), key=lambda one: left.share(one[1]).share
        )
        tried = neighbours(best, times)
    assert best.settings()["member"] == member
    assert left.share(columns).share > 0.6, "one of the other sign explains a tenth"
    sized = replace(best, coefficients=tuple(left.share(columns).coefficients))
    start = replace(base.state, added=(sized,))
    fitted = fit(bench, start, base.frees, prune=False, evaluations=10, after=base)
    # From tooth to tooth the trace has a kink, at which a fit may stop: it is carried on, as in a diagnosis.
    fitted = fit(bench, fitted.state, at_present(fitted), prune=False, evaluations=10, after=fitted)
    ((added, covariance, shapes),) = added_spreads(fitted)
    numbers = fitted_numbers(added, covariance, shapes)
    effect = IdentifiedEffect(
        name="tooth_error", confidence=1, chance=0, explained=1, parameters=numbers, settings=added.settings()
    )
    said = teeth_found([effect], fitted.state)
    assert said is not None
    assert said.tooth is not None
    count = 202 if member == "circular_spline" else 200
    assert said.member == member
    assert said.tooth.value == pytest.approx(tooth % (count / 2), abs=1.0)
    assert said.tooth.interval is not None
    low, high = said.tooth.interval
    assert low < said.tooth.value < high < low + 6
    assert numbers["shift_um"].value == pytest.approx(shift_um, rel=0.15)


def on_screen(bench: Bench, base: Fit, member: str, tooth: float, shift_um: float) -> Screened:
    """A tooth of the right sign and size, not quite in its place."""
    meets = "early" if shift_um > 0 else "late"
    label = f"of the {member.replace('_', ' ')}, {meets}"
    fittings: tuple[Fitting, ...] = catalogue()["tooth_error"].fittings  # type: ignore[attr-defined]
    (way,) = (each for each in fittings if each.label == label)
    own = way.within(bench.ranges(base.state))
    assert own is not None
    added = Added("tooth_error", own, (0.7 * abs(shift_um) / 10.0,), (tooth,))
    with bench.coarse():
        (columns,) = designs(bench, base.state, base.predictions, [replace(added, coefficients=(1.0,))])
    assert columns is not None
    share = left_of(bench, base).share(columns)
    return Screened("tooth_error", replace(added, coefficients=tuple(share.coefficients)), share, columns)


def found_with(bench: Bench, base: Fit, one: Screened) -> Fit:
    with bench.coarse():
        ((_, found, _),) = contest(bench, base, [one], left_of(bench, base), None)
    return found


NARROWER = {"share": 0.25, "edge_teeth": 11.0}


@pytest.mark.slow
def test_a_tooth_is_found_in_a_drive_whose_arc_of_teeth_is_another() -> None:
    member, tooth, shift_um = "circular_spline", 49.0, -25.0
    hidden = {"tooth_error": {"member": member, "tooth": tooth, "shift_um": shift_um}}
    bench, base = bench_of(hidden, engagement=NARROWER)
    found = found_with(bench, base, on_screen(bench, base, member, tooth + 2.0, shift_um))
    settings = found.state.added[0].settings()
    assert settings["tooth"] == pytest.approx(tooth, abs=0.7)
    assert settings["shift_um"] == pytest.approx(shift_um, rel=0.1), (
        "held to the model's arc it is a third off"
    )
    arc = found.state.drive.mesh.engagement
    assert arc.share == pytest.approx(NARROWER["share"], rel=0.03)
    noise = bench.noise_power
    assert bench.power(found.predictions) < 1.5 * noise, (
        "with the model's arc twice the noise or more is left"
    )
    # Nothing else in the record tells of the arc: with the tooth it goes back to what was given.
    gone = gone_with(found, 0)
    assert gone.state.added == ()
    assert gone.state.drive.mesh.engagement.share == pytest.approx(0.3)
    assert gone.state.drive.mesh.engagement.edge_teeth == pytest.approx(8.0)
    assert [free.name for free in gone.frees] == [free.name for free in base.frees]
    assert gone.columns.shape[1] == len(base.frees)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("amplitude_deg", "told"), [(120.0, True), pytest.param(2600.0, False, marks=pytest.mark.study)]
)
def test_a_record_of_few_turns_does_not_tell_the_splines_apart(amplitude_deg: float, told: bool) -> None:
    hidden = {"tooth_error": {"member": "flexspline", "tooth": 57.0, "shift_um": 12.0}}
    bench, base = bench_of(hidden, amplitude_deg=amplitude_deg)
    found = found_with(bench, base, on_screen(bench, base, "flexspline", 57.0, 12.0))
    other = of_other_spline(bench, found, 0, "tooth")
    assert (other is not None) == told
    if other is not None:
        member, number = other
        assert member == "circular_spline"
        assert number.value % 101.0 == pytest.approx(57.0 * 1.01, abs=3.0)


@pytest.mark.slow
def test_every_way_of_fitting_has_its_own_trace_where_a_screening_is_used_again() -> None:
    bench, base = bench_of({"output_backlash": {"backlash_arcmin": 0.3}})
    left = left_of(bench, base)
    first = screen(bench, base.state, left, [])
    again = screen(bench, base.state, left, [], before=first)
    widths = [key for key in first.seen if key[0] == "output_backlash"]
    assert len(widths) == len(starts_of("output_backlash", bench, base)) > 1
    assert set(first.seen) == set(again.seen)
    for key, (added, columns) in first.seen.items():
        earlier, same = again.seen[key]
        assert earlier == added
        np.testing.assert_array_equal(same, columns)
    assert [one.name for one in again.ranked] == [one.name for one in first.ranked]


def starts_of(name: str, bench: Bench, base: Fit) -> list[Added]:
    fittings: tuple[Fitting, ...] = catalogue()[name].fittings  # type: ignore[attr-defined]
    ranges = bench.ranges(base.state)
    ways = [way for way in fittings if way.mesh in ("", "toothed")]
    return [added for way in ways for added in starts(name, way, (), ranges)]


@pytest.mark.slow
def test_what_only_teeth_have_is_asked_of_teeth_alone() -> None:
    bench, base = bench_of({})
    left = Residual(
        np.random.default_rng(0).standard_normal(len(bench.stacked_blocks())),
        base.columns,
        bench.stacked_blocks(),
    )
    found = screen(bench, base.state, left, [])
    toothed = {name for name, _, _ in found.seen}
    assert {"tooth_error", "mesh_preload", "output_backlash"} <= toothed
    assert "damaged_tooth" not in toothed
    plain = state_of(scenario({}, "lumped"))
    toothless = {name for name, _, _ in screen(bench, plain, left, []).seen}
    assert "damaged_tooth" in toothless
    assert not {"tooth_error", "mesh_preload"} & toothless
