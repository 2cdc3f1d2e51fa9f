"""A simulated run as a log that sensors have read."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdsim.estimate.records import Record
from hdsim.recording import Recording


def noisy(
    run: Recording, noise: Mapping[str, float], *, seed: int, begins_s: float = 0.0, name: str = "run"
) -> Record:
    """Channels of a run from a time on, with white noise.

    Args:
        run: simulated.
        noise: standard deviation of each channel that is read, SI units.
        seed: of the noise.
        begins_s: where the log is cut out of the run.
        name: of the record.
    """
    rng, rows = np.random.default_rng(seed), run.time >= begins_s
    channels = {c: run[c][rows] + size * rng.standard_normal(rows.sum()) for c, size in noise.items()}
    return Record(name, run.time[rows] - begins_s, channels)
