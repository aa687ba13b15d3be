"""``python -m benchmarks.bench_recording``: an hour at 50 Hz into a recording, and the same series row by row.

The peer is Rerun's own way for live data, ``rr.set_time`` and ``rr.log`` for each value, of the measured and predicted
velocities alone; of every twentieth row, and its time taken times twenty. Processor seconds.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import rerun as rr

from benchmarks.results_example import example_results
from validate.diagnosis import Results
from validate.recording import write_recording

RATE, HOUR, PEER_EVERY = 50.0, 3600.0, 20
SERIES = ("u", "v", "r", "u_before", "v_before", "r_before", "u_after", "v_after", "r_after")


def row_by_row(results: Results, file: Path) -> None:
    """Log nine series of each log as a loop would."""
    stream = rr.RecordingStream("peer")
    stream.save(file)
    for log, table in results.predictions.items():
        for row in table.iloc[::PEER_EVERY].to_dict("records"):
            stream.set_time("elapsed", duration=row["t"])
            for name in SERIES:
                stream.log(f"{log}/{name}", rr.Scalars(row[name]))
    stream.flush()


def seconds(work: Callable[[Results, Path], None], results: Results) -> tuple[float, float]:
    """Processor seconds, and megabytes of the file."""
    with tempfile.TemporaryDirectory() as folder:
        file, begin = Path(folder) / "x.rrd", time.process_time()
        work(results, file)
        return time.process_time() - begin, file.stat().st_size / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--logs", type=int, nargs="+", default=[1, 30], help="into how many logs the hour is cut"
    )
    for logs in parser.parse_args().logs:
        results = example_results(logs=logs, duration=HOUR / logs, rate=RATE)
        ours, size = seconds(write_recording, results)
        peer = PEER_EVERY * seconds(row_by_row, results)[0]
        print(
            f"{logs:2d} logs: everything {ours:5.1f} s, {size:5.1f} MB; "
            f"{len(SERIES)} series row by row {peer:5.1f} s; {peer / ours:.1f} times as fast"
        )


if __name__ == "__main__":
    main()
