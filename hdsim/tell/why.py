"""The report's section that says why: what spoke for and against each name, and which limits were met."""

from __future__ import annotations

import html
import math

from hdsim.tell.because import Condition, Weighing, conditions, weighings
from hdsim.tell.findings import Findings
from hdsim.tell.tables import section, table
from hdsim.tell.words import odds, percent, started, title_of

#: Least reach of the bars, as a logarithm of odds: faint evidence must not look strong.
LEAST_REACH = 3.0


def why(found: Findings) -> str:
    """The section "Why this verdict"; empty where no rule was asked."""
    because = found.verdict.because
    names, limits = weighings(because), conditions(because)
    if not names and not limits:
        return ""
    body = ""
    if names:
        reach = max(
            [LEAST_REACH, *(abs(w.log_odds) for one in names for w in one.weights)]
            + [abs(v) for one in names for v in (one.total, one.prior) if math.isfinite(v)]
        )
        body += "".join(_weighing(found, one, reach) for one in names)
        body += (
            "<p class='note'>Each piece of evidence multiplies the odds that the name, or one of its group, "
            "is right; bars to the right speak for it, to the left against. Their lengths are logarithms, so "
            "they add up to the last row.</p>"
        )
    if limits:
        body += f"<h3>{'Is anything there at all?' if names else 'What was asked'}</h3>" + _conditions(limits)
    return section("Why this verdict", f"<p>{html.escape(_sum(found, names))}</p>{body}")


def _title(found: Findings, name: str) -> str:
    own = next((effect for effect in found.verdict.effects if effect.name == name), None)
    titles = [own.title or title_of(name) if own is not None else title_of(name)]
    law = next((law for law in found.evidence.laws if law.name == name), None)
    return started(" or ".join([*titles, *(title_of(other) for other in (law.group if law else ()))]))


def _sum(found: Findings, names: list[Weighing]) -> str:
    """What the reasons amount to, in a sentence."""
    kind = found.verdict.verdict
    if kind == "effect":
        said = "The evidence makes " + ("the name" if len(found.verdict.effects) == 1 else "the names")
        said += " likely enough to be given."
        if any(not one.named for one in names):
            said += " What was found beside and is not likely enough has been left out of the model."
        return said
    if kind == "unknown" and names:
        return "Something is there, but no name for it is likely enough to be given."
    if kind == "unknown":
        return "Something is there that no effect was found for."
    if kind == "parameter":
        return (
            "No pattern and no more than noise is left, and the re-fitted numbers close a gap on unseen data."
        )
    if any(one.rule.startswith("the re-fit") and one.holds for one in found.verdict.because):
        return "No pattern and no more than noise is left, and no number that would close the gap stands out."
    return "No pattern and no more than noise is left, and the re-fitted numbers close no gap worth naming."


def _weighing(found: Findings, one: Weighing, reach: float) -> str:
    said = "named" if one.named else "not named"
    likely = f"{percent(one.probability)} likely to be right" if math.isfinite(one.probability) else ""
    needed = f"a name needs {percent(one.needed)}" if math.isfinite(one.needed) else ""
    about = "; ".join(part for part in (likely, needed) if part)
    title = f"{_title(found, one.name)}: {said}"
    head = f"<h3>{html.escape(title)}{f' <small>({html.escape(about)})</small>' if about else ''}</h3>"
    rows = ""
    if math.isfinite(one.prior):
        rows += _row("before any of it", "", one.prior, reach)
    rows += "".join(_row(w.words, w.seen, w.log_odds, reach) for w in one.weights)
    if math.isfinite(one.total):
        rows += _row("All together", percent(one.probability), one.total, reach, "sum")
    titles = (
        "<tr><th>evidence</th><th class='n'>seen</th><th class='odds'>against · for</th><th>odds</th></tr>"
    )
    return f"{head}<div class='wide'><table class='why'>{titles}{rows}</table></div>"


def _row(words: str, seen: str, weight: float, reach: float, kind: str = "") -> str:
    part = 50.0 * min(abs(weight) / reach, 1.0) if math.isfinite(weight) else 0.0
    side = "for" if weight >= 0 else "against"
    start = 50.0 if weight >= 0 else 50.0 - part
    bar = f"<i class='{side}' style='left:{start:.1f}%;width:{part:.1f}%'></i>"
    return (
        f"<tr{f' class={kind}' if kind else ''}><td>{html.escape(started(words))}</td>"
        f"<td class='n'>{html.escape(seen)}</td><td class='odds'><span class='bar'>{bar}</span></td>"
        f"<td>{html.escape(odds(weight))}</td></tr>"
    )


def _conditions(limits: list[Condition]) -> str:
    rows = [[one.words, one.seen, one.limit, "yes" if one.met else "no"] for one in limits]
    return table(("asked", "seen", "counts from", "does it?"), rows, (1, 2))
