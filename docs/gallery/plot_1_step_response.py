"""
Step response and settling
==========================

The command of a joint jumps by one degree. How far does the output overshoot, and when does it stay within
30 arcsec of the target? The numbers are those of ``hdsim run``, each with its definition.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim

START_S = 0.05
joint = hdsim.example("move_and_settle").with_(
    {
        "drive.mesh": {"model": "lumped"},  # the catalogue's stiffness: fast, and without single teeth
        "command.motor.trajectory": {"type": "step", "height_deg": 1.0, "start_time_s": START_S},
        "run.duration_s": 0.6,
    },
    name="step of 1 degree",
)
GAIN = "command.motor.controller.position_gain_per_s"
results = {gain: hdsim.simulate(joint.with_({GAIN: gain})) for gain in (40.0, 70.0)}

# %%
# A larger position gain settles sooner, at the price of an overshoot.

for gain, result in results.items():
    numbers = result.metrics()
    print(f"position gain {gain:g} 1/s")
    for name in ("settling_time", "overshoot", "positioning_error"):
        print(f"  {name}: {numbers[name].value:.3g} {numbers[name].unit}")

figure, (whole, near) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
for gain, result in results.items():
    output_deg = np.degrees(result["output_angle"])
    (line,) = whole.plot(result.time, output_deg, label=f"position gain {gain:g} 1/s")
    near.plot(result.time, 3600 * (output_deg - 1.0))
    near.axvline(START_S + result.metrics()["settling_time"].value, color=line.get_color(), linestyle="--")
whole.axhline(1.0, color="grey", linewidth=0.8)
whole.set_ylabel("output angle [deg]")
whole.legend(loc="lower right")
near.axhspan(-30, 30, color="tab:green", alpha=0.15, label="settling band; dashed: settled")
near.set_ylim(-300, 300)
near.set_ylabel("output - target [arcsec]")
near.set_xlabel("time [s]")
near.legend(loc="lower right")
plt.show()
