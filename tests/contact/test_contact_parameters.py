import subprocess
import sys

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from hdsim.contact import ConstantStiffness, HertzLine, MajumdarBhushan, TableLaw
from hdsim.contact.parameters import ContactParameters, Materials
from hdsim.surface import Flank

READ = TypeAdapter(ContactParameters).validate_python
SURFACE = Flank(2.43, 1.364e-10)


def test_each_law_is_built_from_its_name(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("penetration_m,force_n\n0,0\n1e-6,20\n2e-6,50\n")
    for given, kind in (
        ({"law": "majumdar_bhushan"}, MajumdarBhushan),
        ({"law": "constant", "contact_stiffness_n_per_m": 6e7}, ConstantStiffness),
        ({"law": "hertz_line", "relative_radius_m": 0.002}, HertzLine),
        ({"law": "table", "file": str(path)}, TableLaw),
    ):
        law = READ(given).build(SURFACE)
        assert isinstance(law, kind)
        assert law.force(1e-6) > 0.0


@pytest.mark.filterwarnings("ignore::hdsim.contact.ValidityWarning")
def test_the_softer_flank_yields():
    soft = {"youngs_modulus_pa": 2.1e11, "poisson_ratio": 0.25, "hardness_pa": 2.0e9}
    law = READ({"law": "majumdar_bhushan", "materials": {"circular_spline": soft}}).build(SURFACE)
    assert law.equations.hardness_pa == 2.0e9
    assert law.equations.k == pytest.approx(0.454 + 0.41 * 0.25)


def test_the_reduced_modulus_of_the_default_steels():
    expected = 1 / ((1 - 0.28**2) / 212e9 + (1 - 0.295**2) / 209e9)
    assert Materials().reduced_modulus_pa == pytest.approx(expected)
    assert expected == pytest.approx(1.15e11, rel=0.005)


def test_the_default_floor_needs_no_warning(recwarn):
    law = READ({"law": "majumdar_bhushan"}).build(SURFACE)
    assert not recwarn.list
    assert np.isfinite(law.stiffness_at_force(34.67))


@pytest.mark.parametrize(
    "given",
    [
        {"law": "sponge"},
        {"law": "constant"},
        {"law": "constant", "contact_stiffness_n_per_m": -1.0},
        {"law": "hertz_line", "face_width_mm": 10},
        {"law": "majumdar_bhushan", "floor_force_n": 0},
        {"law": "majumdar_bhushan", "asperity_stiffness": "both"},
    ],
)
def test_wrong_parameters_are_refused(given):
    with pytest.raises(ValidationError):
        READ(given)


def test_reading_the_parameters_imports_nothing_heavy():
    code = (
        "import sys, hdsim.contact.parameters, hdsim.surface.parameters;"
        "print([m for m in ('numpy', 'scipy', 'numba', 'matplotlib', 'control') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
