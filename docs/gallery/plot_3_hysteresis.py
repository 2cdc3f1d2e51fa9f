"""
Torsion cycle: stiffness, hysteresis loss, lost motion
======================================================

The motor is locked and the output is loaded to plus and minus the rated torque, as a catalogue's torsion
curve is measured.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim

bench = hdsim.example("torsion_cycle").with_(
    drive={"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    effects={"set": "catalogue"},
)
result = hdsim.simulate(bench)
numbers = result.metrics()
for name in ("stiffness_k1", "stiffness_k2", "stiffness_k3", "hysteresis_loss", "lost_motion"):
    print(f"{name}: {numbers[name].value:.4g} {numbers[name].unit}")

# %%
# Left the whole cycle, right what happens around zero torque: the loop's height there is the hysteresis
# loss. The short line from the middle is the first loading.

twist_arcmin = np.degrees(result["output_angle"]) * 60
torque_nm = -result["output_torque"]  # of the load on the output

figure, (whole, near) = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
for axes in (whole, near):
    axes.plot(torque_nm, twist_arcmin, linewidth=1)
    axes.set_xlabel("torque on the output [N m]")
    axes.set_ylabel("twist of the output [arcmin]")
near.set_xlim(-4, 4)
near.set_ylim(-1.6, 1.6)
rated = bench.drive.rated_torque_nm
near.axvspan(-0.03 * rated, 0.03 * rated, color="grey", alpha=0.15, label="±3 % of rated torque")
near.legend(loc="upper left")
plt.show()
