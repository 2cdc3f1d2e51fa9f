"""Pages are written to be read on GitHub too; this makes the site's start, order and links of them.

`docs/README.md` lists every page in the order in which they are read. Its headings become the parts of the
navigation and its tables their pages, so there is no second list.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

DOCS = Path(__file__).parents[1]
INDEX = DOCS / "README.md"
#: Where the site has what GitHub shows elsewhere.
ELSEWHERE = {
    "gallery/README.rst": "generated/gallery/index.rst",  # with pictures, made from the scripts beside it
    "../README.md": "about.md",
    "README.md": "index.md",
}
LINK = re.compile(r"\[([^]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")


def parts(index: str) -> list[tuple[str, list[str]]]:
    """Title of every part of the documentation, and its pages: the links in the first column of its table."""
    found = []
    for section in re.split(r"^## ", index, flags=re.MULTILINE)[1:]:
        title, _, text = section.partition("\n")
        links = re.findall(r"^\| \[[^]]*\]\(([^)]+)\)", text, flags=re.MULTILINE)
        found.append((title.strip(), [ELSEWHERE.get(link, link) for link in links]))
    return found


def navigation(index: str) -> str:
    """One hidden table of contents a part, in MyST."""
    trees = [
        "\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *pages, "```"])
        for title, pages in parts(index)
    ]
    return "\n\n".join(trees)


def relinked(text: str, folder: str = "") -> str:
    """A page's links as the site has them, of one above `folder` too; of a link to a folder its words."""

    def target(match: re.Match[str]) -> str:
        words, link, anchor = match[1], match[2], match[3] or ""
        if folder and not re.match(r"[a-z]+:", link):
            link = link.removeprefix(folder) if link.startswith(folder) else f"../{link}"
        if (DOCS / link).is_dir():
            return words
        return f"[{words}]({ELSEWHERE.get(link, link)}{anchor})"

    return LINK.sub(target, text)


def read_page(app: Sphinx, name: str, source: list[str]) -> None:
    """Mend the links of a page."""
    source[0] = relinked(source[0])
    if name == "index":
        source[0] += "\n" + navigation(INDEX.read_text(encoding="utf-8"))


def read_included(app: Sphinx, path: Any, parent: str, content: list[str]) -> None:
    """Mend the links of the project's README and of the index, which other pages include."""
    content[0] = relinked(content[0], folder="docs/" if parent == "about" else "")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("source-read", read_page)
    app.connect("include-read", read_included)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
