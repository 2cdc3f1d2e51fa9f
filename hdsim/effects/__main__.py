"""Print the page of all effects: ``python -m hdsim.effects > docs/effects.md``; a test keeps it current."""

from __future__ import annotations

import inspect
from typing import Any

from hdsim.effects import own
from hdsim.effects._plausible import Plausible, Scale
from hdsim.parts import Effect, Parameters

#: Numbers of the drive that a usual range is a multiple of, in words.
_SCALES: dict[Scale, str] = {
    "rated_torque": "T_N",
    "motor_rated_torque": "T_N/i",
    "per_rated_torque": "1/T_N",
    "per_motor_rated_torque": "i/T_N",
    "stiffness_k1": "K1",
    "motor_stiffness_k1": "K1/i^2",
    "cubic_stiffness": "K1^3/T_N^2",
}

HEAD = """\
# Effects

Each effect is one file in `hdsim/effects/`, and part of a model only where the scenario lists it:

```yaml
effects:
  kinematic_error: {}            # default parameters
  stribeck_friction:
    extra_static_nm: 0.01
```

Torques act on the named body. `theta_m` is the motor's angle, `theta_l` the output's, `i` the signed ratio
`theta_m / theta_l`, `tau` the torque of the drive on the output, elastic and of hysteresis, `w` a speed.
Every friction is dissipative and every spring stores what it takes: the tests check it for each effect at
random states, and its derivatives too. sign(w) of speed-dependent friction is `tanh(w / smoothing
velocity)`: below that speed the drive creeps instead of sticking; LuGre friction and hysteresis have states
instead and stick.

The defaults below are those of size 20 at ratio 100. For another drive they grow with what *usually* is a
multiple of; kinematic error and torsional hysteresis follow the printed accuracy and hysteresis loss of the
preset. `effects: {set: catalogue}` turns these two on, so that a preset shows what its catalogue prints; an
effect listed beside it has the parameters given there, `null` turns it off. `hdsim check` prints the
parameters in use, and the log keeps them.

*Usually* is the range that an engineer expects before a measurement, not a bound; T_N is the rated torque,
K1 the drive's first stiffness. The field itself refuses values that are physically impossible.

A new effect is a new file with one subclass of `hdsim.parts.Effect`. This page is printed by
`python -m hdsim.effects`.
"""


def page() -> str:
    """The page as Markdown."""
    return "\n".join([HEAD, *(section(name, kind) for name, kind in own().items())])


def section(name: str, kind: type[Effect]) -> str:
    """Equation, parameters, source and signature of one effect."""
    s = kind.signature
    seen = f"Function of {', '.join(s.lives_in)}; seen in {', '.join(f'`{c}`' for c in s.channels)}"
    if s.orders:
        seen += f"; orders per wave-generator turn (ratio 100): {', '.join(f'{n:g}' for n in s.orders)}"
    lines = [f"## {name}", "", f"**{kind.title[0].upper()}{kind.title[1:]}.**", ""]
    lines += [inspect.cleandoc(kind.__doc__ or ""), ""]
    for part in _parts(kind):
        if part is not kind:
            lines += [f"`{part.__name__}`: {inspect.getdoc(part)}", ""]
        lines += ["| parameter | default | usually | meaning |", "|---|---|---|---|"]
        lines += [
            f"| `{field}` | {_default(info)} | {_usually(info)} | "
            f"{' '.join((info.description or '').split())} |"
            for field, info in part.model_fields.items()
        ]
        lines += [""]
    lines += [f"*Source:* {kind.source}.", "", f"*Signature:* {seen}.", ""]
    lines += [f"- not `{other}`: {text}" for other, text in s.confused_with.items()]
    return "\n".join([*lines, ""])


def _parts(kind: type[Parameters]) -> list[type[Parameters]]:
    """The effect and the sections that its file defines for it, in the order of their fields."""
    module = inspect.getmodule(kind)
    sections = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Parameters) and value.__module__ == kind.__module__
    ]
    return [kind, *(part for part in sections if part is not kind)]


def _default(info: Any) -> str:
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if value is None:
        return "null"
    if isinstance(value, tuple):
        return "<br>".join(_short(item) for item in value) or "none"
    return _short(value)


def _usually(info: Any) -> str:
    """The plausible range that the field declares, with its source."""
    for note in info.metadata:
        if isinstance(note, Plausible):
            of = f" times {_SCALES[note.of]}" if note.of else ""
            return f"{note.low:g} to {note.high:g}{of} ({note.source})"
    return ""


def _short(value: Any) -> str:
    if isinstance(value, Parameters):
        return ", ".join(f"{k}: {_short(v)}" for k, v in value.model_dump(exclude_defaults=True).items())
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    print(page(), end="")
