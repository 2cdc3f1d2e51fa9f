"""Real logs agree with what their machines and their makers say themselves."""

from pathlib import Path

import numpy as np
import pytest

from hdsim.log.importing import import_recording

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
MAPPINGS = ROOT / "scenarios" / "mappings"


def measured_file(*parts: str) -> Path:
    path = DATA.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"the measured data {path} are not here")
    return path


@pytest.mark.parametrize("joint", range(1, 8))
def test_kinova_joints_agree_with_what_the_robot_says_itself(joint):
    path = measured_file("kinova-gen3-7dof", "validation_data", "opti_traj_testing1.csv")
    found = import_recording(path, MAPPINGS / f"kinova_joint_{joint}.yaml")
    raw = np.genfromtxt(path, delimiter=",", names=True)
    assert len(found.time) == 4741
    np.testing.assert_allclose(np.diff(found.time), 1e-3, atol=1e-6)
    np.testing.assert_array_equal(found["output_angle"], raw[f"Position{joint}"])
    kept = np.isfinite(found["motor_torque"])
    assert kept.mean() > 0.95
    # The robot's own column of torque from current refers to the output.
    np.testing.assert_allclose(
        100 * found["motor_torque"][kept], raw[f"TorqueCur{joint}"][kept], rtol=2e-3, atol=5e-3
    )
    # The derivative of the position is the velocity, so time and units fit.
    slope = np.gradient(found["output_angle"], found.time)
    sound = np.isfinite(found["output_velocity"])
    assert np.corrcoef(slope[sound], found["output_velocity"][sound])[0, 1] > 0.9


def test_cycloidal_ramps_show_the_play_that_their_loops_show():
    path = measured_file("cycloidal-backlash-hysteresis", "2024-07-11__15-47-12__torqueramp__base_runin1.csv")
    found = import_recording(path, MAPPINGS / "cycloidal_small_ramps.yaml")
    assert (np.diff(found.time) > 0).all()
    output_angle, output_torque = found["motor_angle"] / 14, found["motor_torque"] * 14
    assert np.abs(output_torque).max() < 6
    # Peak to peak over the ramps to 4 N m: about 2.67 degrees for the actuator without preload.
    assert np.rad2deg(np.ptp(output_angle)) == pytest.approx(2.67, rel=0.1)
