"""
Transmission error and its orders
=================================

One turn of the output at a constant speed of the motor, without load. The transmission error is the
output's angle less the motor's over the ratio; its order spectrum says how often per turn of the wave
generator each part repeats.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdsim
from hdsim.log.orders import order_spectrum

bench = hdsim.example("constant_speed").with_(
    {"load.inertia_kg_m2": 0.002},  # an encoder alone, so that no resonance comes near
    drive={"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    effects={"set": "catalogue"},  # kinematic error and hysteresis as large as the catalogue prints
)
result = hdsim.simulate(bench)
orders, amplitudes = order_spectrum(result["motor_angle"], result["transmission_error"])

# %%
# The slow wave is the output's own, once and twice a turn; the ripple is the wave generator's, twice a turn.

to_arcsec = np.degrees(1.0) * 3600
figure, (over_angle, spectrum) = plt.subplots(2, 1, figsize=(7, 5.5), layout="constrained")
over_angle.plot(np.degrees(-result["output_angle"]), to_arcsec * result["transmission_error"], linewidth=0.6)
over_angle.set_xlabel("output angle, against the motor's [deg]")
over_angle.set_ylabel("transmission error [arcsec]")
shown = orders <= 5
spectrum.plot(orders[shown], to_arcsec * amplitudes[shown])
spectrum.set_xlabel("order [cycles per turn of the wave generator]")
spectrum.set_ylabel("amplitude [arcsec]")
spectrum.set_ylim(bottom=0)
plt.show()
