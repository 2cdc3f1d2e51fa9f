"""The blind page's own words: what is drawn, what counts as right."""

from __future__ import annotations

from family_numpy import (
    FILES_SHARE,
    JITTER_SHARE,
    KINDS,
    LEAST_NOISE,
    OFF_SHARE,
    PAIR_STRENGTH,
    RATE_HZ,
    SECONDS,
    STEP,
    STRENGTH,
)
from hidden import EFFECTS
from outside import OUTSIDE


def _share(kind: str) -> str:
    return f"{100 * KINDS.count(kind) / len(KINDS):.0f} %"  # type: ignore[arg-type]


HEAD = f"""# Blind tests of the diagnosis

Written by `python tests/blind page` (`make blind`); not edited by hand.

`tests/blind` draws plants in which an effect is hidden, several or none, and hands a log and a base model to
the diagnosis: nothing else. What is said is stored whole, one JSON line a case, and judged from there.

| family | plant | shares with hdsim |
|---|---|---|
| `numpy` | own equations and fourth-order integrator (NumPy, Numba), a controller in the loop | nothing |
| `mujoco` | a drive in MuJoCo 4, a controller in the loop | nothing |
| `toothed` | hdsim's own toothed drive seen from a `lumped` base: its gap is hidden | the simulator |
| `real` | recordings of real joints (Kinova Gen3, NEURA LARA8) into which an effect is put | nothing |

**What is calibrated on what.** Odd seeds are for the statement: no rule of the diagnosis has been
calibrated on them, nor on any case of the `mujoco` family, whatever its seed; `python tests/blind
calibrate` refuses both. Even seeds of the other families are for calibration. The tables below are of
statement cases alone, but for the column that says otherwise.

**What is drawn** (`numpy`; the others as far as their plants go). Of twenty numbers {_share("null")} hide
nothing, in {_share("parameter")} one or two of the base's numbers are off by 5 to 30 %, {_share("effect")}
hide one effect (half by the catalogue's own formula, half by another), {_share("pair")} a pair of different
kinds, {_share("outside")} something that the catalogue does not have. Strength log-uniform from
{STRENGTH[0]:g} to {STRENGTH[1]:g} (pairs {PAIR_STRENGTH[0]:g} to {PAIR_STRENGTH[1]:g}), sample rate from
{RATE_HZ[0]:g} to {RATE_HZ[1]:g} Hz, encoder steps from {STEP[0]:g} to {STEP[1]:g} times the noise, records
of {SECONDS[0]:g} to {SECONDS[1]:g} s and some to 60 s, one to four of them. Motor side alone, both
encoders, a torque sensor on top, or a known torque on the output; temperature measured or not. Held out are
stretches, or ({100 * FILES_SHARE:.0f} %) one or two separate files with other motions and speeds. Stamps
jitter in {100 * JITTER_SHARE:.0f} %; where an effect is hidden the base's numbers are off by 5 to 20 % as
well in {100 * OFF_SHARE:.0f} %. Six sizes of drive (14 to 40, ratios -160 to -50 and +101) whose inertia,
stiffness and friction are 0.6 to 1.7 times the size's; six kinds of motion, one of them ramps against a
locked output.

**Strength** is the root-mean-square of the effect's trace over the noise of its channel (quantisation
included; of the transmission error for the two angles), in the channel where it is largest, *after* a
least-squares fit of channel offsets and of the plant's sensitivities to its own inertias, stiffness,
damping, friction, weight and torque constant: what looks like a wrong number no tool can tell from one. The
trace is taken along the same motor motion, with and without the effect.

An experiment whose samples cannot carry its own motion is drawn again: the plant, moved as a cubic through
the samples says, must read what it read, within 0.3 of the noise or a tenth of the effect. One in which the
effect does not reach its strength at the largest size below is drawn again too, with better sensors by and
by (down to {LEAST_NOISE:g} times the usual noise), and in the end the nearest that was found is taken:
strengths in the tables are those that were reached.

`--most-samples` leaves out, before they are diagnosed, cases whose records hold more samples together; on the
page of this version none is left out. Its statement cases are of a seed of which nothing had been seen when
the search was last changed: all whose turn came in the time there was. A rule that was tried then and taken
back had given a right name to one recording; it is judged by the rules as they are. How recordings are
judged was mended afterwards: a ripple's size is compared as the current reads it, behind the fitted gain.
Calibration cases are of several states of the search, each as it was last run.

The cases of this page are kept in `tests/blind/results.jsonl.gz`, evidence and all: `python tests/blind page`
writes it from them, and `decide` can judge every one again.

**What is right.** A group of effects that the diagnosis calls indistinguishable counts when it holds the
truth and at most three names; the first such group counts, of a pair both must be there. Where two names of
the catalogue are one physical thing (two laws of hysteresis; an eccentric encoder and an eccentric output),
either is right. *Wrong name* is a first group without the truth (or with more than three names), *nothing*
includes a number that is said to be off. A false alarm is a name or `unknown` where nothing is hidden or a
number is off. A diagnosis that stops with an error is wrong.
"""


def limits() -> list[str]:
    """The largest sizes, a table."""
    lines = [
        "## Largest sizes (`numpy`)",
        "",
        "T1, K1: first corner and slope of the drive's torsion spring.",
        "",
    ]
    lines += ["| hidden | no larger than |", "|---|---|"]
    return lines + [f"| {h.name} | {h.limit} |" for h in (*EFFECTS, *OUTSIDE)]
