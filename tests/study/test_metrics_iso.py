"""ISO 230-2 and ISO 9283 against a published report and against tables worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hdsim.errors import InputError
from hdsim.studies.metrics.iso import (
    half_range,
    iso_230_2,
    iso_9283_angle_repeatability,
    iso_9283_repeatability,
)

# Acceptance test of a linear axis, in mm, with its deviations and figures as printed: Paul Scherrer Institut,
# ecmccfg, examples/mcu1025_fat_sat/report.md ("ISO 230-2 motion test", 10 November 2021).
TARGETS = [15.0, 25.2, 35.4, 45.6, 55.8]
FORWARD = [
    [15.0033, 15.00452, 15.00085, 15.0033, 15.00595],
    [25.19933, 25.19913, 25.19933, 25.20015, 25.20117],
    [35.38477, 35.38762, 35.38395, 35.3864, 35.3866],
    [45.59182, 45.58978, 45.59263, 45.59263, 45.5908],
    [55.83882, 55.84025, 55.83964, 55.84086, 55.84005],
]
BACKWARD = [
    [15.10035, 14.9721, 14.9721, 14.96966, 14.97251],
    [25.27803, 25.2132, 25.21259, 25.21748, 25.21422],
    [35.39639, 35.38803, 35.38926, 35.39252, 35.3915],
    [45.57387, 45.57041, 45.5649, 45.56939, 45.57061],
    [55.79315, 55.79499, 55.79132, 55.79193, 55.7958],
]
#: One unit of the last printed digit. The positions are rounded to the same digit, which 4 s in R and in
#: A magnifies: their last digit can be off by two.
DIGIT = 1.01e-5


@pytest.fixture(scope="module")
def published():
    target = np.array(TARGETS)[:, None]
    return iso_230_2(np.array(FORWARD) - target, np.array(BACKWARD) - target)


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("mean_up", [0.00358, -0.00018, -0.01413, -0.00847, 0.03993]),
        ("mean_down", [-0.00266, 0.0271, -0.00846, -0.03016, -0.00656]),
        ("mean", [0.00046, 0.01346, -0.0113, -0.01932, 0.01668]),
        ("reversal_at", [0.00624, -0.02728, -0.00567, 0.02169, 0.04649]),
        ("deviation_up", [0.00188, 0.00085, 0.00148, 0.00124, 0.00076]),
        ("deviation_down", [0.05759, 0.02853, 0.00324, 0.00323, 0.00193]),
        ("repeatability_up_at", [0.00751, 0.00339, 0.00593, 0.00495, 0.00303]),
        ("repeatability_down_at", [0.23036, 0.11413, 0.01296, 0.01293, 0.00771]),
        ("repeatability_at", [0.23036, 0.11413, 0.01511, 0.03063, 0.05185]),
        ("reversal", 0.04649),
        ("mean_reversal", 0.00829),
        ("repeatability_up", 0.00751),
        ("repeatability_down", 0.23036),
        ("repeatability", 0.23036),
        ("systematic_up", 0.05405),
        ("systematic_down", 0.05727),
        ("mean_error", 0.036),
        ("accuracy_up", 0.05853),
        ("accuracy_down", 0.23036),
        ("accuracy", 0.23036),
    ],
)
def test_the_published_report_is_reproduced_to_its_last_digit(published, name, printed) -> None:
    allowed = 2 * DIGIT if name.startswith(("repeatability", "accuracy")) else DIGIT
    np.testing.assert_allclose(getattr(published, name), printed, rtol=0, atol=allowed)


def test_the_bidirectional_systematic_error_spans_the_means_of_both_directions(published) -> None:
    # The report prints its forward value here; the standard takes the range over both directions:
    # largest mean 0.039924 (forward, 55.8), smallest -0.030164 (backward, 45.6).
    assert published.systematic == pytest.approx(0.039924 + 0.030164, abs=1e-9)


def test_a_table_worked_out_by_hand() -> None:
    # Deviations in arcsec, three approaches. Sums of squares about the means: 2, 8 and 0.5; 2, 2 and 0.
    up = [[1, 2, 3], [4, 6, 8], [-2, -2.5, -1.5]]
    down = [[5, 6, 7], [3, 4, 5], [-6, -6, -6]]
    found = iso_230_2(up, down)
    assert found.mean_up.tolist() == [2, 6, -2]
    assert found.mean_down.tolist() == [6, 4, -6]
    assert found.deviation_up.tolist() == [1, 2, 0.5]
    assert found.deviation_down.tolist() == [1, 1, 0]
    assert found.reversal_at.tolist() == [-4, 2, 4]
    assert (found.reversal, found.mean_reversal) == (4, pytest.approx(2 / 3))
    # R_i = max(2 s_up + 2 s_down + |B_i|, 4 s_up, 4 s_down)
    assert found.repeatability_at.tolist() == [8, 8, 5]
    assert (found.repeatability_up, found.repeatability_down, found.repeatability) == (8, 4, 8)
    # M over means 4, 5, -4; E over 2, 6, -2, 6, 4, -6
    assert (found.mean_error, found.systematic) == (9, 12)
    assert (found.systematic_up, found.systematic_down) == (8, 12)
    # Highest mean + 2 s: 6 + 4; lowest mean - 2 s: -6 - 0
    assert (found.accuracy, found.accuracy_up, found.accuracy_down) == (16, 13, 14)


tables = arrays(float, (4, 5), elements=st.floats(-100, 100, width=32))


@given(tables, tables, st.floats(-50, 50))
def test_figures_do_not_depend_on_the_zero_and_swap_with_the_directions(up, down, offset) -> None:
    found, moved, swapped = iso_230_2(up, down), iso_230_2(up + offset, down + offset), iso_230_2(down, up)
    for name in ("accuracy", "repeatability", "reversal", "mean_error", "systematic", "accuracy_up"):
        assert getattr(moved, name) == pytest.approx(getattr(found, name), abs=1e-9)
    for name in ("accuracy", "repeatability", "reversal", "mean_error", "systematic"):
        assert getattr(swapped, name) == pytest.approx(getattr(found, name), abs=1e-9)
    assert found.accuracy >= found.systematic - 1e-9
    assert found.systematic >= found.mean_error - 1e-9
    assert found.repeatability >= found.reversal - 1e-9


def test_iso_9283_by_hand() -> None:
    # Barycentre (0, 0); distances 5, 5, 5, 5, 10, 10: mean 20/3, sum of squares 100/3, S = sqrt(20/3).
    points = [[3, 4], [-3, -4], [4, -3], [-4, 3], [6, 8], [-6, -8]]
    found = iso_9283_repeatability(points)
    assert found.mean_distance == pytest.approx(20 / 3)
    assert found.deviation == pytest.approx((20 / 3) ** 0.5)
    assert round(found.positioning, 4) == 14.4126
    # One coordinate: 1, 2, 3, 4, 5 about 3: distances 2, 1, 0, 1, 2, mean 1.2, S = sqrt(2.8/4).
    assert round(iso_9283_repeatability([1, 2, 3, 4, 5]).positioning, 4) == 3.7100
    assert iso_9283_angle_repeatability([1, 2, 3, 4, 5]) == pytest.approx(3 * 2.5**0.5)
    assert half_range([1.0, 7.0, 4.0]) == 3.0


def test_too_few_approaches_are_refused() -> None:
    with pytest.raises(InputError, match="at least twice"):
        iso_230_2([[1.0], [2.0]], [[1.0], [2.0]])
    with pytest.raises(InputError, match=r"tables of shape \(1, 3\) and \(1, 2\)"):
        iso_230_2([[1.0, 2.0, 3.0]], [[1.0, 2.0]])
    with pytest.raises(InputError, match="found 1"):
        iso_9283_repeatability([1.0])
