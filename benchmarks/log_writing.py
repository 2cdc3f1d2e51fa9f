"""Time of writing and reading a log, against the mcap package's Writer with one protobuf message at a time.

    python benchmarks/log_writing.py [MESSAGES]

Both write the same ten doubles a message, zstd-compressed, with indexes and CRCs; the one-at-a-time peers
write a tenth of the messages, and their rate is compared. Prints rates and ratios.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from rich.console import Console
from rich.table import Table as Listing

from hdsim.log import naming, open_log, verify_log, write_log
from hdsim.log.schemas import message_class, table_schema
from hdsim.recording import Column, Recording, Table

COLUMNS = 9  # and the time


def make(n: int) -> Recording:
    rng = np.random.default_rng(0)
    columns = {
        f"channel_{i}": Column(np.cumsum(rng.standard_normal(n)) * 1e-3, "rad") for i in range(COLUMNS)
    }
    return Recording({"state": Table(np.arange(n) * 1e-3, columns)}, metadata={"scenario": "a: 1"})


def best(work: Callable[[], object], repeats: int = 3) -> float:
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def one_by_one(recording: Recording, path: Path, encoding: str) -> None:
    specs = naming.describe_columns(recording.channels, rows=True)
    schema = table_schema("hdsim.State", specs)
    kind = message_class("hdsim.State", schema)
    names = ["time", *recording]
    rows = np.column_stack([recording.time, *(recording[c] for c in recording)]).tolist()
    log_times = naming.to_ns(recording.time).tolist()
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        if encoding == "json":
            schema_id = writer.register_schema("hdsim.State", "jsonschema", b'{"type": "object"}')
        else:
            schema_id = writer.register_schema("hdsim.State", "protobuf", schema)
        channel = writer.register_channel("/hd/state", encoding, schema_id)
        for log_time, row in zip(log_times, rows, strict=True):
            values = dict(zip(names, row, strict=True))
            data = json.dumps(values).encode() if encoding == "json" else kind(**values).SerializeToString()
            writer.add_message(channel, log_time, data, log_time)
        writer.finish()


def read_one_by_one(path: Path) -> None:
    with open(path, "rb") as file:
        kind = None
        for schema, _, message in make_reader(file, validate_crcs=True).iter_messages(["/hd/state"]):
            kind = kind or message_class(schema.name, schema.data)
            kind.FromString(message.data)


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    full, part = make(n), make(max(1, n // 10))
    listing = Listing(title=f"{n} messages of {COLUMNS + 1} doubles, full rate and view")
    for column in ("", "messages / s", "hdsim is faster by", "MB for a million"):
        listing.add_column(column, justify="right" if column else "left")
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = Path(folder, "ours.mcap"), Path(folder, "theirs.mcap")
        write = n / best(lambda: write_log(full, ours))
        read = n / best(lambda: open_log(ours))
        verify = n / best(lambda: verify_log(ours), 1)
        size = ours.stat().st_size / n
        listing.add_row("write, hdsim", f"{write:,.0f}", "1", f"{size:.0f}")
        for encoding in ("protobuf", "json"):
            rate = len(part.time) / best(lambda e=encoding: one_by_one(part, theirs, e), 2)
            peer_size = theirs.stat().st_size / len(part.time)
            listing.add_row(
                f"write, mcap Writer, {encoding}", f"{rate:,.0f}", f"{write / rate:.1f}", f"{peer_size:.0f}"
            )
        listing.add_section()
        listing.add_row("read, hdsim open_log", f"{read:,.0f}", "1", "")
        small = write_log(part, Path(folder, "part.mcap"))
        rate = len(part.time) / best(lambda: read_one_by_one(small), 2)
        listing.add_row("read, mcap reader, protobuf", f"{rate:,.0f}", f"{read / rate:.1f}", "")
        listing.add_row("verify, hdsim verify_log", f"{verify:,.0f}", "", "")
    Console().print(listing)


if __name__ == "__main__":
    main()
