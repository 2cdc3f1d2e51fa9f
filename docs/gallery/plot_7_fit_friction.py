r"""
Friction fitted to a recording
==============================

A simulated drive stands in for a measured one: its friction is 40 % above the model's, and the torque
sensor is noisy. ``hdsim.fit`` looks for the three numbers of the friction law

.. math:: T = (T_c + c_L |\tau| / i)\, \mathrm{sign}(\omega) + b\, \omega

and gives each with its interval, or says that the record cannot tell: without a load the loss in the mesh,
:math:`c_L`, stays open.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim

model = hdsim.example("sine_tracking").with_(
    {
        "effects": {},
        "command.motor.trajectory.frequency_hz": 0.5,
        "run.duration_s": 4.0,
        "run.sample_rate_hz": 250.0,
        "load.torque": None,
    },
    drive={"preset": "csg-20-100", "mesh": {"model": "rigid"}},
)
FRICTION = ["coulomb_nm", "viscous_nm_s_per_rad", "load_coefficient"]
FREE = [f"drive.friction.{name}" for name in FRICTION]
truth = {path: 1.4 * getattr(model.drive.friction, name) for path, name in zip(FREE, FRICTION, strict=True)}
measured = hdsim.simulate(model.with_(truth))
measured["motor_torque"][:] += np.random.default_rng(0).normal(0.0, 2e-3, measured.time.size)  # N m

found = hdsim.fit(measured, model, free=FREE)
for one in found.intervals:
    told = f"{one.value:.3g}, 95 %: {one.low:.3g} to {one.high:.3g}" if one.determined else "not determined"
    print(f"{one.name} [{one.unit or '1'}]: {told}; true: {truth[one.name]:.3g}")

# %%
# The torque over the speed: measured, of the model, and of the model with what was found.

fitted = hdsim.simulate(model.with_(found.changes))
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
axes.plot(measured["motor_velocity"], 1e3 * measured["motor_torque"], ".", color="silver", label="measured")
axes.plot(measured["motor_velocity"], 1e3 * hdsim.simulate(model)["motor_torque"], label="model")
axes.plot(fitted["motor_velocity"], 1e3 * fitted["motor_torque"], label="fitted")
axes.set_xlabel("motor speed [rad/s]")
axes.set_ylabel("motor torque [mN m]")
axes.legend()
plt.show()
