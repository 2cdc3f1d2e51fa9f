"""What is said beside the model's gap: what a regression, and gradient boosting, leave of the same data."""

import pytest
from rich.console import Console
from telling import EFFECT, GAP, NOTHING, page, told

from hdsim.tell.beside import baselines
from hdsim.tell.terminal import show


@pytest.mark.parametrize(
    ("evidence", "model"), [(EFFECT, "the model with the identified effects"), (NOTHING, "the fitted model")]
)
def test_page_and_terminal_say_what_a_regression_leaves(tmp_path, evidence, model):
    found = told(evidence)
    said = f"motor torque: linear regression 3.2 mN m, {model} 2.1, noise 2"
    assert said in page(found, tmp_path)
    terminal = Console(width=200, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show(found, terminal)
    assert said in terminal.export_text()


def test_a_black_box_stands_between_the_two():
    (said,) = baselines({"motor_torque": GAP.model_copy(update={"black_box": 0.0025})})
    assert "linear regression 3.2 mN m, gradient boosting 2.5, the fitted model 2.1" in said


def test_what_repeats_from_turn_to_turn_is_said():
    (said,) = baselines({"motor_torque": GAP.model_copy(update={"repeats": 0.52})})
    assert said.endswith("noise 2; 52 % of the final residual's power repeats from turn to turn")


def test_without_a_baseline_nothing_is_said():
    assert baselines({"motor_torque": GAP.model_copy(update={"regression": None})}) == []
