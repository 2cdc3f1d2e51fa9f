"""
Backlash of rough flanks
========================

Rough flanks leave a gap at every tooth. With all teeth in the model the torsion curve has a dead zone that
no catalogue's spring has; the same flanks with three times the gap have three times the backlash.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim

bench = hdsim.example("torsion_cycle").with_(
    {
        "load.torque.amplitude_nm": 4.0,
        "load.torque.frequency_hz": 1.0,
        "load.inertia_kg_m2": 0.002,  # a light flange, so that all of the torque winds the drive
        "run.duration_s": 2.25,
        "effects": {},
    }
)
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
backlash_arcsec = {}
for factor in (0, 1, 3):
    result = hdsim.simulate(bench.with_({"drive.mesh.gap_factor": factor}))
    backlash_arcsec[factor] = result.metrics()["backlash"].value
    once = result.time > 1.25  # after the first quarter, a whole cycle
    axes.plot(
        -result["output_torque"][once],
        np.degrees(result["output_angle"][once]) * 3600,
        label=f"gaps x {factor}: backlash {backlash_arcsec[factor]:.1f} arcsec",
    )
axes.set_xlabel("torque on the output [N m]")
axes.set_ylabel("twist of the output [arcsec]")
axes.legend()
plt.show()
