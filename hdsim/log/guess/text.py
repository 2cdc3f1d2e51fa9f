"""The draft as a mapping file, with the ground of every key behind it."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from hdsim.log.guess.findings import Answer, Candidate, Draft, Ground
from hdsim.log.mapping import Form
from hdsim.scenario.writer import to_yaml

_WIDTH = 110


def to_text(draft: Draft, form: Form | None = None) -> str:
    """YAML of a mapping. What is open stands as a comment, so that the rest can be used.

    Args:
        draft: the draft.
        form: how the file was to be read, as far as the user says.
    """
    lines = [
        f"# Mapping of {draft.title}, drafted by hdsim mapping.",
        *_wrapped("; ".join(draft.notes) + "."),
    ]
    lines += ["# Each key has its reason beside it. Please check what is assumed, and answer what is OPEN."]
    if form is not None:
        given = form.model_dump(include={"format", "separator", "decimal", "encoding", "skip_lines"},
                                exclude_defaults=True)  # fmt: skip
        lines += to_yaml(given).splitlines() if given else []
    if draft.ratio is not None:
        lines.append(_line("ratio", draft.ratio))
    lines.append("time:")
    lines += [_line(key, answer, "  ") for key, answer in draft.time.items()]
    bare = not any(not channel.open for channel in draft.channels.values())
    lines.append("channels: {}" if bare else "channels:")
    for name, channel in draft.channels.items():
        mark = "# OPEN " if channel.open else ""
        hidden = "  # " if channel.open else "  "
        lines.append(f"{hidden}{name}:  # {mark and 'OPEN, '}{channel.ground}: {channel.why}")
        lines += [f"{hidden}  {_of(key, value)}" for key, value in _place(channel.source).items()]
        lines += [_line(key, answer, f"{hidden}  ") for key, answer in channel.keys.items()]
    if draft.longest_gap_s is not None:
        lines.append(_line("longest_gap_s", draft.longest_gap_s))
    for mask in draft.masks:
        lines += _wrapped(f"Mask of {mask.value['channels'][0]}, {mask.ground}: {mask.why}")
    lines += to_yaml({"masks": [mask.value for mask in draft.masks]}).splitlines() if draft.masks else []
    lines += _unused(draft.unused)
    lines += [line for question in draft.open for line in _wrapped(f"OPEN: {question}")]
    return "\n".join(lines) + "\n"


def _place(source: Candidate) -> dict[str, Any]:
    return source.origin.model_dump(exclude_none=True)


def _of(key: str, value: Any) -> str:
    return to_yaml({key: value}).strip()


def _line(key: str, answer: Answer, indent: str = "") -> str:
    why = f"{answer.ground}: {answer.why}" if answer.why else str(answer.ground)
    if answer.value is None:
        return f"{indent}# {key}:  OPEN: {answer.why}"
    return f"{indent}{_of(key, _short(answer.value))}  # {why.replace(Ground.OPEN, 'OPEN', 1)}"


def _short(value: Any) -> Any:
    """Whole numbers without their .0."""
    return int(value) if isinstance(value, float) and value == int(value) else value


def _unused(unused: dict[str, str]) -> list[str]:
    by_reason: dict[str, list[str]] = defaultdict(list)
    for label, why in unused.items():
        by_reason[why].append(label)
    lines = ["# Not mapped:"] if by_reason else []
    for why, labels in by_reason.items():
        lines += _wrapped(f"  {', '.join(labels)}: {why}")
    return lines


def _wrapped(text: str) -> list[str]:
    import textwrap

    inner = " " * (len(text) - len(text.lstrip()))
    return textwrap.wrap(text.strip(), _WIDTH - 2 - len(inner), initial_indent=f"# {inner}",
                         subsequent_indent=f"# {inner}  ", break_long_words=False)  # fmt: skip
