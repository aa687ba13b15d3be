"""Zhao and Li 2021, table 5: parameters of sway and yaw, and which of them the data can give.

    python -m benchmarks.papers.p3_table5 [--seeds 5] [--quick]

The rows that the paper labels a3 and a4 are a4 and a5. "known to" is the standard error of output error over the true
value: above 0.5 the two runs do not give the parameter, and the report says so, whatever the prediction is worth.
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.p3 import NOISE, NUMBERED, data, numbered, options, true_numbers, uncertainties
from benchmarks.papers.report import spread

PRINTED = {
    "a4": (0.0024, 0.0041), "a5": (0.1292, 0.1302),
    "b1": (-3.6851e-4, 0.0012), "b2": (-0.0789, -0.0780), "b3": (0.9978, 0.9917), "b4": (-0.0206, -0.0262),
    "b5": (-0.1089, -0.1025), "b6": (-3.1260e-4, -0.0030), "b7": (-0.0026, -0.0019), "b8": (-0.0126, -0.0090),
    "b9": (0.0238, 0.0443), "b10": (0.0083, -0.0287),
    "c1": (-0.0413, -0.0453), "c2": (0.0013, -0.0013), "c3": (-1.3609e-4, 3.2504e-4), "c4": (0.9905, 0.9864),
    "c5": (0.0277, 0.0203), "c6": (-0.0017, 5.3517e-4), "c7": (0.0011, 7.6613e-4), "c8": (-8.6515e-4, -0.0039),
    "c9": (-0.0243, -0.0342), "c10": (-0.0085, 0.0251),
}  # fmt: skip


def main() -> None:
    seeds, methods, duration = options(__doc__)
    for noise in (0.0, NOISE):
        fits = {
            name: [method(data(noise, s, duration), s) for s in range(seeds if noise else 1)]
            for name, method in methods.items()
        }
        numbers = {name: [numbered(f) for f in found] for name, found in fits.items()}
        known = [uncertainties(f) for f in fits["output error"]]
        print(f"\nnoise {noise} m/s and rad/s")
        print(
            f"{'':6}{'paper LS':>11}{'paper ACO':>11}{'published':>11}" + "".join(f"{n:>44}" for n in methods)
        )
        for k in NUMBERED:
            paper = [f"{x:.4g}" if np.isfinite(x) else "-" for x in PRINTED.get(k, (np.nan, np.nan))]
            error = float(np.median([e[k] for e in known])) if noise else 0.0
            cells = [spread(np.array([n[k] for n in found])) for found in numbers.values()]
            note = (
                f"   known to {error:.0%}" + (": not given by these data" if error > 0.5 else "")
                if noise
                else ""
            )
            print(f"{k:6}" + "".join(f"{x:>11}" for x in (*paper, f"{true_numbers()[k]:.4g}"))
                  + "".join(f"{c:>44}" for c in cells) + note, flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
