"""Up to what frequency spectra of errors are looked at: no stream that ends leaves a step in them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.kernel import HEADING, YAW_RATE
from identify.prepare import prepare
from validate.error_spectra import UP_TO, _interval, spectra_of
from validate.waves import _chances


def fitted(**streams):
    """A fit with nothing but samples: interval and σ by kind."""
    kinds = {"heading": HEADING, "yaw_rate": YAW_RATE}
    each = [(np.arange(0.0, 60.0, dt), kinds[name], sigma) for name, (dt, sigma) in streams.items()]
    t, kind, sigma = (np.concatenate([np.broadcast_to(x[k], x[0].shape) for x in each]) for k in range(3))
    samples = SimpleNamespace(t=t, kind=kind, sigma=sigma)
    return SimpleNamespace(problem=SimpleNamespace(stretches=[SimpleNamespace(samples=samples)]))


@pytest.mark.parametrize(
    ("streams", "interval"),
    [
        ({"heading": (0.05, 0.01)}, 0.05),
        ({"heading": (0.05, 0.01), "yaw_rate": (0.2, 0.007)}, 0.2),
        ({"heading": (0.05, 0.0005), "yaw_rate": (0.2, 0.007)}, 0.05),
        ({"heading": (0.2, 0.01), "yaw_rate": (0.05, 0.007)}, 0.05),
    ],
    ids=["alone", "a coarse compass", "a fine one", "a fast gyro"],
)
def test_the_faster_of_two_counts_unless_its_noise_makes_a_step_where_the_other_ends(streams, interval):
    assert _interval(fitted(**streams)) == pytest.approx(interval)


def test_no_peak_stands_where_a_gyro_ends_beside_a_coarse_compass():
    """A clean catamaran was said to lie in waves of the gyro's own Nyquist frequency."""
    fast, coarse, gyro = Sensor(20.0, 0.05, 0.0), Sensor(20.0, 0.014, 0.0), Sensor(5.0, 0.0065, 0.0)
    suite = Suite(position=fast, heading=coarse, yaw_rate=gyro)
    ship, trials = trials_of("catamaran", ("zigzag", "random", "zigzag"), 90.0, 11, validate=0, suite=suite)
    ready = prepare(trials, ship.model)
    fit = fit_from_scratch(ready.structure, ready.identify)
    spectra = spectra_of(fit)
    assert spectra.omega[-1] <= UP_TO * np.pi / 0.2
    assert _chances(fit, spectra)[1].min() > 1e-3
