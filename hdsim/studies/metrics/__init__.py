"""Figures of merit, each by its standard; importing this package registers them."""

from hdsim.studies.metrics import frequency, friction, limits, motion, positioning, teeth, torsion, transmission

__all__ = ["frequency", "friction", "limits", "motion", "positioning", "teeth", "torsion", "transmission"]
