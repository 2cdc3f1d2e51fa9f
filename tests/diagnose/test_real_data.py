"""Real machines, where their data are at hand; see the SOURCE.md beside them for their origin and licence."""

from pathlib import Path

import pytest

import hdsim
from hdsim.diagnose.measured import record_from
from hdsim.diagnose.workflow import diagnose

ROOT = Path(__file__).parents[2]
KINOVA = ROOT.parent / "shared" / "data" / "kinova-gen3-7dof" / "validation_data" / "opti_traj_testing1.csv"

RIGID = """
name: Kinova joint, rigid and without friction
drive:
  rated_torque_nm: 30
  arrangement: flexspline_fixed
  geometry: {flexspline_teeth: 198, circular_spline_teeth: 200}
  torsion: {stiffness_k1_nm_per_rad: 1.6e4, stiffness_k2_nm_per_rad: 2.5e4, stiffness_k3_nm_per_rad: 2.9e4,
            torque_t1_nm: 7, torque_t2_nm: 25}
  inertia: {motor_kg_m2: 3.0e-5, wave_generator_kg_m2: 1.0e-5}
  mesh: {model: rigid}
command: {motor: {type: free}}
load: {inertia_kg_m2: 1.0e-4}
run: {duration_s: 1.0}
"""

#: Coulomb friction (N m at the output) of a straight-line fit of motor torque less sensor torque over the
#: velocity and its sign.
FRICTION = {1: 2.66, 3: 2.17, 4: 2.44, 6: 1.18}


@pytest.mark.slow
@pytest.mark.skipif(not KINOVA.exists(), reason="the recordings are not here")
@pytest.mark.parametrize("joint", FRICTION)
def test_kinova_joints_lack_friction_first(tmp_path, joint):
    base = tmp_path / "rigid.yaml"
    base.write_text(RIGID, encoding="utf-8")
    mapping = ROOT / "scenarios" / "mappings" / f"kinova_joint_{joint}.yaml"
    record = record_from(hdsim.import_recording(KINOVA, mapping), f"joint {joint}")
    found = diagnose([record], hdsim.load_scenario(base), load="output_torque").verdict
    assert found.verdict == "effect"
    first = found.effects[0]
    names = {first.name, *first.indistinguishable_from}
    assert "input_coulomb_viscous" in names
    assert names <= {"input_coulomb_viscous", "lugre_friction", "load_dependent_loss", "stribeck_friction"}
    if first.name == "input_coulomb_viscous":
        assert 100 * first.parameters["coulomb_nm"].value == pytest.approx(FRICTION[joint], rel=0.35)
    gap = found.gap["motor_torque"]
    assert gap.after < 0.8 * gap.before
    # The mapping masks the control loop's hiccups, or the check finds them: said either way.
    assert any(p.kind in ("spikes", "missing") and p.channel == "motor_torque" for p in found.data_problems)
