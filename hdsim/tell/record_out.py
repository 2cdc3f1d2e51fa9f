"""Measurement and models side by side, as a recording that a viewer opens."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdsim.log.mapping import MEASURED
from hdsim.recording import Column, Event, Recording, Table

if TYPE_CHECKING:
    from hdsim.diagnosis.workflow import Diagnosis


LOG, LAYOUT = "compared.mcap", "diagnose.json"
_SHORT = {
    "nothing": "nothing is missing",
    "parameter": "a parameter of the model is wrong",
    "effect": "an effect is missing",
    "unknown": "an unidentified effect",
}


def write_compared(diagnosis: Diagnosis, folder: Path) -> None:
    """Write the log and, beside it, the layout that shows it: ``compared.mcap`` and ``diagnose.json``."""
    from hdsim.log.info import info_log
    from hdsim.log.layout import build_layout, to_json

    about = info_log(side_by_side(diagnosis).save(folder / LOG))
    layout = build_layout(
        "diagnose",
        topics=about.fields,
        duration=about.duration,
        drive_radius=about.drive_radius,
        facts=about.facts,
    )
    (folder / LAYOUT).write_text(to_json(layout), encoding="utf-8")


def side_by_side(diagnosis: Diagnosis) -> Recording:
    """The first record with tables ``measured``, ``before``, ``refit`` and ``after`` over the same times.

    Angles and torques are in SI units; the models' offsets against the sensors are removed, as in the fits.
    Where the output's angle is predicted, ``transmission_error`` is it less the motor's angle over the ratio.
    The columns ``..._error`` of a model are measured less predicted, NaN where the measurement is not
    to be trusted. The verdict, and each identified effect, are events at the beginning.
    """
    from hdsim.log.facts import KEY

    bench = diagnosis.bench
    predictor = bench.predictors[0]
    record = predictor.record
    time = record.time
    columns: dict[str, dict[str, Column]] = {"measured": {}}
    for channel, values in record.channels.items():
        columns["measured"][channel] = Column(values, MEASURED[channel], "as measured")
    ideal = predictor.motor_angle / predictor.ratio
    stages = {stage: bench.residuals(found, drift=True) for stage, found in diagnosis.predictions.items()}
    for k, series in enumerate(bench.series):
        if series.record != 0:
            continue
        for stage, residuals in stages.items():
            values = series.measured - residuals[k]
            table = columns.setdefault(stage, {})
            unit = MEASURED[series.channel]
            table[series.channel] = Column(values, unit, f"model, {stage}")
            left = np.where(record.trusted[series.channel], residuals[k], np.nan)
            table[f"{series.channel}_error"] = Column(left, unit, f"measured less model, {stage}")
            if series.channel == "output_angle":
                table["transmission_error"] = Column(values - ideal, "rad", f"model, {stage}")
        if series.channel == "output_angle":
            error = Column(series.measured - ideal, "rad", "as measured")
            columns["measured"]["transmission_error"] = error
    verdict = diagnosis.verdict
    start = float(time[0])
    told = [Event(start, "info", "verdict", verdict.sentence)]
    for effect in verdict.effects:
        explained, probability = 100 * effect.explained, 100 * effect.confidence
        share = f"{explained:.2g} % of the residual explained, probability {probability:.2g} %"
        told.append(Event(start, "info", "effect", f"{effect.name} ({effect.title}): {share}"))
    names = ", ".join(effect.title or effect.name for effect in verdict.effects)
    return Recording(
        {name: Table(time, table) for name, table in columns.items()},
        events=told,
        metadata={
            "scenario_name": record.name,
            "verdict": verdict.sentence,
            "ratio": repr(float(predictor.ratio)),
            KEY: json.dumps({"verdict": names or _SHORT[verdict.verdict]}),
        },
    )
