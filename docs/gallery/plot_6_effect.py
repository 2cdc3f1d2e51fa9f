"""
An effect turned on, and seen
=============================

The motor swings slowly without load. With Coulomb and viscous friction alone its torque rises with the
speed; with the Stribeck effect it first falls, which is what lets a slow drive stick and slip. The loops
are as wide as the torque that speeds the inertia up.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim

bench = hdsim.example("constant_speed").with_(
    {
        "command.motor.trajectory": {"type": "sine", "amplitude_turns": 4.0, "frequency_hz": 0.1},
        "run.duration_s": 10.0,
        "run.sample_rate_hz": 500.0,
        "run.start": {"motor_velocity_rad_per_s": 2 * np.pi * 4.0 * 2 * np.pi * 0.1},
    },
    drive={"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    effects={},
)
plain = hdsim.simulate(bench)
stribeck = hdsim.simulate(bench.with_({"effects.stribeck_friction": {"extra_static_nm": 0.02}}))

figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
for label, result in (("Coulomb and viscous", plain), ("with the Stribeck effect", stribeck)):
    axes.plot(result["motor_velocity"], 1e3 * result["motor_torque"], label=label, linewidth=1)
axes.set_xlabel("motor speed [rad/s]")
axes.set_ylabel("motor torque [mN m]")
axes.legend()
plt.show()
