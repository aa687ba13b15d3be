"""Kernels, and prediction with a machine trained on one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Estimate, FloatArray, KernelMachine, KernelName

CHUNK = 4096  # rows predicted at once, to bound the memory


def gram(
    kernel: KernelName, parameters: Mapping[str, float], left: FloatArray, right: FloatArray
) -> FloatArray:
    """Kernel of every row of ``left`` (m, d) with every row of ``right`` (l, d), (m, l).

    ``linear``: x·y; ``rbf``: exp(-|x - y|² / width²); ``polynomial``: (x·y / width² + offset)^degree.
    """
    if kernel == "linear":
        return left @ right.T
    width = parameters.get("width", 1.0)
    if kernel == "rbf":
        return np.asarray(np.exp(-_squared_distances(left, right) / width**2))
    if kernel == "polynomial":
        offset, degree = parameters.get("offset", 1.0), parameters.get("degree", 3.0)
        return np.asarray((left @ right.T / width**2 + offset) ** degree)
    raise ValueError(f"expected a kernel linear, rbf or polynomial, found {kernel!r}")


def _squared_distances(left: FloatArray, right: FloatArray) -> FloatArray:
    centre = right.mean(axis=0)
    a, b = left - centre, right - centre
    sums = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1)
    return np.asarray(np.maximum(sums - 2 * a @ b.T, 0.0))


def machine_predict(machine: KernelMachine, design: ArrayLike) -> FloatArray:
    """Values of the machine at new rows (m, d), (m,)."""
    rows = np.asarray(design, dtype=float) / machine.scale
    parts = [
        gram(machine.kernel, machine.parameters, rows[i : i + CHUNK], machine.support) @ machine.alpha
        for i in range(0, len(rows), CHUNK)
    ]
    return np.concatenate(parts) + machine.bias


def predict(fitted: Estimate, design: ArrayLike) -> FloatArray:
    """Predicted target at new rows (m, d), whatever the estimator, (m,)."""
    if fitted.machine is not None and fitted.machine.kernel != "linear":
        return machine_predict(fitted.machine, design)
    return np.asarray(design, dtype=float) @ fitted.theta + fitted.bias
