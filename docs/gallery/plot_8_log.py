"""
A run as a log, and back
========================

Every run can be kept as one MCAP file, which Foxglove and any MCAP tool open; hdsim reads back the same
bits. ``hdsim plot`` draws a page of such a log, ``hdsim info`` says what is in it.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import hdsim

move = hdsim.example("move_and_settle").with_({"drive.mesh": {"model": "lumped"}})
result = hdsim.simulate(move)
with TemporaryDirectory() as folder:
    path = result.save(Path(folder) / "move.mcap")
    print(f"{path.stat().st_size / 1e6:.1f} MB, {result.time.size} samples of {len(list(result))} channels")
    again = hdsim.open_log(path)
same = all(np.array_equal(again[name], result[name], equal_nan=True) for name in result)
print("the same bits:", same)

# %%
# The log carries its scenario, so its numbers can be taken from it alone, and every channel its unit.

print(f"tracking error, rms: {again.metrics()['tracking_error_rms'].value:.0f} arcsec")

CHANNELS = ("output_angle", "motor_torque", "input_friction_torque")
figure, rows = plt.subplots(3, 1, sharex=True, figsize=(7, 5.5), layout="constrained")
for axes, name in zip(rows, CHANNELS, strict=True):
    axes.plot(again.time, again[name], linewidth=1)
    axes.set_title(name, loc="left", fontsize=9)
    axes.set_ylabel(f"[{again.unit(name)}]")
axes.set_xlabel("time [s]")
plt.show()
