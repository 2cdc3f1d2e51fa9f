"""Bench procedures: scenario, metrics and picture; importing this package registers them."""

from hdsim.studies.bench import transmission  # isort: skip - the order is that of the command's table
from hdsim.studies.bench import frequency, friction, positioning, settling, torsion

__all__ = ["frequency", "friction", "positioning", "settling", "torsion", "transmission"]
