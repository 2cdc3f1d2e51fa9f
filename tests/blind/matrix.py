"""The blind matrix as a page: rates with intervals, what is asked, the confusion matrix, failures."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

Result = dict[str, Any]

HEAD = """# Blind tests of the diagnosis

Written by `python tests/blind` (`make blind`); not edited by hand.

`tests/blind` hides an effect, several or none in a plant that shares no code with hdsim: its own equations
and integrator, a controller in the loop, quantised and noisy sensors, its own clock. The diagnosis is given
the log and a base model, nothing else. Six drives (size 14 to 40, ratios -160 to -50 and +101), five kinds
of motion (swings, trapezoidal moves with pauses, a sweep, constant speeds with reversals, ramps of twist
against a locked output), an arm or a bare inertia as load, logs of 500 to 2000 Hz and 8 to 20 s, all drawn
by the case's name and seed.

**Groups.** *clear*, *fair* and *faint* hide one effect of the catalogue with a formula that differs from
the catalogue's, at a strength of 5, 2 and 0.7; *matching* the same at 5 with the catalogue's own formula
(and the base's own formula of friction, of which two of the drives otherwise have another), so that there
are true numbers to recover; *pair* two effects at 4 each; *outside* something that the
catalogue does not have, at 5; *missing* lacks a channel, *dirty* has spikes, gaps, clock jitter, missing
stretches, a clock coarser than the samples or a saturated amplifier, both at 5. *null* hides nothing;
*parameter* has one or two of the base's numbers off by 10 to 30 %.

**Strength** is the root-mean-square of the effect's trace over the noise of its channel (of the
transmission error for the two angles), in the channel where it is largest. The trace is taken along the
same motor motion, with and without the effect. A part of it can often be explained as well by a wrong
number of the base model, for instance a mount's compliance as a softer drive; no tool can tell that apart,
and a case of that kind has no right answer. So the strength that counts is what is left after a least-
squares fit of channel offsets and of the plant's sensitivities to its own inertias, stiffness, damping,
friction, weight and torque constant. The plain strength is listed beside it and is often several times
larger.

