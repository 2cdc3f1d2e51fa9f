"""An effect by itself, at an operating point."""

from __future__ import annotations

import math

import numpy as np

import hdsim.kernel as k
from hdsim.testing.alone import Alone

ARCMIN = math.radians(1 / 60)
RATIO = -100.0


def at(model: Alone, **values: float) -> np.ndarray:
    """Outputs of a model at the named inputs, e.g. ``MOTOR_VELOCITY=3``."""
    inputs = model.initial
    for name, value in values.items():
        inputs[getattr(k, name)] = value
    return model(inputs)[0]
