"""Spikes in the channels of a draft, and the mask of a mapping that takes them out."""

from __future__ import annotations

import numpy as np

from hdsim.log.guess.findings import Answer, Channel, Draft, Ground
from hdsim.log.mapping import OutlierMask
from hdsim.log.outliers import outliers, runs_of

#: Samples of the longest run that still is a spike.
_LONGEST = 3
#: Least size of a spike: in usual steps from sample to sample, and as a share of the channel's range.
_STEPS, _RANGE = 8.0, 0.02
#: Share of samples beyond which what stands out is a way of the channel and no error of the measurement.
_MOST = 0.01


def propose_masks(found: Draft) -> None:
    """Add a mask for every channel that has spikes, with its evidence."""
    for name, channel in found.channels.items():
        if not channel.open and (answer := _mask(name, channel)) is not None:
            found.masks.append(answer)


def _mask(name: str, channel: Channel) -> Answer | None:
    values = np.asarray(channel.source.values)
    if values.dtype.kind not in "fiu":
        return None
    values = values.astype(np.float64)
    mask = OutlierMask(type="outliers", channels=(name,), width_samples=_LONGEST, isolated=True)
    spikes = outliers(values, mask)
    runs = runs_of(spikes)
    if not runs or spikes.mean() > _MOST:
        return None
    width = max(last - first for first, last in runs)
    narrow = mask.model_copy(update={"width_samples": width})
    if np.array_equal(outliers(values, narrow), spikes):
        mask = narrow
    sound = np.flatnonzero(np.isfinite(values) & ~spikes)
    jumps = np.abs(values - np.interp(np.arange(len(values)), sound, values[sound]))[spikes]
    usual = float(np.median(np.abs(np.diff(values[sound]))))
    if not jumps.min() > max(_STEPS * usual, _RANGE * float(np.ptp(values[sound]))):
        return None
    many = f"{len(runs)} spikes" if len(runs) > 1 else "a spike"
    samples = f"up to {width} samples" if width > 1 else "one sample"
    why = (
        f"{many} of {samples}, {jumps.min():.3g} to {jumps.max():.3g} from the neighbours and back, in the "
        f"file's unit; from sample to sample it is usually {usual:.3g}"
    )
    return Answer(mask.model_dump(mode="json", exclude_defaults=True), Ground.SHOWN, why)
