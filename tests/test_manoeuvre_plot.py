"""The picture of simulated manoeuvres: units, scales, what was ordered, and what is measured where."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_simulate import blanke
from test_simulate_range import catamaran

from identify.simulate import simulate
from seatrial.manoeuvre_plot import plot_manoeuvres


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """Draw one manoeuvre of a fit: what was sailed, and the axes, those of the second scales last."""
    from matplotlib.figure import Figure

    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda self, _: figures.append(self))

    def draw(fit, words):
        sailed = simulate(fit, words)
        plot_manoeuvres([sailed], fit, tmp_path / "a.png")
        return sailed, figures[-1].axes

    return draw


def lines(axes):
    """Every line with a name, and its values."""
    return {line.get_label(): line.get_ydata() for line in axes.lines if line.get_label()[0] != "_"}


def texts(axes):
    return [t.get_text() for t in axes.texts]


def test_the_yaw_rate_has_its_own_scale_in_degrees(drawn):
    sailed, (*_, speeds, yaw) = drawn(blanke(), "zigzag 20/20")
    assert list(lines(speeds)) == ["u, m/s", "v, m/s"]
    assert lines(yaw)["r, °/s"] == pytest.approx(np.degrees(sailed.states[:, 5]))
    assert [t.get_text() for t in speeds.get_legend().get_texts()] == ["u, m/s", "v, m/s", "r, °/s"]


def test_a_circle_shows_its_helm_with_its_unit_by_a_scale_that_begins_at_nothing(drawn):
    _, axes = drawn(blanke(), "circle 35")
    (helm,) = (a for a in axes if "rudder, °" in lines(a))
    assert "heading, °" not in lines(helm)
    assert np.abs(lines(helm)["rudder, °"]) == pytest.approx(np.full(len(lines(helm)["rudder, °"]), 35.0))
    low, high = helm.get_ylim()
    assert low < 0.0 < high


def test_the_helm_of_a_zigzag_is_by_the_scale_of_its_heading(drawn):
    _, axes = drawn(blanke(), "zigzag 10/10")
    assert list(lines(axes[1])) == ["heading, °", "rudder, °"]


def test_commands_that_are_shares_are_no_angles(drawn):
    sailed, axes = drawn(catamaran(), "circle 35")
    (helm,) = (a for a in axes if "left" in lines(a))
    assert lines(helm)["left"] == pytest.approx(sailed.inputs["left"])
    assert lines(helm)["left"].max() == 1.0


def test_a_stop_shows_what_pushes(drawn):
    _, axes = drawn(blanke(), "stopping")
    assert [n for a in axes for n in lines(a) if n.startswith("n, rev/s")]
    assert not [n for a in axes for n in lines(a) if n.startswith("rudder")]


@pytest.mark.parametrize("side", ["starboard", "port"])
def test_overshoots_are_marked_at_their_peaks(drawn, side):
    sailed, axes = drawn(blanke(), f"zigzag 20/20 {side}")
    angles = [math.degrees(sailed[n].value) for n in ("first_overshoot", "second_overshoot")]
    assert texts(axes[1]) == [f"{a:.3g}°" for a in angles]
    places = np.array([t.xy for t in axes[1].texts])
    sign = sailed.order.side
    assert places[:, 1] == pytest.approx([sign * (20.0 + angles[0]), -sign * (20.0 + angles[1])])
    first, second = (sailed[f"{n}_execute_time"].value for n in ("first", "second"))
    assert first < places[0, 0] < second < places[1, 0] < second + sailed["period"].value


def test_a_circle_has_its_measures_where_they_are(drawn):
    fit = blanke()
    sailed, axes = drawn(fit, "circle 35 port")
    said = {
        n: f"{n.replace('_', ' ')} {sailed[n].value / fit.vessel.length:.3g} L"
        for n in ("advance", "tactical_diameter")
    }
    assert texts(axes[0]) == list(said.values())


def test_what_was_not_reached_is_not_marked(drawn):
    sailed, axes = drawn(blanke(), "circle 0.1")
    assert math.isnan(sailed["tactical_diameter"].value)
    assert texts(axes[0]) == []


@pytest.mark.parametrize("words", ["zigzag 10/10", "circle 35", "stopping"])
def test_a_track_fills_its_panel(drawn, words):
    """A zigzag goes many lengths ahead and hardly one aside: by one scale for both it is a line."""
    sailed, axes = drawn(blanke(), words)
    (track,) = (
        line for line in axes[0].lines if len(line.get_xdata()) == len(sailed.t) and line.get_lw() > 1.0
    )
    shares = [
        np.ptp(values) / abs(np.subtract(*limits))
        for values, limits in (
            (track.get_xdata(), axes[0].get_xlim()),
            (track.get_ydata(), axes[0].get_ylim()),
        )
    ]
    assert max(shares) > 0.5
    assert min(shares) > (0.5 if words != "stopping" else -1.0)
    assert (axes[0].get_aspect() == 1.0) == (words == "circle 35")


def test_starboard_is_below_where_the_bow_is_to_the_right(drawn):
    for words in ("zigzag 10/10 starboard", "zigzag 10/10 port"):
        _, axes = drawn(blanke(), words)
        assert axes[0].get_xlabel() == "ahead, lengths"
        assert axes[0].yaxis_inverted()
