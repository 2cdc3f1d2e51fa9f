"""Every label of the reports, on the page and on its figures, is a term of the glossary or plain."""

import html
import re
from pathlib import Path

import pytest
from diagnose_bench import rigid_record
from telling import KINDS, page, told

import hdsim
from hdsim.tell import figures, fit_figures
from hdsim.tell.figures_where import located_figure
from hdsim.tell.fit_report import save_fit

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"
#: Labels that need no explanation.
PLAIN = {
    "after", "after/before", "against · for", "before", "change", "channel", "combination", "content",
    "criterion", "effects", "effects not tested", "file", "files", "finding", "kind", "measured", "met",
    "method", "model", "model after", "model before", "observed", "problems in the data", "re-fit",
    "reason", "severity", "the data", "time", "unit", "value", "what it means", "why this verdict",
}  # fmt: skip


def terms():
    """Terms of the glossary, in small letters."""
    rows = re.findall(r"^\| ([^|]+?) \|", GLOSSARY.read_text(encoding="utf-8"), re.MULTILINE)
    return {row.strip("` ").lower() for row in rows}


def labels_of(text):
    """Headings of sections and columns of a page."""
    found = re.findall(r"<(?:h2|th)\b[^>]*>(.*?)</(?:h2|th)>", text)
    return {html.unescape(label) for label in found} - {""}


def labels_on(figure):
    """Titles, labels of axes and legends of a figure."""
    found = set()
    for axes in figure.axes if figure is not None else ():
        found |= {
            axes.get_xlabel(),
            axes.get_ylabel(),
            *(axes.get_title(loc=loc) for loc in ("left", "center")),
        }
        found |= {text for text in axes.get_legend_handles_labels()[1] if not text.startswith("_")}
    return found - {""}


def explained(label, known):
    """Whether every part of a label is plain, or a term of the glossary, or has one in it."""
    bare = re.sub(r"\(.*?\)", "", label).strip(" :").lower()
    if bare in PLAIN or not bare:
        return True
    return any(re.search(rf"(?<!\w){re.escape(term)}(s|es)?(?!\w)", bare) for term in known)


@pytest.fixture(scope="module")
def labels(found, base, tmp_path_factory):
    """All labels of the reports of all verdicts, of a whole diagnosis and of a fit, with their figures."""
    folder = tmp_path_factory.mktemp("labels")
    seen = labels_of(page(found, folder))
    for evidence in KINDS.values():
        seen |= labels_of(page(told(evidence), folder))
    seen |= labels_on(figures.gap_figure(found.verdict, figures.gap_bars(found)))
    for draw in (figures.trace_figure, figures.whole_figure, located_figure):
        seen |= labels_on(draw(found))
    fitted = hdsim.fit([rigid_record(3.0, seed=3)], hdsim.load_scenario(base))
    seen |= labels_of(save_fit(fitted, base, folder / "fit").read_text(encoding="utf-8"))
    for draw in (fit_figures.intervals_figure, fit_figures.correlation_figure, fit_figures.left_figure):
        seen |= labels_on(draw(fitted))
    return seen


@pytest.mark.slow
def test_every_label_of_the_reports_is_in_the_glossary(labels):
    known = terms()
    assert len(labels) > 40
    assert ", ".join(sorted(label for label in labels if not explained(label, known))) == ""
    assert not explained("What is left of it", known)
