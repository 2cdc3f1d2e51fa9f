"""The next experiment: its distance against the textbook formula, its proposals against simulated truth."""

from dataclasses import replace

import numpy as np
import pytest
from diagnose_bench import BASE
from ruamel.yaml import YAML

import hdsim
from hdsim.diagnosis.experiment import propose
from hdsim.diagnosis.experiments import Limits, experiments
from hdsim.diagnosis.separation import separated
from hdsim.effects import catalogue
from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, fit
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.state import Added, state_of
from hdsim.scenario.model import Scenario

NOISE = {"motor_angle": 1e-5, "output_angle": 4e-6, "motor_torque": 6e-3, "output_torque": 0.15}
SWING = (
    "{type: motion, at: output, trajectory: {type: multisine, amplitude_rad: 0.25,"
    " frequencies_hz: [0.2, 0.7], phases_deg: [-90, -90]}}"
)


def base_of(tmp_path) -> Scenario:
    text = BASE.replace("MESH", "lumped").replace("{type: free}", SWING)
    text = text.replace("load: {inertia_kg_m2: 0.5}", "load: {inertia_kg_m2: 0.5, gravity: "
                        "{mass_kg: 4, centre_of_mass_m: 0.3}}")  # fmt: skip
    path = tmp_path / "base.yaml"
    path.write_text(
        text.replace("{duration_s: 1.0}", "{duration_s: 8.0, sample_rate_hz: 500}"), encoding="utf-8"
    )
    return hdsim.load_scenario(path)


def measured(given: Scenario, effects: dict, seed: int) -> Record:
    """What the bench's sensors log of a scenario whose drive has the effects."""
    truth = given.model_copy(update={"effects": type(given.effects).model_validate(effects)})
    got = hdsim.simulate(truth)
    rng = np.random.default_rng(seed)
    start = got.time >= 0.3
    channels = {}
    for channel, noise in NOISE.items():
        source = f"measured_{channel}" if f"measured_{channel}" in got else channel
        channels[channel] = got[source][start] + noise * rng.standard_normal(int(start.sum()))
    return Record("bench", np.asarray(got.time[start] - got.time[start][0]), channels)


def candidates(bench: Bench, base: Scenario, names: list[str]) -> dict[str, Fit]:
    fitted = refit(bench, state_of(base)).fit
    frees = [
        replace(free, value=free.value * float(np.exp(t)))
        for free, t in zip(fitted.frees, fitted.theta, strict=True)
    ]
    found = {}
    for name in names:
        way = catalogue()[name].fittings[0]
        added = Added(name, way, (1.0,) * way.count(()), tuple(s.starts[0] for s in way.shapes))
        state = replace(fitted.state, added=(added,))
        found[name] = fit(bench, state, frees, prune=False, evaluations=6)
    return found


def losses(bench: Bench, fits: dict[str, Fit], turned_deg: float) -> dict[str, float]:
    """Misfit of each candidate with its effect as known from before, the base's own numbers free."""
    found = {}
    for name, one in fits.items():
        state = one.state
        if name == "sensors":
            # The encoder's eccentricity moves with the encoder.
            a, b = state.added[0].coefficients
            turn = np.radians(turned_deg)
            c = (a * np.cos(turn) - b * np.sin(turn), a * np.sin(turn) + b * np.cos(turn))
            state = replace(state, added=(replace(state.added[0], coefficients=c),))
        bench.weigh([np.zeros(len(s.measured)) for s in bench.series])
        again = fit(bench, state, one.frees, held_effects=1, prune=False, evaluations=4)
        found[name] = bench.power(again.predictions)
    return found


@pytest.mark.slow
def test_an_encoders_eccentricity_is_told_from_the_members_by_turning_the_encoder(tmp_path):
    base = base_of(tmp_path)
    hidden = {"output_angle": {"eccentricity_arcmin": 0.1, "eccentricity_phase_deg": 30}}
    bench = Bench(predictors([measured(base, {"sensors": hidden}, 1)], base.drive.ratio))
    fits = candidates(bench, base, ["sensors", "output_eccentricity"])
    found, text = propose(bench, fits, base=tmp_path / "base.yaml", beside=tmp_path)
    assert found.between == ["sensors", "output_eccentricity"]
    assert "encoder turned by 90 degrees" in found.sentence
    assert "output angle" in found.sentence
    assert found.separation > 3 * found.repeated
    assert found.considered[0].relative > 3
    assert found.correct > 0.95

    (tmp_path / "next.yaml").write_text(text, encoding="utf-8")
    proposed = hdsim.load_scenario(tmp_path / "next.yaml")
    assert proposed.drive == base.drive
    # The machine does it: its encoder has been turned. Diagnosed with both candidates, one is refuted.
    hidden["output_angle"]["eccentricity_phase_deg"] = 120
    record = measured(proposed, {"sensors": hidden}, 2)
    told = losses(Bench(predictors([record], base.drive.ratio)), fits, 90.0)
    hidden["output_angle"]["eccentricity_phase_deg"] = 30
    record = measured(base, {"sensors": hidden}, 3)
    again = losses(Bench(predictors([record], base.drive.ratio)), fits, 0.0)
    gain, before = (r["output_eccentricity"] - r["sensors"] for r in (told, again))
    assert gain > 30
    # The encoder's zero beside the motor's is estimated from each log, an eccentricity beside it to a tenth.
    assert gain > 3 * abs(before)


