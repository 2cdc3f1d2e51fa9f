"""What a file for MuJoCo leaves out of a scenario, and what that does to the torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import HdsimError

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

#: Longest run by which something that is lost is weighed, s, and its sample rate.
LONGEST_S, RATE_HZ = 2.0, 1000.0


@dataclass(frozen=True)
class Lost:
    """Something of a scenario that the file says otherwise, or not at all.

    Args:
        what: of the scenario.
        instead: what the file has in its place.
        by_callback: whether ``hdsim.export.mujoco.Rest`` brings it back.
        without: changes by which a scenario (``Scenario.with_``) loses the same.
        share: by how much the drive's torque on the output then differs in hdsim's own run, rms over rms;
            None where that is not known.
    """

    what: str
    instead: str
    by_callback: bool = True
    without: Mapping[str, Any] = field(default_factory=dict)
    share: float | None = None

    @property
    def figure(self) -> str:
        """``share`` as text."""
        return "" if self.share is None else f"{100 * self.share:.2g} %"


class Weighing:
    """The scenario's first ``LONGEST_S`` seconds in hdsim, as they are and with something left out.

    Args:
        scenario: whose drive is exported.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        run = {"duration_s": min(scenario.run.duration_s, LONGEST_S), "sample_rate_hz": RATE_HZ}
        self._run = {f"run.{name}": value for name, value in (run | {"teeth_rate_hz": 0.0}).items()}

    @cached_property
    def _whole(self) -> Any:
        return self._torque({})

    @property
    def mean_torque_nm(self) -> float:
        """Mean size of the drive's torque on the output, N m; 0 where the run fails."""
        return 0.0 if self._whole is None else float(np.mean(np.abs(self._whole)))

    def weighed(self, lost: Sequence[Lost]) -> tuple[Lost, ...]:
        """What is lost, with its share of the torque."""
        return tuple(replace(one, share=self._share(one.without)) for one in lost)

    def _share(self, without: Mapping[str, Any]) -> float | None:
        if not without or self._whole is None or not np.any(self._whole):
            return None
        torque = self._torque(without)
        if torque is None:
            return None
        return float(np.linalg.norm(torque - self._whole) / np.linalg.norm(self._whole))

    def _torque(self, without: Mapping[str, Any]) -> Any:
        """Torque of the drive on the output, N m, shape (n,); None where the run fails."""
        from hdsim.simulation.simulate import simulate

        try:
            return simulate(self._scenario.with_({**self._run, **without}))["output_torque"]
        except HdsimError:
            return None
