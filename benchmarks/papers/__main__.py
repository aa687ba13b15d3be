"""Every table of the papers, one after the other.

python -m benchmarks.papers [--quick] [--only p3]
"""

from __future__ import annotations

import argparse
import subprocess
import sys

COMMANDS = (
    "p0_table3", "p0_table5", "p0_table6", "p0_table7", "p0_table8",
    "p1_table2", "p1_table4", "p1_figures", "p1_outliers",
    "p2_table4", "p2_table5", "p2_table6",
    "p3_table2", "p3_table3", "p3_table5", "p3_table6",
    "p4_deviations",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="only to see that they work")
    parser.add_argument("--only", default="", help="begin of the names of those to run")
    chosen = parser.parse_args()
    for name in (c for c in COMMANDS if c.startswith(chosen.only)):
        print(f"\n=== {name}", flush=True)
        arguments = ["--quick"] if chosen.quick else []
        subprocess.run([sys.executable, "-m", f"benchmarks.papers.{name}", *arguments], check=True)


if __name__ == "__main__":
    main()
