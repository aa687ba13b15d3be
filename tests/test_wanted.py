"""What the accelerations want is refitted, though no step from a fit that makes up for it promises anything."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.fitted import FAR, NEAR
from validate import finalists as module
from validate.candidates import Screened
from validate.finalists import MUCH, WANTED, WORTH, finalists

GAINS = {"walk": 0.0, "asymmetry": 0.7, "clock": 0.3, "play": 0.2, "lag": 0.5 * MUCH}


def chosen(monkeypatch, chi2, antenna, converges=True, swinging=None, lost=False, slow=False):
    """Finalists where an antenna promises much, of which the accelerations want so much, and others nothing."""
    nothing, gains = np.zeros(1), GAINS | {"antenna": antenna}
    promising = SimpleNamespace(label="antenna", slots=(), actives=())
    first = Screened(promising, nothing, nothing, 3000.0)
    others = [
        Screened(SimpleNamespace(label=name, slots=(), actives=()), nothing, nothing, -5000.0)
        for name in GAINS
    ]
    fitted = SimpleNamespace(
        chi2_per_dof=chi2, is_off=slow or chi2 > NEAR, problem=SimpleNamespace(stretches=()),
        solution=SimpleNamespace(structure=SimpleNamespace(with_effect=lambda active: active)),
    )  # fmt: skip
    monkeypatch.setattr(module, "astray", lambda _: False)
    monkeypatch.setattr(module, "converges", lambda _: converges)
    monkeypatch.setattr(module, "is_lost", lambda _: lost)
    monkeypatch.setattr(module, "swings", lambda active: active.label == swinging)
    monkeypatch.setattr(module, "gain_and_value", lambda active, *_: (gains[active.label], nothing))
    return finalists(fitted, [first, *others], thorough=False)


@pytest.mark.parametrize("chi2", [1.1, 1.25])
def test_off_the_noise_those_that_the_accelerations_want_most_are_refitted_besides(monkeypatch, chi2):
    found = chosen(monkeypatch, chi2, 0.0)
    besides = ["asymmetry", "clock"][:WANTED] if chi2 > NEAR else []
    assert [s.active.label for s in found] == ["antenna", *besides]
    assert [s.wanted is not None for s in found] == [False] + [True] * len(besides)


def test_what_is_wanted_most_is_refitted_besides_where_slow_errors_alone_are_off_the_noise(monkeypatch):
    """A rudder that is slow in a rich model: no start of it survives, and many samples hide how far off it is."""
    found = chosen(monkeypatch, 1.09, 0.0, slow=True)
    assert [s.active.label for s in found] == ["antenna", "asymmetry", "clock"][: 1 + WANTED]
    assert [s.wanted is not None for s in found] == [False] + [True] * WANTED


@pytest.mark.parametrize(("gain", "begins"), [(0.9 * WORTH, False), (1.1 * WORTH, True)])
def test_near_the_noise_what_promises_begins_where_the_accelerations_want_it(monkeypatch, gain, begins):
    (found,) = chosen(monkeypatch, 1.05, gain)
    assert (found.wanted is not None) is begins


def test_where_no_refit_converges_only_what_is_wanted_most_and_clearly_leads(monkeypatch):
    found = chosen(monkeypatch, 1.25, 0.0, converges=False)
    assert [s.active.label for s in found if s.leads] == ["asymmetry"]
    assert all(s.wanted is not None for s in found)
    assert not any(s.leads for s in chosen(monkeypatch, 1.25, 0.0))


def test_far_from_the_noise_the_few_lead_that_are_wanted_most(monkeypatch):
    found = chosen(monkeypatch, 2.0 * FAR, 0.6, converges=False)
    assert [s.active.label for s in found if s.leads] == ["antenna", "asymmetry"]
    monkeypatch.setitem(GAINS, "clock", 0.65)
    found = chosen(monkeypatch, 2.0 * FAR, 0.6, converges=False)
    assert [s.active.label for s in found if s.leads] == ["asymmetry", "clock"]
    found = chosen(monkeypatch, 1.25, 0.68, converges=False, lost=True)
    assert [s.active.label for s in found if s.leads] == ["antenna", "asymmetry"]


def test_what_swings_leads_only_near_the_noise(monkeypatch):
    """Far from it, or from a base that is lost, fitted from scratch, it follows whatever is missing."""
    far, near = (chosen(monkeypatch, x, 0.6, False, "antenna") for x in (2.0 * FAR, 1.25))
    lost = chosen(monkeypatch, 1.25, 0.6, False, "antenna", lost=True)
    for found in (far, lost):
        assert [s.active.label for s in found if s.leads] == ["asymmetry"]
    assert [s.active.label for s in near if s.leads] == ["antenna", "asymmetry"]