@pytest.mark.slow
@pytest.mark.parametrize(
    "truth",
    ["torsional_hysteresis_duhem", pytest.param("torsional_hysteresis_maxwell", marks=pytest.mark.study)],
)
def test_two_laws_of_hysteresis_are_told_apart_better_than_by_the_record(tmp_path, truth):
    base = base_of(tmp_path)
    duhem = {"stiffness_nm_per_rad": 1e4, "saturation_torque_nm": 1.0}
    slip = {"slip_torque_nm": 1.0, "slip_twist_scale": 0.5}
    size = duhem if truth.endswith("duhem") else slip
    bench = Bench(predictors([measured(base, {truth: size}, 4)], base.drive.ratio))
    fits = candidates(bench, base, ["torsional_hysteresis_duhem", "torsional_hysteresis_maxwell"])
    found, text = propose(bench, fits, base=tmp_path / "base.yaml", beside=tmp_path)
    assert found.separation > found.repeated
    (tmp_path / "next.yaml").write_text(text, encoding="utf-8")
    proposed = hdsim.load_scenario(tmp_path / "next.yaml")
    wrong = next(name for name in fits if name != truth)
    gains = []
    for given, seed in ((proposed, 5), (base, 6)):
        record = measured(given, {truth: size}, seed)
        locked = given.command.output.type == "locked"
        told = losses(
            Bench(predictors([record], base.drive.ratio, locked="output" if locked else "")), fits, 0.0
        )
        gains.append(told[wrong] - told[truth])
    assert gains[0] > max(gains[1], 0.0)


def test_the_distance_is_that_of_two_gaussian_predictions():
    rng = np.random.default_rng(1)
    n, p = 60, 3
    noise = {"motor_torque": 0.02, "output_angle": 1e-5}
    truth, fitted = ({c: s * rng.standard_normal(n) for c, s in noise.items()} for _ in range(2))
    slopes = [{c: fitted[c] + s * rng.standard_normal(n) for c, s in noise.items()} for _ in range(p)]
    root = rng.standard_normal((p, p))

    def stacked(one, other):
        parts = [np.sqrt(2.5) * (one[c] - other[c]) / s for c, s in noise.items()]
        return np.concatenate([part - part.mean() for part in parts])

    difference = stacked(truth, fitted)
    columns = np.column_stack([stacked(slope, fitted) / 0.5 for slope in slopes])
    total = np.eye(2 * n) + columns @ (root @ root.T) @ columns.T
    wanted = np.sqrt(difference @ np.linalg.solve(total, difference))
    found = separated(truth, fitted, slopes, [0.5] * p, root, noise, 2.5)
    assert found[0] == pytest.approx(wanted, rel=1e-9)
    # Numbers that may move anywhere take their whole direction away.
    free = separated(truth, fitted, slopes, [0.5] * p, 1e6 * np.eye(p), noise, 2.5)
    rest = difference - columns @ np.linalg.lstsq(columns, difference, rcond=None)[0]
    assert free[0] == pytest.approx(np.linalg.norm(rest), rel=1e-6)


@pytest.mark.parametrize("locked", [False, True])
@pytest.mark.parametrize("weighted", [False, True])
def test_every_experiment_is_a_scenario_within_the_limits(tmp_path, locked, weighted):
    limits = Limits(-0.4, 0.6, 0.8, 3.0, 52.0, 1.4e-3, 0.5, weighted, locked)
    base_of(tmp_path)
    tried = experiments(limits)
    assert len(tried) == (2 if locked else 10 + weighted)
    for k, experiment in enumerate(tried):
        data = {
            "extends": "base.yaml",
            "command": {"motor": experiment.motor, "output": experiment.output},
            "run": {"duration_s": experiment.duration_s},
        }
        if experiment.load:
            data["load"] = experiment.load
        path = tmp_path / f"{k}.yaml"
        with path.open("w", encoding="utf-8") as stream:
            YAML(typ="safe").dump(data, stream)
        loaded = hdsim.load_scenario(path)
        assert experiment.duration_s <= 20.0
        assert (loaded.command.output.type == "locked") >= locked
        times = np.linspace(0, experiment.duration_s, 4001)
        for motion in loaded.command.motions(-100.0):
            _, velocity, acceleration, _ = motion.signal.values(times)
            turned = 100.0 if motion.axis == "motor" else 1.0
            assert np.abs(velocity).max() <= 1.51 * limits.speed * turned
            assert np.abs(acceleration).max() * 0.5 <= 0.31 * 52.0 * turned
        if loaded.load.torque is not None:
            assert np.abs(loaded.load.torque.values(times)[0]).max() <= 52.0


def test_one_candidate_needs_no_experiment(tmp_path):
    with pytest.raises(InputError, match="at least two"):
        propose(None, {"sensors": None})
