"""Hold a model against measured data: check, compare, re-fit, locate, name, add, prove.

>>> import hdsim
>>> found = hdsim.diagnose(recording, "base.yaml")
>>> found.verdict.verdict, [effect.name for effect in found.verdict.effects]
"""
