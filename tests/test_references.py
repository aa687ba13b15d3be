"""References in full: every source that is named is in the one table, and a report gives those of its run."""

import re

import pytest

from identify.effects import EFFECTS
from identify.estimators import ESTIMATORS
from identify.models import MODELS
from identify.references import OUTPUT_ERROR, REFERENCES, SMOOTHER, in_full

#: Experience, not papers.
NO_PAPERS = {"field practice", "measured on electric vessels without speed control"}


@pytest.mark.parametrize(
    "source",
    [*(x.source for x in (*MODELS, *EFFECTS, *ESTIMATORS.values())), SMOOTHER, OUTPUT_ERROR],
)
def test_every_source_is_in_the_table(source):
    for part in filter(None, source.split("; ")):
        assert part in NO_PAPERS or any(part.startswith(key) for key in REFERENCES)


def test_a_reference_is_given_once_with_all_its_places():
    found = in_full(
        ["Fossen 2011, sec. 7.3", "Fossen 2011, sec. 8.3; IMO MSC/Circ.1053, 3.4.2.5", "field practice"]
    )
    assert len(found) == 2
    assert found[0] == (
        "Fossen, T. I., Handbook of Marine Craft Hydrodynamics and Motion Control. Wiley, 2011 (sec. 7.3; sec. 8.3)."
    )
    assert found[1].endswith("MSC/Circ.1053, 2002 (3.4.2.5).")
    assert in_full(["Karaboga 2005"]) == ("Karaboga 2005.",)


def test_every_reference_has_its_year_or_number():
    assert all(re.search(r"\d{4}$|\d$", text) for text in REFERENCES.values())
