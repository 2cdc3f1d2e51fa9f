"""The figures: what they show of series, spectra and places."""

import re
from dataclasses import replace

import numpy as np
import pytest
from telling import EFFECT, GAP, place, told

from hdsim.tell.figures import gap_bars, trace_figure, whole_figure, worst_stretch
from hdsim.tell.figures_where import LABELS, located_figure
from hdsim.tell.findings import Step


def test_the_stretch_shown_closely_is_the_worst_of_the_held_out_ones():
    time = np.arange(9000) / 1000.0
    hold = (np.arange(9000) // 1000) % 3 == 2
    off = np.ones(9000)
    off[500:600] = 50.0  # worse, but the fits have seen it
    off[5300:5400] = 5.0
    stretch = worst_stretch(time, [np.where(hold, off, 0.0)], hold)
    assert stretch.start <= 5300
    assert stretch.stop >= 5400
    assert hold[stretch].all()
    assert stretch.stop - stretch.start <= 900


def labels(figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_spectrum_names_its_peak_and_what_these_turns_cannot_tell_from_it(found):
    figure = located_figure(found)
    assert any(axes.get_xlabel() == "order: periods per wave-generator turn" for axes in figure.axes)
    # The flexspline has 200 teeth, the circular spline 202: 4 turns of one are 4.04 against the other.
    assert any(re.fullmatch(r"4(/4\.04)?", label) for label in labels(figure))


@pytest.mark.parametrize("coordinate", list(LABELS))
def test_every_coordinate_has_a_picture(found, coordinate):
    if coordinate in ("torque", "temperature"):
        pytest.skip("the bench has no such channel")
    places = [place(coordinate, 0.5), place("direction", 0.1)]
    first = found.evidence.stages[0].model_copy(update={"places": places})
    figure = located_figure(replace(found, evidence=found.evidence.model_copy(update={"stages": [first]})))
    assert len(figure.axes) == 2
    assert figure.axes[1].get_title(loc="left").startswith("motor torque: 50 %")
    assert figure.axes[1].lines
    assert figure.axes[1].get_xlabel()
    figure.draw_without_rendering()


def test_effects_on_the_way_have_bars_between_the_refit_and_the_end():
    steps = (Step(("unbalance",), {"motor_torque": (0.009, (0.008, 0.01))}),)
    two = told(EFFECT)
    two = replace(
        two, verdict=two.verdict.model_copy(update={"effects": 2 * two.verdict.effects}), steps=steps
    )
    bars = gap_bars(two)["motor_torque"]
    assert [label for label, *_ in bars] == [
        "model as given", "parameters re-fitted", "with unbalance", "with both effects",
    ]  # fmt: skip
    assert [value for _, value, *_ in bars] == [GAP.before, GAP.refit, 0.009, GAP.after]


def test_without_series_there_are_no_pictures_of_them():
    assert trace_figure(told(EFFECT)) is None
    assert whole_figure(told(EFFECT)) is None
    assert located_figure(told(EFFECT)) is None
