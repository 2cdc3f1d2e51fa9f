"""
Bode plot of a joint
====================

Motor torque to motor speed (what a controller sees) and to output speed (what it moves), linearised under
half of the rated torque. The drive is a spring between two masses: first a notch, where the load swings on
it as an absorber, then the resonance. The ratio is negative, so the output's phase begins half a turn from
the motor's.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import hdsim
from hdsim.simulation.linear import find_operating_point
from hdsim.simulation.modes import modes

joint = hdsim.example("move_and_settle").with_({"drive.mesh": {"model": "lumped"}, "effects": {}})
point = find_operating_point(joint, load_torque_nm=-26.0, motor_velocity_rad_per_s=50.0)
drive = hdsim.linearize(joint, operating_point=point, outputs=("motor_velocity", "output_velocity"))
resonance = max(modes(drive), key=lambda mode: mode.frequency_hz)
print(f"resonance at {resonance.frequency_hz:.1f} Hz, damping ratio {resonance.damping_ratio:.3f}")

# %%
# The frequency response, by python-control.

frequency_hz = np.geomspace(1.0, 500.0, 600)
figure, (gain, phase) = plt.subplots(2, 1, sharex=True, figsize=(7, 5.5), layout="constrained")
for name in ("motor_velocity", "output_velocity"):
    response = ct.frequency_response(drive[name, "motor_torque"], 2 * np.pi * frequency_hz)
    label = name.replace("_", " ")
    gain.semilogx(frequency_hz, 20 * np.log10(response.magnitude.squeeze()), label=label)
    phase.semilogx(frequency_hz, np.degrees(np.unwrap(response.phase.squeeze())), label=label)
gain.set_ylabel("gain [dB re 1 rad/s per N m]")
gain.legend()
phase.set_ylabel("phase [deg]")
phase.set_xlabel("frequency [Hz]")
for axes in (gain, phase):
    axes.grid(True, which="both", alpha=0.3)
plt.show()
