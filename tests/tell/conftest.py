"""One diagnosis of a simulated drive for all tests that need a whole one, and findings written by hand."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "diagnose"))

from diagnose_bench import rigid_record, scenario
from telling import NASTY

import hdsim
from hdsim.diagnosis.workflow import Diagnosis, diagnose
from hdsim.tell.findings import Findings, gather
from hdsim.tell.save import save


@pytest.fixture(scope="session")
def base(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("base")
    scenario(folder)
    return folder / "rigid.yaml"


@pytest.fixture(scope="session")
def diagnosis(base) -> Diagnosis:
    """A motor with cogging of order 4 that the model does not have."""
    record = rigid_record(6.0, extra=lambda angle, _: 0.02 * np.sin(4 * angle + 0.3), seed=3)
    record.name = NASTY
    return diagnose([record], hdsim.load_scenario(base))


@pytest.fixture(scope="session")
def out(diagnosis, base, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    save(diagnosis, base, folder)
    return folder


@pytest.fixture(scope="session")
def found(diagnosis) -> Findings:
    return gather(diagnosis)
