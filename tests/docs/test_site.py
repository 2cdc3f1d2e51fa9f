"""The documentation becomes a site without a warning and without the network; every link leads somewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import hdsim
from hdsim.cli import COMMANDS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
sys.path.append(str(DOCS / "_ext"))

from pages import ELSEWHERE, navigation, parts, relinked  # noqa: E402


class Page(HTMLParser):
    """Names that a page can be entered at, and what it links to or loads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.links: set[str] = set()
        self.loads: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attributes}
        self.names |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.add(given["href"])
        if tag in ("script", "img", "source") and "src" in given:
            self.loads.add(given["src"])
        if tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload"):
            self.loads.add(given["href"])


def built(place: Path) -> Path:
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    command += ["-d", str(place / "doctrees"), str(DOCS), str(place / "html")]
    # A proxy that is not there: whatever asks the network fails.
    cut_off = dict.fromkeys(("http_proxy", "https_proxy"), "http://127.0.0.1:9")
    done = subprocess.run(command, env=os.environ | cut_off, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return place / "html"


def dead_links(site: Path, pages: dict[Path, Page]) -> list[str]:
    dead = []
    for path, page in pages.items():
        for link in sorted(page.links | page.loads):
            split = urlsplit(link)
            if split.scheme:
                continue
            target = (path.parent / unquote(split.path)).resolve() if split.path else path
            alive = target.exists() and target.is_relative_to(site)
            if alive and target.suffix == ".html" and split.fragment:
                alive = unquote(split.fragment) in pages[target].names
            if not alive:
                dead.append(f"{path.relative_to(site)}: {link}")
    return dead


@pytest.mark.slow
def test_the_site_is_whole(tmp_path: Path) -> None:
    site = built(tmp_path.resolve())  # once, so that it is one test
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(site.rglob("*.html"))}
    pages = {path: Page(text) for path, text in texts.items()}
    assert dead_links(site, pages) == []
    # Nothing is loaded from elsewhere: formulas are MathML, styles and scripts lie beside the pages.
    assert {load for page in pages.values() for load in page.loads if urlsplit(load).scheme} == set()
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert re.findall(r"(?:url\(|@import )['\"]?(?:https?:)?//[^)'\"]*", styles) == []
    assert "<math" in texts[site / "generated" / "gallery" / "plot_7_fit_friction.html"]
    # The reference has the public face.
    assert {f"hdsim.{name}" for name in hdsim.__all__} <= pages[site / "reference" / "api.html"].names
    commands = pages[site / "reference" / "command-line.html"].names
    assert {f"hdsim-{name}" for name in COMMANDS} <= commands
    fields = texts[site / "reference" / "scenario-fields.html"]
    assert all(name in fields for name in ("stiffness_k1_nm_per_rad", "position_gain_per_s", "gap_factor"))
    for path in (DOCS / "gallery").glob("*.py"):
        assert list((site / "_images").glob(f"sphx_glr_{path.stem}_00*.png")), path.stem


def test_a_dead_link_is_seen(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.html").touch()
    links = ["b.html", "b.html#x", "#y", "#z", "c.html", "https://example.org/"]
    text = "<p id=y>" + "".join(f'<a href="{link}">' for link in links)
    pages = {tmp_path / "a.html": Page(text), tmp_path / "b.html": Page("<p id=w>")}
    assert dead_links(tmp_path, pages) == ["a.html: #z", "a.html: b.html#x", "a.html: c.html"]


def test_the_navigation_has_every_page_once() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    listed = [page for _, of_part in parts(index) for page in of_part]
    assert len(listed) == len(set(listed))
    sources = {
        path.relative_to(DOCS).as_posix()
        for suffix in ("md", "rst", "ipynb")
        for path in DOCS.rglob(f"*.{suffix}")
        if not {"generated", "gallery"} & set(path.relative_to(DOCS).parts)
    }
    assert sources - set(listed) == {"README.md", "index.md"}
    assert set(listed) - sources == {ELSEWHERE["gallery/README.rst"]}
    assert navigation("## One\n\n| [a](a.md) | x |\n| [b](b/c.md) | see [d](d.md) |\n") == (
        "```{toctree}\n:hidden:\n:caption: One\n\na.md\nb/c.md\n```"
    )


def test_links_are_turned_to_where_the_site_has_their_pages() -> None:
    assert relinked("[a](docs/model.md#b) [c](LICENSE) [d](scenarios)", folder="docs/") == (
        "[a](model.md#b) [c](../LICENSE) d"
    )
    assert relinked("[a](../README.md#b) [c](https://example.org/docs)") == (
        "[a](about.md#b) [c](https://example.org/docs)"
    )
