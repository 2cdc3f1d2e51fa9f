"""Measured, before and after side by side, as a recording that a viewer opens."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdsim.diagnose.measured import CHANNELS
from hdsim.recording import Column, Recording, Table

if TYPE_CHECKING:
    from hdsim.diagnose.workflow import Diagnosis


def side_by_side(diagnosis: Diagnosis) -> Recording:
    """The first record with tables ``measured``, ``before``, ``refit`` and ``after`` over the same times.

    Angles and torques are in SI units; the models' offsets against the sensors are removed, as in the fits.
    Where the output's angle is predicted, ``transmission_error`` is it less the motor's angle over the ratio.
    """
    bench = diagnosis.bench
    predictor = bench.predictors[0]
    record = predictor.record
    time = record.time
    columns: dict[str, dict[str, Column]] = {"measured": {}}
    for channel, values in record.channels.items():
        columns["measured"][channel] = Column(values, CHANNELS[channel], "as measured")
    ideal = predictor.motor_angle / predictor.ratio
    stages = {stage: bench.residuals(found) for stage, found in diagnosis.predictions.items()}
    for k, series in enumerate(bench.series):
        if series.record != 0:
            continue
        for stage, residuals in stages.items():
            values = series.measured - residuals[k]
            table = columns.setdefault(stage, {})
            table[series.channel] = Column(values, CHANNELS[series.channel], f"model, {stage}")
            if series.channel == "output_angle":
                table["transmission_error"] = Column(values - ideal, "rad", f"model, {stage}")
        if series.channel == "output_angle":
            error = Column(series.measured - ideal, "rad", "as measured")
            columns["measured"]["transmission_error"] = error
    return Recording(
        {name: Table(time, table) for name, table in columns.items()},
        metadata={"scenario_name": record.name, "verdict": diagnosis.verdict.sentence},
    )
