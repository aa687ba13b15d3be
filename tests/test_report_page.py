"""report.html: one page, whole, escaped, accessible."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np

from benchmarks.results_example import example_results
from validate.report.markdown import report_markdown
from validate.report.page import report_page


class Outline(HTMLParser):
    """Collects headings, ids, links and the attributes of every SVG."""

    def __init__(self):
        super().__init__()
        self.headings, self.ids, self.links, self.pictures, self.tags = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append(tag)
        if re.fullmatch(r"h\d", tag):
            self.headings.append(int(tag[1]))
        if "id" in found:
            self.ids.append(found["id"])
        if tag == "a":
            self.links.append(found["href"])
        if tag == "svg":
            self.pictures.append(found)


def outline(page):
    parser = Outline()
    parser.feed(page)
    return parser


def test_the_page_needs_nothing_from_outside(example_page):
    assert not re.search(r"https?://", example_page)
    assert {"script", "img", "iframe", "object"}.isdisjoint(outline(example_page).tags)
    assert len(example_page) < 1_000_000


def test_headings_descend_in_order_and_ids_are_unique(example_page):
    found = outline(example_page)
    assert found.headings[0] == 1
    assert found.headings.count(1) == 1
    assert all(b - a <= 1 for a, b in zip(found.headings, found.headings[1:], strict=False))
    assert len(found.ids) == len(set(found.ids))
    inner = {link[1:] for link in found.links if link.startswith("#")}
    assert inner <= set(found.ids)
    assert "recording.rrd" in found.links


def test_every_picture_says_what_it_shows(example_page):
    pictures = outline(example_page).pictures
    assert len(pictures) > 20
    assert all(
        p.get("aria-hidden") == "true" or (p.get("role") == "img" and p["aria-label"]) for p in pictures
    )


def test_every_picture_is_well_formed(example_page):
    for svg in re.findall(r"<svg.*?</svg>", example_page, re.S):
        ET.fromstring(svg)
    assert "nan" not in " ".join(re.findall(r' d="([^"]*)"', example_page))


def test_names_from_outside_are_escaped(example):
    vessel = replace(example.after.vessel, name="<script>alert(1)</script>")
    assert "<script>" not in report_page(replace(example, after=replace(example.after, vessel=vessel)))


def test_the_page_says_what_was_found_and_what_was_wrong(example_page):
    for words in (
        "a current of 0.178",
        "wind would look the same",
        "checksum does not match",
        "reciprocal heading",
        "Blanke, M. (1981)",
        "the data give it only to 60 %",
    ):
        assert words in example_page


def test_of_two_candidates_of_one_name_only_the_better_was_taken(example):
    first = example.diagnosis.rounds[0]
    names = [("left", 10.0), ("right", 20.0), *((None, float(-k)) for k in range(18))]
    tried = tuple(replace(first.candidates[0], input=name, evidence=gain) for name, gain in names)
    found = replace(example.diagnosis, rounds=(replace(first, candidates=tried),))
    page = report_page(replace(example, diagnosis=found))
    assert page.count("✓ taken") == 1
    assert "current (right) ✓ taken" in page
    assert "8 more candidates" in page


def test_without_the_loop_the_page_has_no_before():
    page = report_page(example_results(logs=2, duration=10.0, loop=False))
    assert "switched off" in page
    assert 'class="before"' not in page


def contrast(first, second):
    """WCAG 2 contrast ratio of two #rrggbb colours."""

    def luminance(colour):
        colour = colour * 2 if len(colour) == 3 else colour
        parts = np.array([int(colour[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ [
            0.2126,
            0.7152,
            0.0722,
        ]

    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_text_and_lines_have_enough_contrast_in_light_and_dark(example_page):
    blocks = re.findall(r":root \{([^}]*)\}", example_page)
    assert len(blocks) == 3
    for block in blocks:
        colours = dict(re.findall(r"--(\w+): #(\w+)", block))
        for ground in ("paper", "panel"):
            for text in ("ink", "muted", "before", "after", "bad", "good", "warn"):
                assert contrast(colours[text], colours[ground]) >= 4.5, (text, ground)


def test_what_is_noticed_of_the_logs_together_is_not_said_of_one(example):
    first = replace(example.trials[0], findings=("The logs to identify on: one speed.", "A gap."))
    page = report_page(replace(example, trials=(first, *example.trials[1:])))
    together, one = page.index("The logs to identify on"), page.index("<strong>logs/zigzag0.nmea</strong>")
    assert page.index("<strong>All logs</strong>") < together < one < page.index("A gap.")


def test_what_differs_between_several_logs_in_numbers_alone_is_said_once(example):
    trials = tuple(
        replace(t, findings=(f"The errors wander ({k}.5 m).", f"zigzag {k}0."))
        for k, t in enumerate(example.trials)
    )
    page = report_page(replace(example, trials=trials))
    assert page.count("The errors wander") == 1
    assert "logs/zigzag0.nmea: The errors wander (0.5 m). The like in 3 more." in page
    assert page.count("<li>zigzag") == 4


def test_the_first_figures_show_the_yaw_rate_and_have_their_key(example_page):
    answer = example_page[example_page.index('id="answer"') : example_page.index('id="lacks"')]
    assert [c.split(",")[0] for c in re.findall(r"<figcaption>(.*?)</figcaption>", answer)] == [
        "Track",
        "u",
        "v",
        "r",
    ]
    for words in ("set aside", "noise and first state", "goes on beyond the axis", "vessel, to scale"):
        assert words in answer
        assert example_page.count(words) >= 2


def test_errors_are_called_statistical_where_they_stand(example, example_page):
    words = "± is the statistical standard error"
    assert example_page.count(words) == 2  # beside the effects, and the parameters
    assert words in report_markdown(example)
