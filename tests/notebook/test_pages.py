"""What notebooks show: HTML that parses, stands alone, and holds the numbers."""

from __future__ import annotations

import base64
import math
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim.recording import Column, Event, Recording, Table

ROOT = Path(__file__).parents[2]
#: Elements that have no end.
VOID = {"img", "br"}


class Page(HTMLParser):
    """Cells and pictures of a page; every element must be closed where it was opened."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.text: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self.text.append(data)
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data

    def row(self, first: str) -> list[str]:
        (found,) = [row[1:] for row in self.rows if row and row[0] == first]
        return found

    def picture(self) -> bytes:
        """The one picture, which must be inside of the page."""
        (source,) = self.sources
        head, _, data = source.partition(",")
        assert head == "data:image/png;base64"
        return base64.b64decode(data)


def png_size(content: bytes) -> tuple[int, int]:
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(content[16:20], "big"), int.from_bytes(content[20:24], "big")


def test_a_scenario_shows_what_it_commands() -> None:
    scenario = hdsim.load_scenario(ROOT / "scenarios" / "seed_move.yaml")
    text = scenario.with_({"description": "<b>bold</b> & more"})._repr_html_()
    page = Page(text)
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; more" in text
    assert page.row("drive")[0].startswith("seed-2021, ratio -100, rated torque 52 N m, teeth mesh")
    assert png_size(page.picture())[0] > 500
    assert len(text) < 120_000


def test_a_run_shows_sizes_in_readable_units_and_what_happened() -> None:
    time = np.linspace(0.0, 2.0, 1001)
    columns = {
        "output_angle": Column(math.radians(30.0) * np.sin(2 * math.pi * time), "rad"),
        "motor_velocity": Column(np.full(1001, 10 * math.pi), "rad/s"),
        "transmission_error": Column(np.where(time > 1.0, 1e-4, -5e-5), "rad"),
        "load_torque": Column(np.zeros(1001), "N m"),
    }
    told = [Event(0.0, "info", "run", "begins"), Event(1.5, "error", "run", "gave up <here>")]
    text = Recording({"state": Table(time, columns)}, events=told)._repr_html_()
    page = Page(text)
    assert page.row("output angle") == ["deg", "-30", "30", "21.2"]
    assert page.row("motor velocity") == ["rpm", "300", "300", "300"]
    assert page.row("transmission error")[:3] == ["arcsec", "-10.31", "20.63"]
    assert not [row for row in page.rows if row[0] == "load torque"]  # zero throughout
    assert page.row("1.5 s") == ["error", "gave up <here>"]
    assert "gave up <here>" not in text
    page.picture()


def test_an_empty_recording_has_a_page_without_a_picture() -> None:
    page = Page(Recording({"state": Table(np.zeros(0))})._repr_html_())
    assert page.sources == []


def test_a_study_shows_what_its_table_holds() -> None:
    base = hdsim.load_scenario(ROOT / "scenarios" / "sine_tracking.yaml").with_(
        {"run.duration_s": 0.2, "run.sample_rate_hz": 500, "effects": {}},
        drive={"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    )
    study = hdsim.study(base, {"load.inertia_kg_m2": [0.2, 0.5]}, "tracking_error_max", name="two loads")
    frame = study.to_pandas()
    assert frame.attrs["units"]["load.inertia_kg_m2"] == "kg m^2"
    assert frame["load.inertia_kg_m2"].tolist() == [0.2, 0.5]
    page = Page(study._repr_html_())
    shown = [float(row[4]) for row in page.rows if row[0] == "tracking error max"]
    assert shown == pytest.approx(frame["tracking_error_max"].tolist(), rel=1e-3)
    assert "two loads" in page.text
    page.picture()
