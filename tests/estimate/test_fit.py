import math

import numpy as np
import pytest
from rig import TRUTH, model, record

import hdsim
from hdsim.errors import InputError
from hdsim.estimate.outcome import FitResult, result_of
from hdsim.tell.fit_report import save_fit


@pytest.mark.slow
def test_a_bench_numbers_lie_in_their_intervals(tmp_path):
    scenario = model(tmp_path)
    inside, told = 0, 0
    for seed in range(5):
        found = hdsim.fit([record(seed)], scenario, fix=["motor_torque_gain"])
        for interval in found.intervals:
            if interval.name not in TRUTH:
                continue
            assert interval.determined, interval
            told += 1
            inside += interval.low <= TRUTH[interval.name] <= interval.high
            assert interval.value == pytest.approx(TRUTH[interval.name], rel=0.1), interval
        for gap in found.gap.values():
            assert gap.after < 0.2 * gap.before
            assert gap.after < 1.3 * gap.noise
    assert told == 5 * len(TRUTH)
    assert inside >= 0.85 * told  # of 35 at 95 %, 30 or more have a chance of 99 %


@pytest.mark.slow
def test_records_share_numbers_and_may_have_zeros_of_their_own(tmp_path):
    offsets = (0.2, -0.1)
    records = [record(k, 4.0, torque_offset=o, name=f"run {k}") for k, o in enumerate(offsets)]
    held = record(7, 3.0, torque_offset=0.05, name="held")
    base, fixed = model(tmp_path), ["motor_torque_gain"]
    together = hdsim.fit(records, base, holdout=[held], fix=fixed)
    assert "--zeros record" in next(p.message for p in together.problems if p.kind == "zero")
    found = hdsim.fit(records, base, holdout=[held], fix=fixed, zeros="record")
    assert not [p for p in found.problems if p.kind == "zero"]
    assert [r.record for r in found.readings] == ["run 0", "run 1", "held"]
    assert [r.held for r in found.readings] == [False, False, True]
    for reading, offset in zip(found.readings, (*offsets, 0.05), strict=True):
        assert reading.offsets["motor_torque"] == pytest.approx(offset, abs=2e-3)
        assert reading.zero is None
    assert found.fit.state.load.gravity.mass_kg == pytest.approx(4.4, rel=0.02)


def test_what_is_fixed_stays_and_what_is_asked_for_moves(tmp_path):
    scenario, k1 = model(tmp_path), "drive.torsion.stiffness_k1_nm_per_rad"
    paths = ["load.gravity.centre_of_mass_m", "drive.friction.coulomb_nm", k1]
    found = hdsim.fit([record(0, 3.0)], scenario, free=paths)
    assert sorted(i.name for i in found.intervals) == sorted(paths)
    assert found.fit.state.load.gravity.mass_kg == 4.0
    assert found.fit.state.load.gravity.centre_of_mass_m > 0.31  # it stands in for the mass
    assert found.fit.state.drive.torsion.stiffness_k2_nm_per_rad == 3.0e3
    assert found.fit.state.drive.torsion.stiffness_k1_nm_per_rad != 3.0e3
    section = "drive.torsion"
    others = [
        *(k1.replace("k1", k) for k in ("k2", "k3")),
        f"{section}.torque_t1_nm",
        f"{section}.torque_t2_nm",
    ]
    for bad, message in (
        ({"free": ["drive.friction.no_such"]}, "drive.friction.no_such: no parameter"),
        ({"fix": ["load.gravity"]}, "load.gravity: no parameter"),
        ({"free": [k1], "fix": [k1]}, "both free and fixed"),
        ({"fix": [*TRUTH, *others, "motor_torque_gain"]}, "no free parameter"),
    ):
        with pytest.raises(InputError, match=message):
            hdsim.fit([record(0, 3.0)], scenario, **bad)


def test_numbers_that_stand_in_for_one_another_are_told_apart_from_those_that_are_known(tmp_path):
    # A mass and the length of its arm only have a product.
    arm, mass = "load.gravity.centre_of_mass_m", "load.gravity.mass_kg"
    stiffnesses = [f"drive.torsion.stiffness_k{k}_nm_per_rad" for k in (2, 3)]
    found = hdsim.fit([record(0, 4.0)], model(tmp_path), free=[arm, *TRUTH, *stiffnesses])
    result = result_of(found)
    unknown = [name for name, n in result.numbers.items() if n.interval is None]
    assert len(unknown) == 1
    assert {unknown[0], *result.numbers[unknown[0]].tied_to} == {arm, mass}
    unseen = [d for d in result.directions if not d.seen]
    assert len(unseen) == 1
    assert set(unseen[0].parts) == {arm, mass}
    assert math.prod(unseen[0].parts.values()) < 0  # one up, the other down
    assert len(result.correlation.names) == len(TRUTH)
    # The one that was fitted is known no better: the other, which stayed, might be anything.
    assert [
        name
        for name, n in result.numbers.items()
        if n.posterior_over_prior is not None and n.posterior_over_prior > 0.5
    ] == [name for name in (arm, mass) if name != unknown[0]]


def test_a_sensitivity_that_only_its_prior_bounds_is_not_called_determined(tmp_path):
    # Every torque of the model over the sensor's sensitivity: only products are measured.
    result = result_of(hdsim.fit([record(0, 4.0)], model(tmp_path)))
    gain = result.numbers["motor_torque_gain"]
    assert gain.posterior_over_prior is None or gain.posterior_over_prior > 0.5
    assert "drive.inertia.motor_kg_m2" in gain.tied_to  # the widest of what it would stand in for
    for name, true in TRUTH.items():
        low, high = result.numbers[name].interval
        assert low <= true <= high
    assert np.allclose(np.diag(result.correlation.matrix), 1.0)


def test_what_is_written_runs_and_reads_back(tmp_path):
    scenario = model(tmp_path)
    found = hdsim.fit([record(0, 3.0)], scenario, fix=["motor_torque_gain"])
    out = tmp_path / "out"
    page = save_fit(found, tmp_path / "rig.yaml", out).read_text(encoding="utf-8")
    result = FitResult.model_validate_json((out / "fit.json").read_text(encoding="utf-8"))
    fitted = hdsim.load_scenario(out / "fitted.yaml")
    for k in (1, 2, 3):
        assert getattr(fitted.drive.torsion, f"stiffness_k{k}_nm_per_rad") == pytest.approx(
            result.numbers["drive.torsion.stiffness_k1_nm_per_rad"].value, rel=1e-5
        )
    assert fitted.load.gravity.mass_kg == pytest.approx(4.4, rel=0.03)
    assert result.numbers["load.gravity.mass_kg"].unit == "kg"
    assert result.gap["motor_torque"].after < result.gap["motor_torque"].before
    for said in ("differ from the model", "kg m²", "Identifiability", "load mass"):
        assert said in page
    assert page.count("<img") == 3
    names = {path.name for path in out.iterdir()}
    assert names >= {"fit.html", "fit.json", "fitted.yaml", "fit_correlation.png", "fit_intervals.png"}
