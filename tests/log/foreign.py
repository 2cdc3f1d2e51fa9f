"""Tables that a foreign recorder might have written, and the simplest mapping of one."""

from pathlib import Path

import numpy as np

from hdsim.log.importing import import_recording
from hdsim.recording import Recording

N = 400
TIME = np.arange(N) * 1e-3
ANGLE = 0.3 * np.sin(2 * np.pi * 3 * TIME)

BASE = "channels:\n  output_angle: {column: a, unit: rad}\ntime: {column: t, unit: s}\n"


def write_csv(path: Path, columns: dict[str, np.ndarray], separator: str = ",") -> Path:
    rows = np.column_stack(list(columns.values()))
    lines = [separator.join(columns), *(separator.join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n")
    return path


def simple(tmp_path: Path, time: np.ndarray, values: np.ndarray, mapping: str) -> Recording:
    (tmp_path / "m.yaml").write_text(mapping)
    return import_recording(write_csv(tmp_path / "a.csv", {"t": time, "a": values}), tmp_path / "m.yaml")
