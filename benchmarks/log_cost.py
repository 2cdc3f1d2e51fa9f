"""Size and cost of the log of a real run: with scene and teeth, against the same run that logs nothing.

    python benchmarks/log_cost.py [SCENARIO] [SECONDS]

The scenario runs for SECONDS (60) at 1 kHz, teeth at 50 Hz, with the scene: once into memory, once straight
into its log; then the recording in memory is written as a log, whose time is all logging and scatters less
than the difference of two runs. Aims for 60 s: below 25 MB and below 15 % of processor time.

What the log holds is told by topic, and the same messages are written by the writer of the ``mcap`` package,
in the same order, for the ratio of size and of time.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import Counter
from importlib.metadata import version
from pathlib import Path

import zstandard
from mcap import records
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer
from rich.console import Console
from rich.table import Table as Listing

import hdsim
from hdsim.log import container, scan, write_log
from hdsim.scenario.model import Scenario
from hdsim.simulation.simulate import simulate, simulate_to_log

ROOT = Path(__file__).resolve().parents[1]


def lengthened(path: Path, seconds: float) -> Scenario:
    scenario = hdsim.load_scenario(path)
    data = scenario.model_dump()
    data["run"] |= {"duration_s": seconds, "sample_rate_hz": 1000.0, "teeth_rate_hz": 50.0}
    return Scenario.model_validate(data)


def by_topic(path: Path) -> Listing:
    """Messages of each topic, their bytes, and what they take in the file: in each chunk compressed alone,
    and 16 bytes of index a message. Compressed together they take less."""
    data = scan.map_file(path)
    compressor = zstandard.ZstdCompressor(compression_params=container.ZSTD)
    counts, raw, packed = Counter[int](), Counter[int](), Counter[int]()
    names: dict[int, str] = {}
    for span in scan.walk(data):
        if span.opcode == Opcode.CHUNK:
            parts: dict[int, list[bytes]] = {}
            for run in scan.runs(scan.open_chunk(data, span).data):
                if run.opcode == Opcode.CHANNEL:
                    channel = scan.parse(records.Channel, run.data, run.span)
                    names[channel.id] = channel.topic
                elif run.opcode == Opcode.MESSAGE:
                    id = int(scan.message_heads(run)["channel"][0])
                    parts.setdefault(id, []).append(run.data[run.start : run.start + run.size * run.count])
                    counts[id] += run.count
            for id, part in parts.items():
                raw[id] += sum(map(len, part))
                packed[id] += len(compressor.compress(b"".join(part)))
    listing = Listing("topic", "messages", "MB", "MB in the file", "share", title=f"{len(data) / 1e6:.2f} MB")
    for id, size in (packed + Counter({k: 16 * n for k, n in counts.items()})).most_common():
        share = f"{100 * size / len(data):.1f} %"
        listing.add_row(names[id], str(counts[id]), f"{raw[id] / 1e6:.2f}", f"{size / 1e6:.2f}", share)
    return listing


def write_by_mcap(log: Path, path: Path) -> float:
    """Write the messages of a log by the writer of the ``mcap`` package; processor time in s."""
    with open(log, "rb") as file:
        found = list(make_reader(file).iter_messages(log_time_order=False))
    began = time.process_time()
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in found:
            if channel.id not in channels:
                if schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata
                )
            writer.add_message(
                channels[channel.id],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    return time.process_time() - began


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "scenarios" / "sine_tracking.yaml"
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    scenario = lengthened(path, seconds)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "a.mcap")
        simulate_to_log(lengthened(path, 0.05), log)  # compile and import
        simulate(lengthened(path, 0.05)).save(log)
        began = time.process_time()
        recording = simulate(scenario)
        bare = time.process_time() - began
        began = time.process_time()
        simulate_to_log(scenario, log)
        logged = time.process_time() - began
        began = time.process_time()
        write_log(recording, Path(folder, "b.mcap"))
        writing = time.process_time() - began
        share = 100 * writing / (bare + writing)
        size = log.stat().st_size / 1e6
        peer = Path(folder, "c.mcap")
        peer_time = write_by_mcap(log, peer)
        console = Console(width=120)
        console.print(by_topic(log))
        console.print(
            f"{scenario.name}, {seconds:g} s at 1 kHz, teeth at 50 Hz: log {size:.2f} MB (aim < 25)\n"
            f"the same messages by the writer of mcap {version('mcap')}: {peer.stat().st_size / 1e6:.2f} MB, "
            f"{peer.stat().st_size / log.stat().st_size:.2f} times the size; {peer_time:.2f} s, "
            f"{peer_time / writing:.2f} times the time, without making the messages\n"
            f"run alone {bare:.2f} s, straight into its log {logged:.2f} s, writing the finished recording "
            f"{writing:.2f} s of processor time: logging takes {share:.1f} % of the run (aim < 15)"
        )


if __name__ == "__main__":
    main()
