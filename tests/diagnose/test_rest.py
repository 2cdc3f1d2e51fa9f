"""What holds a shaft at rest is not one more effect; an effect that is there is found beside a rest."""

from types import SimpleNamespace

import numpy as np
import pytest
from moves import NOISE, SWINGING
from noisy import noisy

import hdsim
from hdsim.diagnosis.rest import sticks_beside
from hdsim.diagnosis.workflow import diagnose
from hdsim.scenario import Scenario


def diagnosed(effects):
    plant = SWINGING | {"effects": effects}
    record = noisy(hdsim.simulate(Scenario.model_validate(plant)), NOISE, seed=3)
    return diagnose([record], Scenario.model_validate(SWINGING)).verdict


@pytest.mark.slow
def test_a_drive_that_only_sticks_at_its_reversals_lacks_nothing():
    """Seen without the hypothesis of a rest: "unbalance", 81 % sure."""
    verdict = diagnosed({})
    assert verdict.verdict == "nothing"
    assert all(gap.after < 1.1 * gap.noise for gap in verdict.gap.values())


@pytest.mark.slow
def test_an_effect_is_named_alone_beside_a_rest():
    """Seen without: an eccentricity and an unbalance as well, and a torque of 1.06 times its noise left.

    Seen without look-alikes from where the best led: Maxwell slip for Duhem's.
    """
    verdict = diagnosed({"torsional_hysteresis_duhem": {"saturation_torque_nm": 1.0}})
    (named,) = verdict.effects
    assert named.name == "torsional_hysteresis_duhem"
    assert not named.indistinguishable_from
    assert all(gap.after < 1.03 * gap.noise for gap in verdict.gap.values())


@pytest.mark.parametrize(
    ("explained", "trace", "sticks"),
    [
        (0.0, None, True),  # nobody tells of the torque that is missed at rest
        (0.0, "rest", False),  # an effect that was not named would explain it
        (0.0, "everywhere", True),  # it would, but for what it does while the shaft turns
        (0.8, None, False),  # what was named tells of it: its formula may be a rough one
    ],
)
def test_a_shaft_sticks_beside_an_effect_where_no_effect_tells_of_its_rests(explained, trace, sticks):
    """At rest the torque stays where friction's sign has turned: 20 times the noise are missed."""
    time = np.arange(4000) * 0.002
    speed = 3.0 * np.sin(2.0 * time)
    rest = np.abs(speed) < 0.02
    held = np.where(rest, 2.0, 0.0)
    noise = 0.1 * np.random.default_rng(1).standard_normal(len(time))
    predictor = SimpleNamespace(
        speed_noise=4e-3, motor_velocity=speed, motor_angle=-1.5 * np.cos(2.0 * time), angle_noise=1e-5
    )
    rows = np.ones(len(time), dtype=bool)
    measured = SimpleNamespace(
        channel="motor_torque", record=0, train=rows, hold=~rows, noise=0.1, measured=3.0 + held + noise,
        block=np.arange(len(time)) // 40,
    )  # fmt: skip
    bench = SimpleNamespace(
        predictors=[predictor],
        series=[measured],
        residuals=lambda predictions: [measured.measured - predictions[0]],
        stacked_series=lambda: np.zeros(int(measured.train.sum()), dtype=int),
    )
    friction = SimpleNamespace(sticks=True, coulomb_nm=1.0, load_coefficient=0.0)

    def model(part):
        state = SimpleNamespace(drive=SimpleNamespace(friction=friction))
        return SimpleNamespace(state=state, predictions=[3.0 + part * held])

    columns = {"rest": held, "everywhere": held + np.cos(7.0 * time)}
    traces = [columns[trace][:, None]] if trace else []
    assert sticks_beside(bench, model(0.0), model(explained), traces) == sticks
    assert np.all(measured.train | (np.abs(speed) < 0.5))
    assert measured.train.all() != sticks
    assert not sticks_beside(bench, model(0.0), model(explained), traces)  # nor again, for ever
