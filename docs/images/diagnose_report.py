"""Takes the picture of a diagnosis' report: ``python docs/images/diagnose_report.py`` (needs Chromium).

The joint is rigid, by Newton's law and not by hdsim: a motor with cogging of order 4 and a catch at one
place of the travel, which no effect of the catalogue is.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

BASE = """
name: joint
drive: {preset: csg-20-100, mesh: {model: rigid}}
command: {motor: {type: free}}
load: {inertia_kg_m2: 0.5}
run: {duration_s: 1.0}
"""
MAPPING = """
time: {column: time_s, unit: s}
channels:
  motor_angle: {column: motor_angle_rad, unit: rad}
  motor_torque: {column: motor_torque_nm, unit: N m}
"""
SIZE = (1240, 1000)


def measured(seconds: float = 8.0, rate: float = 500.0) -> np.ndarray:
    """Time, motor angle, motor torque: shape (n, 3)."""
    import hdsim

    drive = hdsim.load_scenario(Path("joint.yaml")).drive
    t = np.arange(round(seconds * rate)) / rate
    swings = ((60.0, 2 * np.pi * 0.3), (8.0, 2 * np.pi * 1.1))
    angle = sum(a * (1 - np.cos(w * t)) for a, w in swings)
    velocity = sum(a * w * np.sin(w * t) for a, w in swings)
    acceleration = sum(a * w * w * np.cos(w * t) for a, w in swings)
    inertia = drive.inertia.motor_kg_m2 + drive.inertia.wave_generator_kg_m2 + 0.5 / drive.ratio**2
    coulomb, viscous = drive.friction.coulomb_nm, drive.friction.viscous_nm_s_per_rad
    friction = coulomb * np.tanh(velocity / 0.5) + viscous * velocity
    catch = 0.012 * np.exp(-(((angle - 70.0) / 6.0) ** 2))
    noise = 2e-3 * np.random.default_rng(3).standard_normal(len(t))
    torque = inertia * acceleration + friction + 0.02 * np.sin(4 * angle + 0.3) + catch + noise
    return np.column_stack([t, angle, torque])


def main() -> None:
    """Write the files, diagnose, take the picture."""
    names = ("chromium", "chromium-browser", "google-chrome")
    browser = next((found for name in names if (found := shutil.which(name))), None)
    if browser is None:
        sys.exit("the picture needs Chromium")
    image = Path(__file__).with_suffix(".webp")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("joint.yaml").write_text(BASE, encoding="utf-8")
        Path("mapping.yaml").write_text(MAPPING, encoding="utf-8")
        header = "time_s,motor_angle_rad,motor_torque_nm"
        np.savetxt("joint.csv", measured(), delimiter=",", header=header, comments="")
        words = [
            "diagnose",
            "joint.csv",
            "--mapping",
            "mapping.yaml",
            "--model",
            "joint.yaml",
            "--out",
            "out",
        ]
        subprocess.run([sys.executable, "-m", "hdsim.cli", *words, "--out", "out"], check=True)
        shot = ["--headless", "--no-sandbox", "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1]}"]
        page = (Path("out") / "report.html").resolve().as_uri()
        subprocess.run([browser, *shot, "--screenshot=shot.png", page], check=True, capture_output=True)
        Image.open("shot.png").convert("RGB").save(image, quality=85, method=6)


if __name__ == "__main__":
    main()
