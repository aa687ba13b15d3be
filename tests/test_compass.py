"""A heading whose errors wander is told by the gyro, and by nothing that is wrong with either in every log alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.kernel import HEADING
from identify.prepare import prepare
from preprocess import told_wanders
from preprocess.compass import turning_errors, with_heading_wander
from preprocess.wander_likelihood import Likeliest
from validate.structure_left import structured_share

LOGS = ("zigzag", "random", "circle", "zigzag")
STILL = Sensor(10.0, 0.01)
WANDERING = replace(STILL, wander=0.02, wander_time=40.0)
#: An estimator of attitude that filters its compass.
FILTERED = Sensor(20.0, 0.01, wander=0.01, wander_time=0.8)


def heading_wander(trials):
    return turning_errors(trials)[0].own


def sailed(heading=STILL, effects=(), seed=1, logs=LOGS, seconds=90.0):
    """Trials of a small vessel with this compass and a good gyro."""
    suite = replace(Suite(), heading=heading, yaw_rate=Sensor(10.0, 0.001), shared_attitude=False)
    return trials_of("usv", logs, seconds, seed, effects, validate=0, suite=suite)[1]


def test_a_wander_shows_with_its_size():
    sizes = [heading_wander(sailed(WANDERING, seed=k)).size for k in range(3)]
    assert np.exp(np.mean(np.log(sizes))) == pytest.approx(0.02, rel=0.4)


def test_a_wander_within_seconds_shows_with_its_size_and_the_noise_beside_it():
    found = [heading_wander(sailed(FILTERED, seed=k)) for k in range(3)]
    for of in ("size", "white"):
        assert [getattr(f, of) for f in found] == pytest.approx([0.01] * 3, rel=0.2)
    assert [f.time for f in found] == pytest.approx([0.8] * 3, rel=1.1)
    assert heading_wander(sailed(replace(FILTERED, rate=1.0))) is None  # too seldom to show it


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("rate", [2.0, 10.0, 20.0])
def test_white_noise_is_no_wander(seed, rate):
    assert heading_wander(sailed(replace(STILL, rate=rate), seed=seed)) is None


@pytest.mark.parametrize(
    "wrong",
    [
        Effect("gyro_bias", {"bias": 0.02, "scale": 1.1}),
        Effect("heading_bias", {"bias": 0.05}),
        Effect("current", {"speed": 0.3, "direction": 1.0}),
    ],
)
def test_what_every_log_has_alike_is_no_wander(wrong):
    assert heading_wander(sailed(effects=(wrong,))) is None


def deviating(trial, swing, lag=0.3):
    """The trial with a compass that is late, and deviates once and twice around."""
    m = trial.measurements["heading"]
    late = np.interp(m.t - lag, m.t, m.value)
    off = late + swing * np.sin(late) + 0.3 * swing * np.cos(2.0 * late)
    return replace(trial, measurements={**trial.measurements, "heading": replace(m, value=off)})


@pytest.mark.parametrize("logs", [LOGS, ("zigzag",) * 4], ids=["all headings", "narrow"])
@pytest.mark.parametrize("swing", [0.1, -0.2])
def test_a_compass_that_deviates_or_is_late_does_not_wander(logs, swing):
    assert heading_wander([deviating(t, swing) for t in sailed(logs=logs)]) is None
    wanders = heading_wander([deviating(t, swing) for t in sailed(WANDERING, logs=logs)])
    assert wanders.size == pytest.approx(0.02, rel=0.5)


def test_headings_within_some_tens_of_degrees_tell_a_wander():
    """What a compass deviates by at its own headings would be what it wanders."""
    (still,), (wandering,) = (sailed(h, logs=("zigzag",), seconds=400.0) for h in (STILL, WANDERING))
    assert np.ptp(still.states["psi"]) < np.radians(90.0)
    assert heading_wander([still]) is None
    assert heading_wander([wandering]).size == pytest.approx(0.02, rel=0.5)


def test_a_gyro_that_is_silent_for_a_while_makes_no_wander():
    def silenced(t):
        m = t.measurements["yaw_rate"]
        return replace(
            t,
            measurements={**t.measurements, "yaw_rate": replace(m, good=m.good & ((m.t < 30) | (m.t > 40)))},
        )

    assert heading_wander([silenced(t) for t in sailed()]) is None
    assert heading_wander([silenced(t) for t in sailed(WANDERING)]) is not None


def test_one_sensor_alone_says_nothing():
    alone = [
        replace(t, measurements={k: m for k, m in t.measurements.items() if k != "yaw_rate"})
        for t in sailed(WANDERING)
    ]
    assert heading_wander(alone) is None
    assert with_heading_wander(alone) == alone
    assert heading_wander(sailed(WANDERING, logs=("zigzag",))[:0]) is None


def test_what_follows_from_a_wandering_heading_is_less_sure():
    trials = sailed(WANDERING)
    for before, after in zip(trials, with_heading_wander(trials), strict=True):
        size = after.measurements["heading"].wander
        assert size > 0.0
        added = np.sqrt(after.states["sigma_v"] ** 2 - before.states["sigma_v"] ** 2)
        along = np.hypot(before.states["u"], before.states["v"])
        assert added.to_numpy() == pytest.approx(size * along.to_numpy(), abs=1e-6)
        assert any("heading wander" in f for f in after.findings)


def test_a_known_wander_is_noise_and_not_structure_that_the_model_lacks():
    trials = sailed(replace(WANDERING, wander=0.06))
    chi2, shares = [], []
    for known in (trials, with_heading_wander(trials)):
        prepared = prepare(known, "modulus")
        assert any(d.kind == HEADING for s in prepared.identify for d in s.drifts) == (known is not trials)
        fitted = fit_from_scratch(prepared.structure, prepared.identify)
        chi2.append(fitted.chi2_per_dof)
        shares.append(structured_share(fitted)["v"])
    assert chi2[0] > 1.3 > 1.1 > chi2[1]
    assert shares[1] <= shares[0]


def test_a_wander_within_seconds_is_no_structure_either():
    """Counted as so many times the noise it bends coefficients, and what is small is not seen beside it."""
    trials, chi2, slow = sailed(FILTERED), [], []
    for known in (trials, with_heading_wander(trials)):
        prepared = prepare(known, "modulus")
        fitted = fit_from_scratch(prepared.structure, prepared.identify)
        chi2.append(fitted.chi2_per_dof)
        slow.append(fitted.problem.dispersed.inflation[HEADING])
    assert chi2[1] == pytest.approx(1.0, abs=0.04) and chi2[0] > 1.04
    assert slow[0] > 2.0 > 1.2 > slow[1]


@pytest.mark.parametrize("rate", [0.0, 0.1])
def test_an_exact_compass_does_not_wander(rate):
    """Neither at rest nor in a steady turn, where nothing at all is left of heading and gyro."""

    def exact(t):
        heading, gyro = t.measurements["heading"], t.measurements["yaw_rate"]
        both = {
            "heading": replace(heading, value=rate * heading.t, sigma=0.0),
            "yaw_rate": replace(gyro, value=np.full(len(gyro.t), rate), sigma=0.0),
        }
        return replace(t, measurements={**t.measurements, **both})

    with np.errstate(all="raise"):
        assert heading_wander([exact(t) for t in sailed()]) is None


@pytest.mark.parametrize(
    ("first", "other", "chosen"), [(20.0, 23.0, 40.0), (20.0, 25.0, 10.0), (11.9, 11.0, None)]
)
def test_a_gain_is_what_it_is_though_the_first_time_constant_is_preferred(monkeypatch, first, other, chosen):
    """Times that are not told apart leave the first; what speaks for it is not the more for that."""
    gains = {None: 0.0, 40.0: first, 10.0: other}

    def likeliest(_, errors):
        return Likeliest(-gains.get(errors.own, 0.0), 0.02, 0.0, 0.01)

    monkeypatch.setattr(told_wanders, "likeliest", likeliest)
    found = heading_wander(sailed())
    assert (found and (found.time, found.gain)) == (chosen and (chosen, gains[chosen]))


def stamped_late(trial, lag):
    m = trial.measurements["heading"]
    return replace(trial, measurements={**trial.measurements, "heading": replace(m, t=m.t + lag)})


@pytest.mark.parametrize("lag", [0.8, 1.5])
@pytest.mark.parametrize(("heading", "size"), [(STILL, None), (FILTERED, 0.01), (WANDERING, 0.02)])
def test_a_heading_that_is_late_by_much_wanders_by_no_more_than_it_does(heading, size, lag):
    """What the vessel does meanwhile is no wander, however much more than its rate it is."""
    found = heading_wander([stamped_late(t, lag) for t in sailed(heading)])
    assert (found and found.size) == (size and pytest.approx(size, rel=0.4))


def test_a_wander_within_a_second_is_not_held_for_the_shortest_of_long_ones():
    quick = Sensor(5.0, 0.02, wander=0.015, wander_time=2.0)
    found = heading_wander(sailed(quick, seconds=150.0))
    assert found.time < 5.0
    assert found.size == pytest.approx(0.015, rel=0.4)
