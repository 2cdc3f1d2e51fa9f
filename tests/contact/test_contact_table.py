import numpy as np
import pytest

from hdsim.contact import TableLaw
from hdsim.errors import InputError

GOOD = "# measured\npenetration_m , note, force_n\n0,a,0\n1e-6,b,20\n2e-6,c,50\n3e-6,d,90\n"


def test_a_csv_file_is_read(tmp_path):
    path = tmp_path / "contact.csv"
    path.write_text(GOOD)
    law = TableLaw.from_csv(path)
    np.testing.assert_allclose(law.force([1e-6, 2e-6, 3e-6]), [20, 50, 90])
    # Beyond the last point: straight on.
    assert law.force(4e-6) == pytest.approx(90 + 1e-6 * float(law.stiffness(4e-6)))
    assert law.penetration(200.0) > 4e-6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("penetration,force_n\n0,0\n", "expected penetration_m, force_n"),
        ("", "found columns none"),
        (GOOD.replace("20", "twenty"), r":4: expected two numbers, found '1e-6', 'twenty'"),
        (GOOD.replace("0,a,0", "0,a,5"), "must start at"),
        (GOOD.replace("50", "20"), "force must rise strictly: point 3"),
        (GOOD.replace("2e-6", "0.5e-6"), "penetration must rise strictly"),
        (GOOD.replace("90", "nan"), "finite"),
        ("penetration_m,force_n\n0,0\n1,1\n", "at least 3 points"),
        ("penetration_m,force_n\n0,0\n1\n2,3\n", ":3: expected two numbers"),
        ("penetration_m,force_n\n", "at least 3 points, found 0"),
    ],
)
def test_a_table_that_is_no_law_is_refused_with_its_place(tmp_path, text, words):
    path = tmp_path / "contact.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as error:
        TableLaw.from_csv(path)
    assert str(path) in str(error.value)


def test_what_is_no_text_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        TableLaw.from_csv(tmp_path / "absent.csv")
    with pytest.raises(InputError, match="cannot read"):
        TableLaw.from_csv(tmp_path)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01penetration_m,force_n\n\x80\x81")
    with pytest.raises(InputError):
        TableLaw.from_csv(binary)
    with pytest.raises(InputError, match="one length"):
        TableLaw([0, 1, 2], [0, 1])
