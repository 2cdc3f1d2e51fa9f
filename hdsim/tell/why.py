"""The report's section that says why: the evidence on each effect, and which thresholds were met."""

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
            "<p class='note'>Each piece of evidence multiplies the odds that the effect, or one of its "
            "group, is "
            "the right one; bars to the right are evidence for it, to the left against it. Their lengths are "
            "logarithms and add up to the last row.</p>"
        )
    if limits:
        body += f"<h3>{'Is there a systematic residual?' if names else 'Criteria'}</h3>" + _conditions(limits)
    return section("Why this verdict", f"<p>{html.escape(_sum(found, names))}</p>{body}")


def _title(found: Findings, name: str) -> str:
    own = next((effect for effect in found.verdict.effects if effect.name == name), None)
    titles = [own.title or title_of(name) if own is not None else title_of(name)]
    law = next((law for law in found.evidence.laws if law.name == name), None)
    return started(" or ".join([*titles, *(title_of(other) for other in (law.group if law else ()))]))


def _sum(found: Findings, names: list[Weighing]) -> str:
    """The conclusion from the evidence, in a sentence."""
    kind = found.verdict.verdict
    if kind == "effect":
        said = "The evidence identifies " + (
            "the effect." if len(found.verdict.effects) == 1 else "the effects."
        )
        if any(not one.named for one in names):
            said += " Further effects that are not probable enough have been left out of the model."
        return said
    if kind == "unknown" and names:
        return "There is a systematic residual, but no effect is probable enough to be identified."
    if kind == "unknown":
        return "There is a systematic residual, and no effect was found that explains it."
    noise = "The residual is not systematic and not above the noise"
    if kind == "parameter":
        return f"{noise}, and the re-estimated parameters reduce a residual on held-out data."
    if any(one.rule.startswith("the re-fit") and one.holds for one in found.verdict.because):
        return f"{noise}, and no single parameter accounts for the reduction by the re-fit."
    return f"{noise}, and the re-estimated parameters do not reduce it noticeably."


def _weighing(found: Findings, one: Weighing, reach: float) -> str:
    said = "identified" if one.named else "not identified"
    likely = f"probability {percent(one.probability)}" if math.isfinite(one.probability) else ""
    needed = f"threshold {percent(one.needed)}" if math.isfinite(one.needed) else ""
    about = "; ".join(part for part in (likely, needed) if part)
    title = f"{_title(found, one.name)}: {said}"
    head = f"<h3>{html.escape(title)}{f' <small>({html.escape(about)})</small>' if about else ''}</h3>"
    rows = ""
    if math.isfinite(one.prior):
        rows += _row("prior", "", one.prior, reach)
    rows += "".join(_row(w.words, w.seen, w.log_odds, reach) for w in one.weights)
    if math.isfinite(one.total):
        rows += _row("posterior", percent(one.probability), one.total, reach, "sum")
    titles = "<th>evidence</th><th class='n'>observed</th><th class='odds'>against · for</th><th>odds</th>"
    return f"{head}<div class='wide'><table class='why'><tr>{titles}</tr>{rows}</table></div>"


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
    return table(("criterion", "observed", "threshold", "met"), rows, (1, 2))
