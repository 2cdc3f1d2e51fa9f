"""Gaps in the motion: bridged where a spline can, else the record is cut there."""

import numpy as np
import pytest
from moves import MOVES, NOISE
from noisy import noisy

import hdsim
from hdsim.errors import InputError
from hdsim.estimate.bridges import cut
from hdsim.estimate.data_problems import Check
from hdsim.estimate.estimation import estimate
from hdsim.estimate.opening import checked
from hdsim.estimate.records import Record
from hdsim.scenario import Scenario

RATE_HZ = 1000.0
#: Readings come for 0.3 s at a time.
GAPPY = [(0.5 * k + 0.3, 0.5 * k + 0.5) for k in range(8)]


def moving(
    *gaps: tuple[float, float], rows: bool = False, noise: float = 3e-5, lasts_s: float = 4.0
) -> Record:
    """A motor that swings at 1 Hz; between the ends of a gap nothing is read, or there are no rows."""
    time = np.arange(0.0, lasts_s, 1.0 / RATE_HZ)
    angle = 30.0 * np.sin(2 * np.pi * time) + noise * np.random.default_rng(4).standard_normal(len(time))
    read = ~np.logical_or.reduce(
        [np.zeros(len(time), dtype=bool), *((time > a) & (time < b) for a, b in gaps)]
    )
    torque = 0.3 * np.cos(2 * np.pi * time)
    if rows:
        return Record("swing", time[read], {"motor_angle": angle[read], "motor_torque": torque[read]})
    return Record("swing", time, {"motor_angle": np.where(read, angle, np.nan), "motor_torque": torque})


def pieces(record: Record, *given: str) -> tuple[list[Record], Check]:
    found = Check()
    return cut(record, given or ("motor_angle",), found), found


def test_a_record_without_gaps_stays_as_it_is():
    record = moving()
    assert pieces(record) == ([record], Check())


@pytest.mark.parametrize("rows", [False, True])
def test_a_gap_that_no_spline_bridges_cuts_a_record(rows):
    [first, second], found = pieces(moving((1.2, 1.5), rows=rows))
    assert (first.name, second.name) == ("swing from 0 s", "swing from 1.5 s")
    assert first.duration_s == pytest.approx(1.2)
    assert second.begins_s == pytest.approx(1.5)
    assert second.time[0] == 0.0
    assert second.duration_s == pytest.approx(2.499)
    for piece in (first, second):
        assert piece.trusted["motor_angle"].all()
        assert np.allclose(
            piece.channels["motor_torque"], 0.3 * np.cos(2 * np.pi * (piece.time + piece.begins_s))
        )
    [problem] = found.problems
    assert (problem.kind, problem.severity, problem.channel) == ("gap", "warning", "motor_angle")
    assert "0.3 s from 1.2 s" in problem.message
    assert "2 pieces" in problem.message


def test_whether_a_gap_is_bridged_depends_on_the_noise_and_not_on_its_length_alone():
    assert len(pieces(moving((1.2, 1.25), noise=3e-3))[0]) == 1
    assert len(pieces(moving((1.2, 1.25), noise=3e-6))[0]) == 2


def test_what_is_bridged_keeps_all_of_its_rows():
    record = moving((1.2, 1.205), (2.0, 2.004))
    [whole], found = pieces(record)
    assert len(whole.time) == len(record.time)
    assert not found.problems


def test_a_record_begins_and_ends_with_a_reading():
    [record], found = pieces(moving((-1.0, 0.1), (3.9, 5.0)))
    assert record.duration_s == pytest.approx(3.8)
    assert record.begins_s == pytest.approx(0.1)
    assert not found.problems


def test_pieces_that_are_too_short_are_left_out_and_said():
    kept, found = pieces(moving((0.3, 0.6), (2.0, 2.3)))
    assert [piece.begins_s for piece in kept] == pytest.approx([0.6, 2.3])
    assert (
        "2 pieces are records of their own, 1 shorter than 200 samples or 0.5 s" in found.problems[0].message
    )


def test_a_record_that_is_mostly_gaps_is_refused():
    record = moving(*GAPPY)
    [same], found = pieces(record)
    assert same is record
    assert found.errors[0].kind == "gap"
    assert "allowed: at least 50 %" in found.errors[0].message


def test_a_gap_in_what_is_only_compared_cuts_nothing():
    record = moving()
    record.channels["motor_torque"][1200:1500] = np.nan
    record.trusted["motor_torque"][1200:1500] = False
    assert len(pieces(record)[0]) == 1
    assert len(pieces(record, "motor_angle", "motor_torque")[0]) == 2


def test_a_fit_across_a_gap_leaves_the_noise():
    """Behind a bridge of 0.3 s the load would ring with 100 times the noise."""
    base = Scenario.model_validate(MOVES)
    log = noisy(hdsim.simulate(base), NOISE, seed=5)
    for values in log.channels.values():
        values[1200:1500] = np.nan
    log = Record("moves", log.time, log.channels)
    off = base.with_({"drive.friction.coulomb_nm": 1.2 * base.drive.friction.coulomb_nm})
    found = estimate([log], off)
    assert [p.record.name for p in found.bench.predictors] == ["moves from 0 s", "moves from 1.5 s"]
    for channel, gap in found.gap.items():
        assert gap.after < 1.3 * NOISE[channel]


def test_the_command_says_that_nothing_is_left():
    base = Scenario.model_validate(MOVES)
    with pytest.raises(InputError, match=r"swing: motor_angle: gap: .* pieces of at least 200 samples"):
        checked([moving(*GAPPY)], base)
