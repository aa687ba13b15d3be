"""The ends of a log and the edges of gaps: wild samples found there, first and last states as sure as said."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from preprocess_samples import Imperfect, at, sampled, truth_of

from preprocess.commanded import changes
from preprocess.ends import outermost
from preprocess.gaps import widened
from preprocess.judge import Judged
from preprocess.outliers import sliding_three_sigma
from preprocess.run_of_log import LoggedRun
from preprocess.trial import Measurement
from preprocess.trials import make_trials

DEMO = Path(__file__).parents[1] / "fixtures" / "demo" / "campaign.toml"
SIGMA = {"position": 0.02, "heading": 0.01, "yaw_rate": 0.003}
RATE = {"position": 4.0, "heading": 10.0, "yaw_rate": 20.0}
#: One gap that is bridged and one that splits.
GAPS = ((25.0, 27.0), (42.0, 54.0))
VESSELS = [("usv", "zigzag"), ("tanker", "random"), ("catamaran", "random")]


def whole(vessel, manoeuvre, seed):
    sensors = {k: Imperfect(RATE[k], SIGMA[k]) for k in SIGMA}
    return sampled(truth_of(vessel, manoeuvre, 70.0, seed), seed, **sensors)


def spoilt(made, group, rng):
    """The log with gaps and ``group`` wild samples (8-30 σ) at about half of all ends; which, which beside."""
    tables, wild, beside = dict(made.log.tables), {}, {}
    for name, sigma in SIGMA.items():
        t = tables[name].index.to_numpy() * 1e-9
        kept = tables[name][~np.any([(t > a) & (t < b) for a, b in GAPS], axis=0)].copy()
        t = kept.index.to_numpy() * 1e-9
        edges = np.r_[0, [np.searchsorted(t, b) for _, b in GAPS], len(t)]
        wild[name], beside[name] = np.zeros((2, len(t)), dtype=bool)
        for low, high in pairwise(edges):
            for end, outer in (
                (slice(low, low + group), slice(low, low + 3)),
                (slice(high - group, high), slice(high - 3, high)),
            ):
                beside[name][outer] = True
                wild[name][end] = rng.random() < 0.5
        count, width = int(wild[name].sum()), kept.shape[1]
        push = rng.normal(size=(count, width))
        push *= sigma * rng.uniform(8.0, 30.0, (count, 1)) / np.linalg.norm(push, axis=1, keepdims=True)
        kept.iloc[np.flatnonzero(wild[name])] += push
        tables[name] = kept
    return replace(made.log, tables=tables), wild, beside


def trial_of(made, log):
    return make_trials(
        [LoggedRun("a.csv", log, "identify")], made.vessel, made.inputs, made.sensors, by_response=False
    )[0]


@pytest.fixture(scope="module")
def counted():
    """By size of the group: wild, wild found, good beside ends, those set aside."""
    out = {group: np.zeros(4, dtype=int) for group in (0, 1, 2, 3)}
    for seed, (vessel, manoeuvre) in enumerate(VESSELS):
        made = whole(vessel, manoeuvre, seed)
        for group in out:
            log, wild, beside = spoilt(made, group, np.random.default_rng(10 * seed + group))
            trial = trial_of(made, log)
            for name in SIGMA:
                m = trial.measurements[name]
                good = beside[name] & ~wild[name]
                out[group] += [
                    wild[name].sum(),
                    (wild[name] & ~m.good).sum(),
                    good.sum(),
                    (good & ~m.good).sum(),
                ]
                assert m.sigma == pytest.approx(SIGMA[name], rel=0.35), (vessel, name, group)
    return out


@pytest.mark.parametrize(("group", "share"), [(1, 0.97), (2, 0.93), (3, 0.9)])
def test_wild_samples_at_ends_are_set_aside(counted, group, share):
    # the outermost of several may lie within what the motion can do since the last good one
    wild, found, _, _ = counted[group]
    assert wild > 15
    assert found >= share * wild


def test_good_samples_at_ends_are_kept(counted):
    _, _, good, lost = np.sum(list(counted.values()), axis=0)
    assert lost <= 0.02 * good


@pytest.mark.parametrize(("vessel", "manoeuvre"), VESSELS)
def test_the_first_and_last_states_are_as_sure_as_they_say(vessel, manoeuvre):
    error = {k: [] for k in ("x", "y", "psi", "u", "v", "r")}
    for seed in range(8):
        made = whole(vessel, manoeuvre, seed)
        s = trial_of(made, made.log).states.dropna()
        for rows in (s.iloc[:3], s.iloc[-3:]):
            for k, e in error.items():
                sigma = rows[f"sigma_{k}"].to_numpy()
                assert (sigma > 0.0).all()
                e.append((rows[k] - at(made.truth, rows["t"], k)).to_numpy() / sigma)
    for k, e in error.items():
        assert np.sqrt(np.mean(np.square(e))) < 2.5, k  # a rudder that steps at once is a surprise


def test_one_wild_fix_at_the_end_spoils_no_scale():
    t = np.arange(100) * 0.25
    x = np.random.default_rng(0).normal(0.0, 0.02, 100)
    x[-1] += 5.0
    aside = np.flatnonzero(sliding_three_sigma(t, x, k=6.0))
    assert aside[-1] == 99
    assert aside[0] >= 94  # those that it spoils are tried again


def test_outermost_samples():
    t = np.r_[np.arange(20), 30.0 + np.arange(20), 50.0 + np.arange(3)]
    segment = np.repeat([0, 0, 1], [20, 20, 3])
    assert outermost(t, segment) == [(0, 4), (16, 20), (20, 24), (36, 40), (40, 41), (42, 43)]


def test_segments_are_judged_with_what_lies_beside_them():
    class Slow:
        t = np.arange(0.0, 10.0, 2.0)

    judged = {"position": Judged(Slow, np.ones(5, bool)), "heading": Judged(Slow, np.ones(5, bool))}
    assert widened(((0.0, 4.0), (6.0, 8.0)), judged) == (
        (-3.0, pytest.approx(4.98)),
        (pytest.approx(5.02), 11.0),
    )
    assert widened((), judged) == ()


def test_a_stretch_begins_where_a_good_fix_does():
    """The first fix after a gap is wild, the next one late: nothing is carried back to the wild one."""
    made = whole("catamaran", "random", 3)
    tables = dict(made.log.tables)
    for name in SIGMA:
        t = tables[name].index.to_numpy() * 1e-9
        lost = (t > 30.0) & (t < 36.0) | ((name == "position") & (t > 36.15) & (t < 37.4))
        tables[name] = tables[name][~lost].copy()
    t = tables["position"].index.to_numpy() * 1e-9
    first = int(np.searchsorted(t, 36.0))
    assert t[first + 1] - t[first] > 1.0
    tables["position"].iloc[first] += 6.0
    trial = trial_of(made, replace(made.log, tables=tables))
    fixes = trial.measurements["position"]
    assert not fixes.good[np.searchsorted(fixes.t, 36.0)]
    begins = [a for a, _ in trial.segments]
    assert begins[-1] == fixes.t[fixes.good & (fixes.t > 36.0)][0]
    between = trial.states["t"].between(30.5, begins[-1], inclusive="left")
    assert between.any()
    assert trial.states.loc[between, ["x", "u", "sigma_u"]].isna().all(axis=None)


def test_the_demo_moves_as_a_vessel_does():
    from seatrial.campaign import load_campaign
    from seatrial.pipeline import read_logs, runs_of

    campaign = load_campaign(DEMO)
    sensors = {s.quantity: s for s in campaign.sensors}
    trials = make_trials(
        runs_of(campaign, read_logs(campaign)), campaign.vessel, campaign.inputs, sensors, by_response=False
    )
    assert len(trials) == 5
    for trial in trials:
        assert trial.states["v"].abs().max() < 1.5, trial.name
        assert trial.measurements["position"].sigma == pytest.approx(0.02, rel=0.2), trial.name
        assert not any("stamps" in f for f in trial.findings), trial.name
        compass, s = trial.measurements["heading"], trial.states.dropna()
        gap = np.interp(compass.t, s["t"], s["psi"]) - compass.value
        gap = (gap + np.pi) % (2.0 * np.pi) - np.pi
        for part in np.array_split(gap[compass.good], 5):
            assert abs(part.mean()) < 4.0 * 0.006 / np.sqrt(len(part)), trial.name


def test_before_its_first_sample_an_input_counts_as_just_changed():
    """A log may begin in mid-manoeuvre: its first accelerations are no surer than those after a step."""
    value = np.array([0.0, 0.0, 1.0, 1.0, 0.5])
    m = Measurement("rudder", np.arange(5.0), value, 0.0, np.ones(5, bool), held=True)
    t, jump = changes({"rudder": m})
    np.testing.assert_allclose(t, np.arange(5.0))
    np.testing.assert_allclose(jump, [0.625, 0.0, 1.0, 0.0, 0.25])
