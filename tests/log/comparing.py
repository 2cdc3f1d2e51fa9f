"""Bitwise comparison of recordings."""

from __future__ import annotations

import numpy as np

from hdsim.recording import Column, Recording


def assert_same_bits(a: np.ndarray, b: np.ndarray) -> None:
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    assert a.shape == b.shape
    assert a.tobytes() == b.tobytes()


def assert_same_columns(a: dict[str, Column], b: dict[str, Column]) -> None:
    assert list(a) == list(b)
    for name in a:
        assert_same_bits(a[name].values, b[name].values)
        assert (a[name].unit, a[name].description) == (b[name].unit, b[name].description)


def assert_same(a: Recording, b: Recording) -> None:
    assert list(a.tables) == list(b.tables)
    for name in a.tables:
        assert_same_bits(a.tables[name].time, b.tables[name].time)
        assert_same_columns(a.tables[name].columns, b.tables[name].columns)
    assert_same_columns(a.static, b.static)
    assert a.events == b.events
    assert a.metadata == b.metadata
