"""The logs of all shipped scenarios: sound, readable elsewhere, and every layout finds what it shows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from test_javascript_reader import read, reader  # noqa: F401 - a fixture

import hdsim
from hdsim.log import read_attachments, verify_log
from hdsim.log.facts import playback_speed
from hdsim.log.info import info_log
from hdsim.log.layout import LAYOUTS, build_layout, split_path
from hdsim.log.naming import EPOCH_NS
from hdsim.log.schemas import message_class

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))


def test_there_are_nine():
    assert len(SCENARIOS) == 9


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_the_log_is_sound(log_of, path):
    report = verify_log(log_of(path))
    assert report.problems == []
    assert {"/hd/state", "/hd/state_view", "/hd/events", "/hd/transforms", "/joint_states"} <= set(
        report.topics
    )


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_path_of_every_layout_is_a_field_of_the_log(log_of, path):
    log = log_of(path)
    about = info_log(log)
    attached = {name: text for name, text in read_attachments(log).items() if name.startswith("layout-")}
    assert {"layout-overview.json", "layout-positioning-error.json"} <= set(attached)
    for text in attached.values():
        found = json.loads(text)
        paths = list(strings_of_paths(found["configById"]))
        assert paths
        for each in paths:
            topic, field = split_path(each)
            assert topic in about.fields, each
            assert not field or field in about.fields[topic], each
        # The type that the panel needs: a plot over time takes numbers, one over an array takes arrays.
        for id, settings in found["configById"].items():
            if id.startswith("Plot!"):
                over_time = settings["xAxisVal"] == "timestamp"
                for line in settings["paths"]:
                    assert line["value"].endswith("[:]") != over_time, line["value"]


def strings_of_paths(value):
    """All message paths anywhere in a layout."""
    if isinstance(value, dict):
        for each in value.values():
            yield from strings_of_paths(each)
    elif isinstance(value, list):
        for each in value:
            yield from strings_of_paths(each)
    elif isinstance(value, str) and value.startswith("/hd/"):
        yield value


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_panel_has_something_to_show_in_the_first_instant(log_of, path):
    """A viewer shows the last message of each topic up to its time."""
    log = log_of(path)
    attached = [text for name, text in read_attachments(log).items() if name.startswith("layout-")]
    paths = {each for text in attached for each in strings_of_paths(json.loads(text)["configById"])}
    first = {}
    with open(log, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(sorted(map(topic_of, paths))):
            if message.log_time > EPOCH_NS:
                break
            if schema.name.startswith("hdsim."):
                first[channel.topic] = message_class(schema.name, schema.data).FromString(message.data)
            else:
                first[channel.topic] = message.data
    assert set(first) == set(map(topic_of, paths))
    loop = first["/hd/state_loop"]
    curve = np.array([loop.twist_arcsec, loop.output_torque])
    points = np.unique(curve[:, np.isfinite(curve).all(axis=0)], axis=1).T
    # A drive without load keeps to one point.
    assert len(points) > 10 or not np.ptp(hdsim.open_log(log)["output_torque"])
    for each in paths:
        if each.endswith("[:]"):
            topic, field = split_path(each)
            assert np.isfinite(getattr(first[topic], field)).sum() >= 2, each


def topic_of(path):
    return split_path(path)[0]


@pytest.mark.parametrize("path", SCENARIOS[:3], ids=lambda path: path.stem)
def test_javascript_agrees_on_counts_and_crcs(log_of, reader, path):  # noqa: F811
    log = log_of(path)
    done = read(reader, log)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    counts = {topic: check.messages for topic, check in verify_log(log).topics.items()}
    assert {topic: each["indexed"] for topic, each in found["topics"].items()} == counts
    assert {topic: each["streamed"] for topic, each in found["topics"].items()} == counts


@pytest.mark.parametrize(
    ("duration", "low", "high"),
    [(0.02, 2, 10), (1.0, 10, 60), (9.0, 9, 60), (60.0, 10, 60), (1800.0, 300, 400)],
)
def test_playback_lasts_as_long_as_one_likes_to_watch(duration, low, high):
    """Viewers play at 0.01 to 5 times real time, so the longest runs last longer than a minute."""
    speed = playback_speed(duration)
    assert 0.01 <= speed <= 5
    assert low <= duration / speed <= high
    for name in LAYOUTS:
        assert build_layout(name, duration=duration)["playbackConfig"]["speed"] == speed