**What is right.** A group of effects that the diagnosis calls indistinguishable counts when it holds the
truth and at most three names; in *clear*, *fair*, *matching*, *missing* and *dirty* the first such group
counts. In *faint* silence is right too. Where two names of the catalogue are one physical thing (two laws
of hysteresis; an eccentric output encoder and an eccentric output), either is right. A diagnosis that stops
with an error is wrong.
"""


def rate(right: int, count: int) -> str:
    """A rate with its Clopper-Pearson 95 % interval, in words."""
    if count == 0:
        return "no case"
    bounds = binomtest(right, count).proportion_ci(0.95, "exact")
    return f"{100 * right / count:.0f} % ({100 * bounds.low:.0f} to {100 * bounds.high:.0f})"


def page(results: Sequence[Result]) -> str:
    """The whole page."""
    lines = [HEAD]
    lines += [f"{len(results)} cases, seeds {_seeds(results)}.", "", *_asked(results), "", *_groups(results)]
    lines += ["", *_confusion(results), "", *_failures(results), "", *_recovered(results), ""]
    return "\n".join(lines)


def _seeds(results: Sequence[Result]) -> str:
    seeds = sorted({r["seed"] for r in results})
    return ", ".join(str(s) for s in seeds) if seeds else "none"


def _asked(results: Sequence[Result]) -> list[str]:
    """What is asked of the tool, and what it does."""
    by: dict[str, list[Result]] = defaultdict(list)
    for r in results:
        by[r["group"]].append(r)

    def share(groups: str, test: Any) -> tuple[int, int]:
        own = [r for g in groups.split() for r in by[g]]
        return sum(bool(test(r)) for r in own), len(own)

    def false_alarm(r: Result) -> bool:
        return r["verdict"] in ("effect", "unknown")

    quiet = [r for r in results if r["row"].startswith("nothing") or r["group"] == "parameter"]
    alarms = (sum(false_alarm(r) for r in quiet), len(quiet))
    closures = [r.get("closed") for g in ("clear", "matching") for r in by[g]]
    shares = [c for c in closures if c is not None]
    inside = [row[5] for r in by["matching"] for row in r.get("covered", [])]
    own = [row[5] for r in by["parameter"] for row in r.get("covered", [])]
    wrong_faint = share("faint", lambda r: r["names"] and not r["right"])
    rows = [
        ("first name right, clear", share("clear", lambda r: r["right"]), ">= 95 %"),
        (
            "first name right, clear with the catalogue's formula",
            share("matching", lambda r: r["right"]),
            ">= 95 %",
        ),
        ("first name right, fair", share("fair", lambda r: r["right"]), ">= 85 %"),
        ("wrong first name, faint", wrong_faint, "<= 5 %"),
        ("false alarm (a name or `unknown`) where nothing is hidden or a number is off", alarms, "<= 5 %"),
        ("`unknown`, outside the catalogue", share("outside", lambda r: r["right"]), ">= 80 %"),
        ("a catalogue name, outside the catalogue", share("outside", lambda r: r["names"]), "<= 10 %"),
        ("both of a pair", share("pair", lambda r: r["right"]), ">= 80 %"),
        ("right with a channel missing", share("missing", lambda r: r["right"]), ""),
        ("right with dirty data", share("dirty", lambda r: r["right"]), ""),
        ("wrong number said to be one", share("parameter", lambda r: r["right"]), ""),
        (
            "held-out gap closed by 90 % of what can be, clear",
            (sum(s >= 0.9 for s in shares), len(shares)),
            "",
        ),
        ("true number in its 95 % interval, matching", (sum(inside), len(inside)), "85 to 100 %"),
        ("true number in its 95 % interval, parameter", (sum(own), len(own)), "85 to 100 %"),
        ("more effects named than hidden, clear", share("clear", lambda r: len(r["names"]) > 1), ""),
    ]
    lines = ["| | cases | rate (95 % interval) | asked |", "|---|---|---|---|"]
    lines += [f"| {what} | {n} | {rate(k, n)} | {asked} |" for what, (k, n), asked in rows]
    if shares:
        mean, median = 100 * float(np.mean(shares)), 100 * float(np.median(shares))
        said = f"mean {mean:.0f} %, median {median:.0f} % (asked: 90 %)"
        lines += ["", f"Share of what can be closed of the held-out gap that is closed, clear cases: {said}."]
    return lines


def _groups(results: Sequence[Result]) -> list[str]:
    lines = [
        "| group | cases | right | median s a diagnosis | longest | short of its strength |",
        "|---|---|---|---|---|---|",
    ]
    for group in dict.fromkeys(r["group"] for r in results):
        own = [r for r in results if r["group"] == group]
        seconds = [r["seconds"] for r in own]
        short = sum(not r["reached"] for r in own)
        lines.append(
            f"| {group} | {len(own)} | {rate(sum(r['right'] for r in own), len(own))} | "
            f"{float(np.median(seconds)):.0f} | {max(seconds):.0f} | {short} |"
        )
    return lines


def _confusion(results: Sequence[Result]) -> list[str]:
    found: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    right: Counter[tuple[str, str]] = Counter()
    for r in results:
        place = (r["group"], r["row"])
        found[place][("" if r["right"] else "**wrong:** ") + r["said"]] += 1
        right[place] += r["right"]
    lines = ["## Confusion matrix", "", "| group | hidden | right | said |", "|---|---|---|---|"]
    for (group, truth), said in found.items():
        words = "; ".join(f"{text} ({n})" for text, n in said.most_common())
        lines.append(f"| {group} | {truth} | {right[group, truth]} of {said.total()} | {words} |")
    return lines


def _failures(results: Sequence[Result]) -> list[str]:
    wrong = [r for r in results if not r["right"]]
    lines = ["## Every wrong answer", "", "One case again: `python tests/blind --only KEY`.", "",
             "| key | experiment | strength beyond the base (plain) | said |",
             "|---|---|---|---|"]  # fmt: skip
    for r in wrong:
        sizes = ", ".join(f"{s[1]:.1f} ({s[0]:.1f}) {s[2]}" for s in r["strength"])
        said = r.get("error") or r["said"]
        if r.get("suspects"):
            said += "; suspects " + ", ".join(r["suspects"])
        lines.append(f"| {r['key']} | {r['setup']} | {sizes} | {said.replace('|', '/')} |")
    return lines if wrong else [*lines[:1], "", "None."]


def _recovered(results: Sequence[Result]) -> list[str]:
    lines = ["## Numbers outside their interval", "", "| key | field | truth | fitted | 95 % interval |",
             "|---|---|---|---|---|"]  # fmt: skip
    for r in results:
        for path, truth, value, low, high, inside in r.get("covered", []):
            if not inside:
                lines.append(f"| {r['key']} | {path} | {truth:.4g} | {value:.4g} | {low:.4g} to {high:.4g} |")
    return lines
