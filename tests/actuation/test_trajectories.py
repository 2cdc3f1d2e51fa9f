import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from hdsim.actuation._signal_kernel import CUBIC
from hdsim.actuation.signal_data import Move, Segment, SignalData
from hdsim.actuation.signals import AngleTrajectory, TorqueSignal, VelocityTrajectory
from hdsim.errors import InputError

ANGLE = TypeAdapter(AngleTrajectory)
TORQUE = TypeAdapter(TorqueSignal)
VELOCITY = TypeAdapter(VelocityTrajectory)


def angle(**fields):
    return ANGLE.validate_python(fields)


def torque(**fields):
    return TORQUE.validate_python(fields)


def grid(signal, start=0.0, end=None, points=2001):
    """Times within the smooth spans of a signal, each with a time that chooses its span."""
    end = signal.end_time * 1.1 + 0.1 if end is None else end
    edges = np.concatenate([[start], signal.corners(start, end), [end]])
    times = np.concatenate(
        [np.linspace(a, b, max(9, points // len(edges))) for a, b in itertools.pairwise(edges)]
    )
    inside = np.concatenate(
        [np.full(max(9, points // len(edges)), 0.5 * (a + b)) for a, b in itertools.pairwise(edges)]
    )
    return times, inside


EVERY_SHAPE = [
    {"type": "hold", "torque_nm": 3.0},
    {"type": "step", "height_nm": 2.0, "initial_nm": 1.0, "start_time_s": 0.3},
    {"type": "ramp", "rate_nm_per_s": 4.0, "duration_s": 1.0, "start_time_s": 0.2},
    {"type": "ramp", "rate_nm_per_s": -4.0, "duration_s": 1.0, "rate_change_nm_per_s2": 20.0},
    {
        "type": "sine",
        "amplitude_nm": 2.0,
        "frequency_hz": 3.0,
        "phase_deg": 30.0,
        "offset_nm": 1.0,
        "cycles": 2.5,
    },
    {
        "type": "chirp",
        "amplitude_nm": 2.0,
        "start_frequency_hz": 0.5,
        "end_frequency_hz": 9.0,
        "duration_s": 2.0,
    },
    {
        "type": "chirp",
        "amplitude_nm": 2.0,
        "start_frequency_hz": 9.0,
        "end_frequency_hz": 0.5,
        "duration_s": 2.0,
        "sweep": "linear",
        "phase_deg": 20.0,
        "start_time_s": 0.1,
    },
    {"type": "multisine", "amplitude_nm": 0.5, "fundamental_hz": 0.5, "highest_hz": 4.0, "duration_s": 2.0},
    {"type": "triangle", "amplitude_nm": 5.0, "frequency_hz": 1.0, "cycles": 2, "start_time_s": 0.15},
    {
        "type": "sequence",
        "initial_nm": 1.0,
        "repeat": 2,
        "moves": [
            {"type": "ramp", "rate_nm_per_s": 3.0, "duration_s": 0.5},
            {"type": "hold", "duration_s": 0.2},
            {"type": "sine", "amplitude_nm": 1.0, "frequency_hz": 5.0, "cycles": 2},
        ],
    },
]
ids = [f"{shape['type']}{n}" for n, shape in enumerate(EVERY_SHAPE)]


@pytest.mark.parametrize("fields", EVERY_SHAPE, ids=ids)
def test_kernel_derivatives_match_finite_differences(fields):
    signal = torque(**fields)
    times, inside = grid(signal, end=2.5)
    h = 1e-5
    exact = signal.data.values(times, inside)
    ahead, behind = signal.data.values(times + h, inside), signal.data.values(times - h, inside)
    numerical = (ahead - behind) / (2.0 * h)
    scale = np.max(np.abs(exact), axis=1) + 1.0
    for k in range(3):
        # Truncation h^2/6 times the derivative two orders up, about (2 pi f)^2 of the one compared.
        assert np.max(np.abs(numerical[k] - exact[k + 1])) < 3e-6 * scale[k + 1]


@pytest.mark.parametrize("fields", EVERY_SHAPE, ids=ids)
def test_the_compiled_kernel_does_what_the_python_function_says(fields):
    signal = torque(**fields)
    times, inside = grid(signal, end=2.5, points=200)
    compiled = signal.data.values(times, inside)
    interpreted = np.zeros((4, len(times)))
    for n, (t, i) in enumerate(zip(times, inside, strict=False)):
        signal.kernel.function(t, i, signal.pack(), interpreted[:, n])
    np.testing.assert_allclose(compiled, interpreted, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("fields", EVERY_SHAPE, ids=ids)
def test_nothing_jumps_between_corners(fields):
    signal = torque(**fields)
    dt = 1e-7
    t = np.linspace(0.0, 2.5, 100_001)
    before, after = signal.values(t - dt), signal.values(t + dt)
    corners = np.concatenate([[0.0], signal.corners(0.0, 2.6)])
    near = np.min(np.abs(t[:, None] - corners[None, :]), axis=1) < 2.0 * dt
    rate = np.max(np.abs(signal.values(t)), axis=1)
    for k in range(3):
        assert (
            np.max(np.abs(after[k] - before[k])[~near], initial=0.0) <= 2.5 * dt * rate[k + 1] * 1.01 + 1e-9
        )


limits = st.floats(0.01, 1e3)


@settings(max_examples=150, deadline=None)
@given(st.floats(1e-3, 1e3), st.booleans(), limits, limits)
def test_a_trapezoid_covers_its_distance_in_the_shortest_time_within_its_limits(d, back, v, a):
    signal = angle(
        type="trapezoid",
        distance_rad=-d if back else d,
        maximum_velocity_rad_per_s=v,
        maximum_acceleration_rad_per_s2=a,
    )
    shortest = d / v + v / a if d >= v * v / a else 2.0 * math.sqrt(d / a)
    assert signal.end_time == pytest.approx(shortest, rel=1e-12)
    times, inside = grid(signal, points=300)
    value, rate, acceleration, _ = signal.data.values(times, inside)
    assert value[0] == 0.0
    assert value[-1] == signal.si.distance
    assert np.max(np.abs(rate)) <= v * (1.0 + 1e-9)
    assert np.max(np.abs(acceleration)) <= a * (1.0 + 1e-9)
    assert np.all(np.diff(np.abs(value)) >= -1e-9 * d)
    # The parts before and after the end of the move meet there.
    end = signal.end_time
    rise = min(v, math.sqrt(d * a)) / a
    left = signal.data.values([end], [end - 0.5 * rise])[:2, 0]
    assert abs(left[0] - signal.si.distance) < 1e-9 * d
    # The time itself is rounded, to 2e-16 of the end.
    assert abs(left[1]) < 1e-8 * v + 1e-15 * end * a


@settings(max_examples=150, deadline=None)
@given(st.floats(1e-3, 1e3), st.booleans(), limits, limits, limits)
def test_an_s_curve_covers_its_distance_within_its_limits_and_without_jumps(d, back, v, a, j):
    signal = angle(
        type="s_curve",
        distance_rad=-d if back else d,
        maximum_velocity_rad_per_s=v,
        maximum_acceleration_rad_per_s2=a,
        maximum_jerk_rad_per_s3=j,
    )
    end = signal.end_time
    times = np.linspace(0.0, end, 1001)
    _value, rate, acceleration, jerk = signal.values(times)
    assert np.max(np.abs(rate)) <= v * (1.0 + 1e-9)
    assert np.max(np.abs(acceleration)) <= a * (1.0 + 1e-9)
    assert np.max(np.abs(jerk)) <= j * (1.0 + 1e-9)
    assert len(signal.corners(0.0, end + 1.0)) == 0
    before = signal.values([end * (1.0 - 1e-12)])[:3, 0]
    assert before[0] == pytest.approx(signal.si.distance, rel=1e-8)
    assert abs(before[1]) <= 1e-5 * np.max(np.abs(rate))
    assert signal.values([end + 1.0])[0, 0] == signal.si.distance
    # Time-optimal: one of the limits is always met.
    met = (
        np.isclose(np.abs(rate), v, rtol=1e-6)
        | np.isclose(np.abs(acceleration), a, rtol=1e-6)
        | np.isclose(np.abs(jerk), j, rtol=1e-6)
    )
    assert np.mean(met) > 0.98


def test_an_s_curve_of_known_limits_takes_the_textbook_time():
    # Biagiotti and Melchiorri (2008), sec. 3.4: T_j = a/j = 1/3, T_a = T_j + v/a, T_v = d/v - T_a.
    signal = angle(
        type="s_curve",
        distance_rad=10.0,
        maximum_velocity_rad_per_s=5.0,
        maximum_acceleration_rad_per_s2=10.0,
        maximum_jerk_rad_per_s3=30.0,
    )
    assert signal.end_time == pytest.approx(2.0 + 1.0 / 3.0 + 0.5, rel=1e-12)


def test_units_mean_the_same_move():
    limits = {"maximum_acceleration_rad_per_s2": 3.0}
    moves = [
        angle(type="trapezoid", distance_turns=0.5, maximum_velocity_rpm=30.0, **limits),
        angle(type="trapezoid", distance_deg=180.0, maximum_velocity_deg_per_s=180.0, **limits),
        angle(type="trapezoid", distance_rad=math.pi, maximum_velocity_rad_per_s=math.pi, **limits),
    ]
    t = np.linspace(0.0, 3.0, 50)
    for move in moves[1:]:
        np.testing.assert_allclose(move.values(t), moves[0].values(t), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", ["trapezoid", "s_curve"])
def test_a_move_of_no_distance_is_over_at_once(kind):
    limits = {"maximum_velocity_rpm": 1.0, "maximum_acceleration_rad_per_s2": 1.0}
    limits |= {"maximum_jerk_rad_per_s3": 1.0} if kind == "s_curve" else {}
    signal = angle(type=kind, distance_rad=0.0, start_time_s=0.5, **limits)
    assert signal.end_time == 0.5
    assert not signal.values([0.0, 0.5, 1.0]).any()


def test_a_ramp_of_velocity_is_an_acceleration():
    signal = VELOCITY.validate_python({"type": "ramp", "acceleration_rad_per_s2": 2.0, "duration_s": 3.0})
    assert signal.values([3.5])[0, 0] == pytest.approx(6.0)


def test_a_smooth_ramp_runs_on_for_ever():
    signal = angle(type="ramp", velocity_rad_per_s=10.0, acceleration_rad_per_s2=20.0)
    assert math.isinf(signal.end_time)
    np.testing.assert_allclose(signal.values([0.25, 100.0])[:2, :], [[0.625, 997.5], [5.0, 10.0]], rtol=1e-12)


@pytest.mark.parametrize("sweep", ["linear", "exponential"])
def test_a_chirp_passes_its_frequencies(sweep):
    from scipy.signal import chirp

    signal = torque(
        type="chirp",
        amplitude_nm=2.0,
        start_frequency_hz=1.0,
        end_frequency_hz=20.0,
        duration_s=4.0,
        sweep=sweep,
        phase_deg=90.0,
    )
    t = np.linspace(0.0, 3.999, 400)
    method = "linear" if sweep == "linear" else "logarithmic"
    np.testing.assert_allclose(signal.values(t)[0], 2.0 * chirp(t, 1.0, 4.0, 20.0, method), atol=1e-10)


def test_schroeder_phases_keep_the_peak_low():
    fields = {"type": "multisine", "amplitude_nm": 1.0, "fundamental_hz": 1.0, "highest_hz": 31.0}
    t = np.linspace(0.0, 1.0, 4001)

    def crest(signal):
        value = signal.values(t)[0]
        return np.max(np.abs(value)) / np.sqrt(np.mean(value[:-1] ** 2))

    assert crest(torque(**fields)) < 2.0
    assert crest(torque(**fields, phases_deg=[0.0] * 31)) > 4.0


def test_odd_multisine_has_odd_lines_only():
    signal = torque(
        type="multisine", amplitude_nm=1.0, fundamental_hz=1.0, highest_hz=9.0, odd_harmonics_only=True
    )
    spectrum = np.abs(np.fft.rfft(signal.values(np.arange(64) / 64.0)[0])) / 32.0
    np.testing.assert_allclose(spectrum[:11], [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0], atol=1e-9)


def test_a_triangle_turns_where_it_says():
    signal = torque(type="triangle", amplitude_nm=5.0, frequency_hz=2.0, cycles=2, start_time_s=1.0)
    np.testing.assert_allclose(signal.corners(0.0, 9.0), [1.0, 1.125, 1.375, 1.625, 1.875, 2.0])
    np.testing.assert_allclose(
        signal.values([1.0, 1.125, 1.25, 1.375, 2.0, 3.0])[0], [0, 5, 0, -5, 0, 0], atol=1e-12
    )


def test_a_sequence_goes_on_from_the_last_value_and_pauses():
    there = {
        "type": "trapezoid",
        "distance_deg": 90,
        "maximum_velocity_rpm": 60,
        "maximum_acceleration_rad_per_s2": 100,
    }
    back = {**there, "distance_deg": -90}
    pause = {"type": "hold", "duration_s": 0.5}
    signal = angle(type="sequence", moves=[there, pause, back, pause], repeat=3)
    one = angle(**there).end_time
    period = 2.0 * (one + 0.5)
    assert signal.end_time == pytest.approx(3.0 * period)
    at = np.array([one + 0.25, period - 0.25])
    for turn in range(3):
        np.testing.assert_allclose(np.rad2deg(signal.values(at + turn * period)[0]), [90.0, 0.0], atol=1e-9)


def test_a_span_may_run_a_little_over_its_end():
    signal = torque(type="step", height_nm=2.0, start_time_s=1.0)
    assert signal.data.values([1.0, 1.0], [0.9, 1.1])[0].tolist() == [0.0, 2.0]
    move = angle(
        type="trapezoid", distance_rad=1, maximum_velocity_rad_per_s=1, maximum_acceleration_rad_per_s2=10
    )
    assert move.data.values([0.11], [0.05])[1, 0] == pytest.approx(1.1)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"type": "step"}, "exactly one of height_rad, height_deg"),
        ({"type": "hold", "angle_deg": 1, "angle_rad": 1}, "found angle_rad and angle_deg"),
        ({"type": "sine", "amplitude_deg": -1, "frequency_hz": 1}, "greater than or equal to 0"),
        ({"type": "ramp", "velocity_rpm": 1, "duration_s": 0.1, "acceleration_rpm_per_s": 1}, "at least 2"),
        ({"type": "multisine", "amplitude_deg": 1, "fundamental_hz": 2, "highest_hz": 1}, "grid is empty"),
        ({"type": "multisine", "amplitude_deg": 1}, "either frequencies_hz"),
        ({"type": "sequence", "moves": [{"type": "ramp", "velocity_rpm": 1}, {"type": "hold"}]}, "move 1"),
        ({"type": "wobble"}, "'s_curve'"),
    ],
)  # fmt: skip
def test_a_wrong_signal_is_refused_with_what_is_wrong(fields, message):
    with pytest.raises(ValidationError, match=message):
        angle(**fields)


def write(tmp_path, text):
    path = tmp_path / "load.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("interpolation", ["linear", "pchip", "spline"])
def test_a_recorded_signal_is_scipys_interpolation(tmp_path, interpolation):
    from scipy.interpolate import CubicSpline, PchipInterpolator

    rng = np.random.default_rng(1)
    t, v = np.cumsum(rng.uniform(0.1, 0.5, 12)), rng.normal(size=12)
    rows = [f"{a!r},x,{b!r}\n" for a, b in zip(t.tolist(), v.tolist(), strict=True)]
    write(tmp_path, "t,force,T\n" + "".join(rows))
    signal = torque(
        type="recorded",
        file=str(tmp_path / "load.csv"),
        time_column="t",
        value_column="T",
        interpolation=interpolation,
    )
    fine = np.linspace(t[0], t[-1] - 1e-9, 500)
    reference = {
        "linear": lambda x: np.interp(x, t, v),
        "pchip": PchipInterpolator(t, v),
        "spline": CubicSpline(t, v),
    }
    np.testing.assert_allclose(signal.values(fine)[0], reference[interpolation](fine), atol=1e-12)
    np.testing.assert_allclose(signal.values([0.0, t[-1] + 1.0])[0], [v[0], v[-1]])
    assert signal.end_time == t[-1]
    expected = {"linear": t, "pchip": t, "spline": t[[0, -1]]}[interpolation]
    np.testing.assert_allclose(signal.corners(0.0, 99.0), expected)
    # Whatever the span, the value at a time is the same: joints without a jump may lie within a span.
    middle = np.full(500, 0.5 * (t[0] + t[-1]))
    if interpolation == "spline":
        np.testing.assert_allclose(signal.data.values(fine, middle)[0], reference["spline"](fine), atol=1e-12)


def test_a_recorded_angle_has_a_unit(tmp_path):
    path = write(tmp_path, "# encoder\ntime,value\n0,0\n\n1,180\n")
    signal = angle(type="recorded", file=str(path), value_unit="deg")
    assert signal.values([0.5])[0, 0] == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("time,speed\n0,1\n1,1\n", r"load.csv:1: column 'value' is not there; found: time, speed"),
        ("time,value\n0,1\n1,abc\n", r"load.csv:3: value: found 'abc'"),
        ("time,value\n0,1\n1,nan\n", r"load.csv:3: value: found 'nan'"),
        ("time,value\n0,1\n0,2\n", r"load.csv:3: time: found 0 after 0"),
        ("time,value\n0,1\n1\n", r"load.csv:3: 1 fields, expected 2"),
        ("time,value\n0,1\n", "at least two rows"),
    ],
)
def test_a_wrong_file_is_refused_with_its_line(tmp_path, text, message):
    with pytest.raises(ValidationError, match=message):
        torque(type="recorded", file=str(write(tmp_path, text)))


def test_signals_of_the_same_numbers_share_what_is_made_of_them():
    wave = {"amplitude_deg": 10, "frequency_hz": 2}
    one, same = angle(type="sine", **wave), angle(type="sine", **wave)
    assert same.data is one.data
    assert angle(type="sine", amplitude_rad=one.si.amplitude, frequency_hz=2).data is one.data
    assert angle(type="sine", amplitude_deg=10.000001, frequency_hz=2).data is not one.data
    assert angle(type="triangle", **wave).data is not one.data
    moves = [
        angle(type="sequence", moves=[{"type": kind, **wave, "cycles": 2}]) for kind in ("sine", "triangle")
    ]
    times = np.linspace(0.0, 1.0, 101)
    assert not np.allclose(moves[0].values(times)[0], moves[1].values(times)[0])


def test_a_file_that_has_changed_is_another_signal(tmp_path):
    path = write(tmp_path, "time,value\n0,0\n1,180\n")
    fields = {"type": "recorded", "file": str(path), "value_unit": "deg"}
    for build in (lambda: angle(**fields), lambda: angle(type="sequence", moves=[fields])):
        write(tmp_path, "time,value\n0,0\n1,180\n")
        before = build().values([0.5])[0, 0]
        write(tmp_path, "time,value\n0,0\n1,90\n")
        assert build().values([0.5])[0, 0] == pytest.approx(0.5 * before)


def test_a_missing_or_binary_file_is_refused(tmp_path):
    from hdsim.actuation.recorded import read_columns

    with pytest.raises(ValidationError, match="cannot be read"):
        torque(type="recorded", file=str(tmp_path / "none.csv"))
    path = tmp_path / "binary.csv"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="UTF-8"):
        read_columns(path, ["time"])


def test_pieces_of_any_spacing_are_found_as_by_a_plain_search():
    """Against SciPy's piecewise polynomials, at and beside every knot: even, clustered, random and few."""
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(4)
    even = np.linspace(0.3, 2.3, 601)
    clustered = np.unique(np.concatenate([[0.3, 2.3], 1.0 + 1e-5 * rng.uniform(size=300)]))
    for starts in (even, clustered, np.unique(rng.uniform(0.3, 2.3, 50)), np.array([0.3, 0.4])):
        spline = CubicSpline(starts, rng.standard_normal(len(starts)))
        rows = [tuple(row) for row in spline.c[::-1].T.tolist()]
        segment = Segment(CUBIC, starts[:-1].tolist(), rows)
        move = Move((segment,), float(starts[-1]), 0.0, float(spline(starts[-1])))
        found = SignalData(move)
        inner = starts[1:-1]
        times = np.concatenate(
            [starts[:-1], np.nextafter(inner, 9.0), rng.uniform(starts[0], starts[-1], 500)]
        )
        values = found.values(times)
        for order in range(3):
            size = np.abs(spline(starts, order)).max()
            np.testing.assert_allclose(values[order], spline(times, order), rtol=1e-7, atol=1e-9 * size)
        assert not found.values(np.array([0.1])).any()
