"""The rollout of ``bench_rollout`` in JAX: ``python rollout_jax.py CASE REPEATS``, in an environment that has it.

CASE is an ``.npz`` with ``rudder`` (n,), ``revolutions``, ``first`` (8,), ``step``, ``coefficients`` (27,) in the order
of the terms below, and ``population`` (m, 27). What is compiled is this one model; the states of every step are kept.
Prints the least seconds of one run, of the whole population, and the states at the end of the first.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)


State = tuple[Any, ...]


def total(weights: State, terms: State) -> Any:
    """Sum of weighted terms, written out: faster here than a product of arrays."""
    return sum(w * t for w, t in zip(weights, terms, strict=True))


def rate(z: State, rudder: Any, n: Any, p: State) -> State:
    """Time derivative of x, y, heading, u, v, r."""
    _, _, psi, u, v, r = z
    au, av, ar = abs(u), abs(v), abs(r)
    side = (
        u * r,
        u * v,
        v,
        av * v,
        ar * v,
        r,
        av * r,
        ar * r,
        au * u * rudder,
        au * u * abs(rudder) * rudder,
    )
    surge = (u, au * u, u * u * u, v * r, r * r, n * abs(n), abs(n) * u)
    c, s = jnp.cos(psi), jnp.sin(psi)
    return u * c - v * s, u * s + v * c, r, total(p[:7], surge), total(p[7:17], side), total(p[17:], side)


def moved(z: State, rates: State, time_: Any) -> State:
    """A state after a time at these rates."""
    return tuple(a + time_ * b for a, b in zip(z, rates, strict=True))


def free_run(first: Any, rudder: Any, n: Any, h: Any, p: Any) -> Any:
    """States (steps, 6) by the fourth-order rule, the rudder held over a step."""
    coefficients = tuple(p[k] for k in range(27))

    def step(z: State, d: Any) -> tuple[State, Any]:
        a = rate(z, d, n, coefficients)
        b = rate(moved(z, a, 0.5 * h), d, n, coefficients)
        c = rate(moved(z, b, 0.5 * h), d, n, coefficients)
        e = rate(moved(z, c, h), d, n, coefficients)
        mean = tuple((i + 2 * j + 2 * k + m) / 6 for i, j, k, m in zip(a, b, c, e, strict=True))
        z = moved(z, mean, h)
        return z, jnp.stack(z)

    _, states = jax.lax.scan(step, tuple(first[k] for k in range(6)), rudder)
    return states


def least(function: Callable[[], Any], repeats: int) -> float:
    """Least wall-clock seconds of a call that waits for its result."""
    jax.block_until_ready(function())
    found = []
    for _ in range(repeats):
        began = time.perf_counter()
        jax.block_until_ready(function())
        found.append(time.perf_counter() - began)
    return min(found)


def main(path: str, repeats: str) -> None:
    """Print the measurements as JSON."""
    case = np.load(path)
    rest = (
        jnp.asarray(case["first"][:6]), jnp.asarray(case["rudder"]), float(case["revolutions"]), float(case["step"]),
    )  # fmt: skip
    one, many = jax.jit(free_run), jax.jit(jax.vmap(free_run, (None, None, None, None, 0)))
    p, population = jnp.asarray(case["coefficients"]), jnp.asarray(case["population"])
    found = {
        "version": jax.__version__,
        "one": least(lambda: one(*rest, p), int(repeats)),
        "population": least(lambda: many(*rest, population), max(3, int(repeats) // 4)),
        "end": np.asarray(one(*rest, p)[-1]).tolist(),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:3])
