"""Hold a model against measured data: check, compare, re-fit, locate, name, add, prove.

>>> import hdsim
>>> from hdsim.diagnosis.workflow import diagnose
>>> found = diagnose([recording], hdsim.load_scenario("base.yaml"))
>>> found.verdict.verdict, [effect.name for effect in found.verdict.effects]
"""
