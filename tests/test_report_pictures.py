"""Pictures that are read as they are meant: names beside each other, marks, nothing drawn twice or hidden."""

import re
from dataclasses import replace

import numpy as np
import pytest

from identify.fit import Estimated
from validate.report.page import report_page, unexplained_rows
from validate.report.parameters import MOST_DRAWN, correlation_figure, most_correlated


def with_many(fit, count):
    """A fit with so many parameters, each of which goes with the next, the first most."""
    coefficients = tuple(Estimated("u", f"X_{k}", 1.0, 0.1, "1") for k in range(count))
    rho = np.eye(count)
    for k in range(0, count - 1, 2):
        rho[k, k + 1] = rho[k + 1, k] = 0.9 - 0.01 * k
    return replace(fit, coefficients=coefficients, effects=(), covariance=rho)


def pitch(svg):
    """Distances of the names of rows, in pixels."""
    rows = re.findall(r'class="small" x="[\d.]+" y="(\d+)" text-anchor="end"', svg)
    return np.diff([int(y) for y in rows])


@pytest.mark.parametrize("count", [2, 19, 20, 27, 60])
def test_names_beside_a_heat_map_have_room_for_a_line_at_any_count(example, count):
    figure = correlation_figure(with_many(example.after, count))
    assert len(pitch(figure.svg)) == min(count, MOST_DRAWN) - 1
    assert pitch(figure.svg).min() >= 12
    assert (f"of {count} parameters that go most with another" in figure.caption) == (count > MOST_DRAWN)


def test_of_many_parameters_those_are_drawn_that_go_most_with_another():
    rho = np.eye(30)
    rho[3, 29] = rho[29, 3] = -0.99
    rho[5, 6] = rho[6, 5] = np.nan
    kept = most_correlated(rho)
    assert {3, 29} <= set(kept.tolist())
    assert len(kept) == MOST_DRAWN
    assert (np.diff(kept) > 0).all()


def test_what_is_material_is_marked_in_its_place_and_colour(example):
    found = replace(example.diagnosis, unexplained={"u": 0.19, "v": 0.063, "r": 0.0})
    page = report_page(replace(example, diagnosis=found))
    part = page[page.index('id="lacks"') : page.index('id="read"')]
    assert part.count('class="bar material"') == 1
    assert part.count(">material</td>") == 1
    assert re.findall(r'class="mark" style="left:([\d.]+)%', part) == ["33.3"] * 3
    assert re.findall(r'class="bar[^"]*" style="width:([\d.]+)%', part) == ["63.3", "21.0", "0.0"]
    other = report_page(replace(example, diagnosis=replace(found, materiality=0.05)))
    assert "material above 5 %" in other
    assert other.count('class="bar material"') == 2


def test_a_share_far_above_what_is_material_fills_its_bar():
    rows = unexplained_rows({"u": 2.07, "v": 0.5, "r": float("nan")}, 0.1)
    assert [(bar, material) for _, _, bar, material in rows] == [(100.0, True), (50.0, True), (0.0, False)]


def test_no_plot_stands_twice_on_the_page(example_page):
    captions = re.findall(r'aria-label="([^"]* of logs/random2.nmea[^"]*)"', example_page)
    shown = re.findall(r'<svg role="img" aria-label="([^"]*)"', example_page)
    assert len(shown) == len(set(shown))
    assert captions
    section = example_page[example_page.index('id="plots"') :]
    assert section.index('stand <a href="#answer">at the top</a>') < section.index("heading of")


def test_raw_samples_lie_above_the_smoothed_line_and_below_the_predictions(example_page):
    answer = example_page[example_page.index('class="tiles top"') : example_page.index('id="lacks"')]
    for svg in re.findall(r"<svg.*?</svg>", answer, re.S):
        order = [
            c for c in re.findall(r'<path class="(\w+)"', svg) if c in ("smooth", "raw", "before", "after")
        ]
        assert order[0] == "smooth"
        assert "raw" not in order or order.index("raw") == 1
        assert {"before", "after"} <= set(order[1:])
