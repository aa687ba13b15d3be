"""One step of a chain (position, rate, acceleration) whose third derivative is white noise; compiled, in place.

Between two rows the chain is discretised exactly (Bar-Shalom, Li and Kirubarajan 2001, eq. 6.2.3-7): the means ``m``
(3 or more, k components), their covariance ``p``, which all components share, and the adjoint of the smoother.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def add_noise(p, q, dt):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Add what white noise of intensity ``q`` in the third derivative does to the covariance within ``dt``."""
    d2, d3 = dt * dt, dt * dt * dt
    p[0, 0] += q * d3 * d2 / 20.0
    p[0, 1] += q * d2 * d2 / 8.0
    p[0, 2] += q * d3 / 6.0
    p[1, 1] += q * d3 / 3.0
    p[1, 2] += q * d2 / 2.0
    p[2, 2] += q * dt
    p[1, 0], p[2, 0], p[2, 1] = p[0, 1], p[0, 2], p[1, 2]


@njit(cache=True)
def predict(m, p, dt, q, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Means and covariance after ``dt``."""
    b = 0.5 * dt * dt
    for k in range(m.shape[1]):
        m[0, k] += dt * m[1, k] + b * m[2, k]
        m[1, k] += dt * m[2, k]
    for j in range(3):
        work[0, j] = p[0, j] + dt * p[1, j] + b * p[2, j]
        work[1, j] = p[1, j] + dt * p[2, j]
        work[2, j] = p[2, j]
    for i in range(3):
        p[i, 0] = work[i, 0] + dt * work[i, 1] + b * work[i, 2]
        p[i, 1] = work[i, 1] + dt * work[i, 2]
        p[i, 2] = work[i, 2]
    add_noise(p, q, dt)


@njit(cache=True)
def update(m, p, o, value, variance, gain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Take a measurement of component ``o`` (0 position, 1 rate, 2 acceleration); its innovation's variance."""
    s = p[o, o] + variance
    for j in range(3):
        gain[j] = p[j, o] / s
    for k in range(m.shape[1]):
        e = value[k] - m[o, k]
        for j in range(3):
            m[j, k] += gain[j] * e
    for i in range(3):
        for j in range(i, 3):
            p[i, j] -= gain[i] * gain[j] * s
            p[j, i] = p[i, j]
    return s


@njit(cache=True)
def back(a, big, dt, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """The adjoint ``a`` and its variance ``big`` before an interval, from those after it."""
    b = 0.5 * dt * dt
    for k in range(a.shape[1]):
        a[2, k] += b * a[0, k] + dt * a[1, k]
        a[1, k] += dt * a[0, k]
    for j in range(3):
        work[0, j] = big[0, j]
        work[1, j] = dt * big[0, j] + big[1, j]
        work[2, j] = b * big[0, j] + dt * big[1, j] + big[2, j]
    for i in range(3):
        big[i, 0] = work[i, 0]
        big[i, 1] = dt * work[i, 0] + work[i, 1]
        big[i, 2] = b * work[i, 0] + dt * work[i, 1] + work[i, 2]


@njit(cache=True)
def disturbance(a, big, dt, q):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """λ'Qλ and m tr(QΛ): what the disturbance of the interval was, and what was to be expected."""
    d2, d3 = dt * dt, dt * dt * dt
    q00, q01, q02 = q * d3 * d2 / 20.0, q * d2 * d2 / 8.0, q * d3 / 6.0
    q11, q12, q22 = q * d3 / 3.0, q * d2 / 2.0, q * dt
    found = 0.0
    for k in range(a.shape[1]):
        x, y, z = a[0, k], a[1, k], a[2, k]
        found += q00 * x * x + q11 * y * y + q22 * z * z + 2.0 * (q01 * x * y + q02 * x * z + q12 * y * z)
    trace = q00 * big[0, 0] + q11 * big[1, 1] + q22 * big[2, 2]
    trace += 2.0 * (q01 * big[0, 1] + q02 * big[0, 2] + q12 * big[1, 2])
    return found, trace * a.shape[1]
