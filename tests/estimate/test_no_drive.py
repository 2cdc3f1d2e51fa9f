"""A model that no drive can be is a prediction that cannot be made: a fit turns back from it."""

from dataclasses import replace

import pytest
import rig

from hdsim.effects.load_dependent_kinematic_error import LoadDependentKinematicError
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.state import state_of


def test_an_uneven_spring_beyond_the_drives_own_cannot_be_predicted(tmp_path):
    """Seen without: a diagnosis that ended with an error of the input, on its way to a soft spring."""
    state = state_of(rig.model(tmp_path))
    bench = bench_for([rig.record(0, 1.0)], [], rig.model(tmp_path), None)

    def uneven(share):
        own = state.drive.torsion.stiffness_k1_nm_per_rad
        terms = [{"order": 2, "stiffness_nm_per_rad": share * own, "per": "wave_generator_turn"}]
        effect = LoadDependentKinematicError.model_validate({"components": terms})
        return replace(state, effects={"load_dependent_kinematic_error": effect})

    bench.predict(uneven(0.9))
    with pytest.raises(PredictionError, match="torsion spring"):
        bench.predict(uneven(1.0))
