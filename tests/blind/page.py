"""The blind page: rates with intervals by family, strength, sensors, kind of held-out data; every failure."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from judging import OUTCOMES, Line, false_alarm, false_name, outcome, said
from page_tables import BANDS, band, cpu_seconds, rate, requirements, spread, table
from page_teeth import FAMILY, teeth
from page_text import HEAD, limits
from reliability import binned, calibration_error
from reliability import picture as reliability_picture

__all__ = ["page", "reliability_picture"]

#: Required share of the reducible held-out residual; of cases as strong as this.
CLOSED, CLEAR = 0.9, 3.5
LEFT_OUT = "mujoco"
#: Outcomes as the page writes them, where that differs.
SHOWN = {"wrong name": "wrong effect"}


def states(line: Line) -> bool:
    """Whether a case may be stated: no rule was calibrated on it."""
    return line["family"] == LEFT_OUT or line["seed"] % 2 == 1


def general(lines: Sequence[Line]) -> list[Line]:
    """The cases without those against a base with teeth, which have requirements of their own."""
    return [r for r in lines if r["family"] != FAMILY]


def page(lines: Sequence[Line]) -> str:
    """The whole page."""
    lines = sorted(lines, key=lambda r: (r["family"], r["seed"], r["number"]))
    drawn = [r for r in lines if not str(r["error"] or "").startswith("not drawn")]
    stated = [r for r in drawn if states(r)]
    others = [r for r in drawn if not states(r)]
    text = [HEAD, _counts(lines, drawn), ""]
    text += ["## Requirements", "", "Of all families but `teeth`:", ""]
    text += requirements(_measures, ASKED, "15 / - / 60", general(stated), general(others))
    text += ["", *teeth(stated, others), *_confidence(stated), ""]
    for title, of in DIMENSIONS.items():
        text += [*_by(title, of, stated), ""]
    text += [*_bands_of_families(stated), "", *_time(stated), "", *_confusion(stated), ""]
    text += [*_failures(stated), "", *_outside_intervals(stated), "", *limits(), ""]
    return "\n".join(text)


def _counts(lines: Sequence[Line], drawn: Sequence[Line]) -> str:
    words = []
    for name in dict.fromkeys(r["family"] for r in lines):
        own = [r for r in lines if r["family"] == name]
        seeds = ", ".join(str(s) for s in sorted({r["seed"] for r in own}))
        words.append(f"`{name}` {len(own)} (seeds {seeds})")
    lost = len(lines) - len(drawn)
    return f"{len(drawn)} cases: {'; '.join(words)}." + (f" {lost} could not be drawn." if lost else "")


#: What cases are told apart by.
DIMENSIONS: dict[str, Callable[[Line], str]] = {
    "family": lambda r: r["family"],
    "strength": band,
    "sensors": lambda r: str(r["setup"].get("sensors", "-")),
    "held out": lambda r: str(r["setup"].get("held", "-")),
    "formula": lambda r: str(r["setup"].get("formula", "-")),
    "encoder step": lambda r: _step(r["setup"].get("encoder_step_over_noise")),
    "sample rate": lambda r: _rate_band(r["setup"].get("rate_hz")),
}


def _step(step: float | None) -> str:
    if step is None:
        return "-"
    return (
        "below the noise" if step < 1 else "1 to 3 times the noise" if step < 3 else "3 to 10 times the noise"
    )


def _rate_band(hz: float | None) -> str:
    if hz is None:
        return "-"
    return "100 to 350 Hz" if hz < 350 else "350 to 1500 Hz" if hz < 1500 else "1500 to 5000 Hz"


def _measures(lines: Sequence[Line]) -> dict[str, tuple[int, int]]:
    """Numbers of right ones and of cases, by what is asked."""
    effects = [r for r in lines if r["kind"] == "effect"]
    quiet = [r for r in lines if r["kind"] in ("null", "parameter")]
    hidden = [r for r in lines if r["kind"] in ("effect", "pair")]

    def share(own: Sequence[Line], test: Callable[[Line], bool]) -> tuple[int, int]:
        return sum(test(r) for r in own), len(own)

    def right(r: Line) -> bool:
        return outcome(r) == "right"

    found = {
        f"first effect right, strength {low:g} to {high:g}": share(
            [r for r in effects if band(r) == f"{low:g} to {high:g}"], right
        )
        for low, high in BANDS
    }
    found["wrong first effect where one is hidden"] = share(hidden, false_name)
    found["false alarm where nothing is hidden or a parameter is wrong"] = share(quiet, false_alarm)
    found["wrong parameter reported"] = share([r for r in lines if r["kind"] == "parameter"], right)
    found["`unknown`, outside the catalogue"] = share([r for r in lines if r["kind"] == "outside"], right)
    found["an effect, outside the catalogue"] = share(
        [r for r in lines if r["kind"] == "outside"], lambda r: outcome(r) == "wrong name"
    )
    found["both of a pair"] = share([r for r in lines if r["kind"] == "pair"], right)
    closable = [r for r in hidden if r.get("closed") is not None and min(r["strength"]) >= CLEAR]
    found["nine tenths of the reducible held-out residual explained, strength from 3.5"] = share(
        closable, lambda r: r["closed"] >= CLOSED
    )
    curved = [r for r in closable if r.get("closed_with_curve") is not None]
    found["the same with the curve of the remaining residual"] = share(
        curved, lambda r: r["closed_with_curve"] >= CLOSED
    )
    given = [r for r in hidden if r.get("closed_since_before") is not None and min(r["strength"]) >= CLEAR]
    found["the same of the residual before the re-fit"] = share(
        given, lambda r: r["closed_since_before"] >= CLOSED
    )
    numbers = [row for r in lines for row in r.get("numbers", [])]
    found["true parameter in its 95 % interval"] = (sum(row[5] for row in numbers), len(numbers))
    found["stopped with an error"] = share(lines, lambda r: outcome(r) == "error")
    return found


ASKED = {
    "first effect right, strength 1.5 to 3.5": ">= 85 % (at 2)",
    "first effect right, strength 3.5 to 10": ">= 95 % (at 5)",
    "first effect right, strength 35 to 100": ">= 95 % (at 50)",
    "wrong first effect where one is hidden": "<= 3 %",
    "false alarm where nothing is hidden or a parameter is wrong": "<= 3 %",
    "`unknown`, outside the catalogue": ">= 85 %",
    "both of a pair": ">= 85 %",
    "nine tenths of the reducible held-out residual explained, strength from 3.5": ">= 90 %",
    "true parameter in its 95 % interval": "90 to 98 %",
}


def _confidence(lines: Sequence[Line]) -> list[str]:
    error, count = calibration_error(general(lines))
    text = ["## Stated confidence", ""]
    if not count:
        return [*text, "None is stated."]
    text += [
        f"Expected calibration error {100 * error:.1f} points over {count} cases of all families but `teeth` "
        "(required: at most 5 over 600)."
    ]
    whole, more = calibration_error(lines)
    if more > count:
        text[-1] += f" With those {100 * whole:.1f} points over {more}: below and in the picture."
    heads = ["stated", "cases", "mean stated", "right (95 % interval)"]
    rows = [
        [f"{100 * low:g} to {100 * high:g} %", n, f"{100 * mean:.1f} %", rate(right, n)]
        for low, high, mean, right, n in binned(lines)
    ]
    return [*text, "", "![Reliability](images/reliability.png)", "", *table(heads, rows)]


def _by(title: str, of: Callable[[Line], str], lines: Sequence[Line]) -> list[str]:
    """Outcomes where one effect is hidden, and alarms where none is, by one dimension."""
    cases: dict[str, list[Line]] = defaultdict(list)
    for r in lines:
        cases[of(r)].append(r)
    rows = []
    for value in sorted(cases, key=_natural):
        effects = [r for r in cases[value] if r["kind"] == "effect"]
        quiet = [r for r in cases[value] if r["kind"] in ("null", "parameter")]
        counts = Counter(outcome(r) for r in effects)
        alarms = rate(sum(map(false_alarm, quiet)), len(quiet))
        cells = [rate(counts["right"], len(effects)), *(counts[o] for o in OUTCOMES[1:])]
        rows.append([value, len(effects), *cells, len(quiet), alarms])
    heads = [
        "",
        "one effect: cases",
        "first effect right",
        *(SHOWN.get(name, name) for name in OUTCOMES[1:]),
        "nothing hidden: cases",
        "false alarm",
    ]
    return [f"## By {title}", "", *table(heads, rows)]


def _natural(text: str) -> tuple[float, str]:
    first = text.split(" ")[0]
    return (float(first), text) if first.replace(".", "").isdigit() else (-1.0, text)


def _bands_of_families(lines: Sequence[Line]) -> list[str]:
    families = list(dict.fromkeys(r["family"] for r in lines))
    rows = []
    for low, high in BANDS:
        row = [f"{low:g} to {high:g}"]
        for name in families:
            own = [r for r in lines if r["kind"] == "effect" and r["family"] == name and band(r) == row[0]]
            row.append(f"{rate(sum(outcome(r) == 'right' for r in own), len(own))} of {len(own)}")
        rows.append(row)
    text = ["## First effect right by strength and family", ""]
    return text + (table(["strength", *families], rows) if families else ["None."])


def _time(lines: Sequence[Line]) -> list[str]:
    """Processor seconds by family and seconds by step."""
    rows: list[list[Any]] = []
    for name in dict.fromkeys(r["family"] for r in lines):
        spent = cpu_seconds([r for r in lines if r["family"] == name])
        rows.append([name, len(spent), spread(spent)])
    heads = ["family", "cases", "processor seconds: median / nine tenths / longest"]
    text = ["## Time", "", *table(heads, rows), ""]
    steps: dict[str, list[float]] = defaultdict(list)
    for r in lines:
        for step, seconds in (r.get("seconds") or {}).items():
            steps[step].append(seconds)
    total = sum(map(sum, steps.values())) or 1.0
    rows = [
        [step, f"{100 * sum(spent) / total:.0f} %", f"{np.median(spent):.1f}", f"{max(spent):.1f}"]
        for step, spent in steps.items()
    ]
    return text + table(["step", "share of all time", "median s where taken", "longest"], rows)


def _confusion(lines: Sequence[Line]) -> list[str]:
    found: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    right: Counter[tuple[str, str]] = Counter()
    for r in lines:
        hidden = str(r["setup"].get("hidden", " + ".join("/".join(t) for t in r["truth"]) or "nothing"))
        place = (r["kind"], hidden if r["kind"] in ("effect", "outside") else "")
        ok = outcome(r) == "right"
        found[place][said(r) if ok else f"**{said(r)}**"] += 1
        right[place] += ok
    rows = [
        [*place, f"{right[place]} of {own.total()}", "; ".join(f"{w} ({n})" for w, n in own.most_common())]
        for place, own in sorted(found.items())
    ]
    text = ["## Confusion", "", "Wrong verdicts in bold.", ""]
    return text + table(["kind", "hidden", "right", "verdict"], rows)


def _failures(lines: Sequence[Line]) -> list[str]:
    wrong = [r for r in lines if outcome(r) != "right"]
    rows = []
    for r in wrong:
        s = r["setup"]
        experiment = f"{s.get('sensors', '-')}, {s.get('rate_hz') or 0:.0f} Hz, {s.get('held', '-')}"
        sizes = ", ".join(f"{x:.1f}" for x in r["strength"]) or "-"
        suspects = (r["verdict"] or {}).get("suspects")
        words = said(r) + (f"; suspects {', '.join(suspects)}" if suspects else "")
        rows.append(
            [
                r["key"],
                f"{experiment}, {s.get('formula', '-')}",
                sizes,
                words,
                r.get("closed"),
                r.get("cpu_s"),
            ]
        )
    heads = ["key", "experiment", "strength", "verdict", "share explained", "processor s"]
    count = f"{len(wrong)} of {len(lines)}. To repeat one: `python tests/blind one KEY`."
    return ["## Every wrong verdict", "", count, "", *table(heads, rows)]


def _outside_intervals(lines: Sequence[Line]) -> list[str]:
    rows = [
        [r["key"], path, f"{truth:.4g}", f"{value:.4g}", f"{low:.4g} to {high:.4g}"]
        for r in lines
        for path, truth, value, low, high, inside in r.get("numbers", [])
        if not inside
    ]
    heads = ["key", "parameter", "truth", "estimate", "95 % interval"]
    return ["## Parameters outside their interval", "", *table(heads, rows)]
