"""The five-state ESO for the second-order Nomoto model (Zhu et al. 2022, eqs. 6-20), corrected.

States: heading ψ, yaw rate ψ̇, rudder angle δ, ψ̈ and the lumped right side of ψ⃛. Against the paper: the
steering gear is δ̇ = (δ_set - δ)/T_m (eq. 3 has the sign of an unstable gear, from which the paper
concludes that it needs a controller); the artificial "(b - 1) u" of eq. 7 is left out, as the lag of z₅
behind it swamps ψ⃛; l₂ holds λ₂λ₅ where eq. 20 repeats λ₁λ₅. The four poles of the heading's part lie at
-ω, that of the gear at -1/T_m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from preprocess.linear_observer import run_linear
from preprocess.trial import FloatArray


@dataclass(frozen=True)
class NomotoObserver:
    """Bandwidth ω (rad/s), time constant of the gear T_m (s), free gain l₃ on the rudder (1/s)."""

    bandwidth: float
    gear: float
    rudder_gain: float = 0.0


def gains(poles: FloatArray) -> FloatArray:
    """Gains l₁, l₂, l₄, l₅ for four poles (eq. 20, corrected): the coefficients of ``∏ (s - λ)``; (4,)."""
    return np.asarray(np.real(np.poly(poles))[1:], float)


def observe_nomoto(
    observer: NomotoObserver,
    t: FloatArray,
    psi: FloatArray,
    delta_set: FloatArray,
    start: FloatArray | None = None,
) -> FloatArray:
    """Estimate ψ, ψ̇, δ, ψ̈, ψ⃛ from the heading and the commanded rudder.

    Parameters
    ----------
    observer : NomotoObserver
    t : (n,) s
    psi : (n,) rad
        Unwrapped.
    delta_set : (n,) rad
    start : (5,), optional
        State at the first sample; default: the samples, at rest.

    Returns
    -------
    (n, 5)
        In the order of the paper: ψ, ψ̇ (rad/s), δ (rad), ψ̈ (rad/s²), ψ⃛ (rad/s³).
    """
    a, b = matrices(observer)
    first = np.array([psi[0], 0.0, delta_set[0], 0.0, 0.0]) if start is None else start
    return run_linear(t, np.column_stack([psi, delta_set]), a, b, first)


def filter_rudder(
    observer: NomotoObserver, t: FloatArray, delta: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the rudder and its rate seen through the low-pass that is on ψ⃛; (n,), (n,).

    ψ⃛ reaches z₅ through ``l₅/∏(s - λ)``; the right side of Nomoto's equation must pass the same filter.
    """
    w = observer.bandwidth
    l1, l2, l4, l5 = gains(np.full(4, -w))
    a = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-l5, -l4, -l2, -l1]], float)
    b = np.array([[0.0], [0.0], [0.0], [l5]])
    out = run_linear(t, delta[:, None], a, b, np.array([delta[0], 0.0, 0.0, 0.0]))
    return out[:, 0], out[:, 1]


def filter_like_rate(bandwidth: float, t: FloatArray, signals: FloatArray) -> FloatArray:
    """See signals through the low-pass between the true yaw rate and the observer's.

    It estimates ``(l₂s² + l₄s + l₅)/∏(s - λ)`` of the yaw rate: what a regression sets beside it must be seen so too.

    Parameters
    ----------
    bandwidth : float
        rad/s.
    t : (n,) s
    signals : (n,) or (n, m)

    Returns
    -------
    Same shape as ``signals``.
    """
    l1, l2, l4, l5 = gains(np.full(4, -bandwidth))
    a = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-l5, -l4, -l2, -l1]], float)
    b = np.array([[0.0], [0.0], [0.0], [1.0]])
    shown = np.array([l5, l4, l2, 0.0])
    columns = signals if signals.ndim == 2 else signals[:, None]
    first = np.array([[x / l5, 0.0, 0.0, 0.0] for x in columns[0]])
    seen = [run_linear(t, c[:, None], a, b, start) @ shown for c, start in zip(columns.T, first, strict=True)]
    return np.column_stack(seen) if signals.ndim == 2 else seen[0]


def matrices(observer: NomotoObserver) -> tuple[FloatArray, FloatArray]:
    """System and input matrix, ``ż = a z + b (ψ, δ_set)``; (5, 5) and (5, 2)."""
    l1, l2, l4, l5 = gains(np.full(4, -observer.bandwidth))
    l3, g = observer.rudder_gain, 1.0 / observer.gear
    a = np.array(
        [
            [-l1, 1.0, 0.0, 0.0, 0.0],
            [-l2, 0.0, 0.0, 1.0, 0.0],
            [-l3, 0.0, -g, 0.0, 0.0],
            [-l4, 0.0, 0.0, 0.0, 1.0],
            [-l5, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    b = np.array([[l1, 0.0], [l2, 0.0], [l3, g], [l4, 0.0], [l5, 0.0]])
    return a, b
