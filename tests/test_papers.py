"""The commands of the papers' tables: each runs, and what their ships and methods are is what they say."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from benchmarks.papers import abkowitz, cybership, nomoto, p2
from benchmarks.papers.__main__ import COMMANDS
from benchmarks.papers.container import accelerations, run
from benchmarks.papers.library import free_run, r_squared
from benchmarks.papers.p0 import METHODS, clean, disturbed, fitness, score
from benchmarks.papers.p3 import NUMBERED, OWN, data, methods, numbered, true_numbers
from benchmarks.papers.record import zigzag

HERE = Path(__file__).parents[1] / "benchmarks" / "papers"
QUICK = ("p1_table2", "p2_table4", "p3_table3")
PRINTED_TABLE_2 = {"a1": 0.9972, "a2": -0.0051, "a3": -0.0227, "a6": 2.8218e-5}


def test_every_table_is_run_by_the_command_for_all():
    tables = {p.stem for p in HERE.glob("p?_*.py")}
    assert tables == set(COMMANDS)


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_table_prints_the_papers_numbers_and_ours(name, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [name, "--quick"])
    import_module(f"benchmarks.papers.{name}").main()
    printed = capsys.readouterr().out
    assert "paper" in printed
    assert len(printed.splitlines()) > 6


def test_cybership_has_the_papers_surge_parameters_at_its_step():
    found = true_numbers()
    for name, value in PRINTED_TABLE_2.items():
        assert found[name] == pytest.approx(value, rel=0.02, abs=1e-9)
    assert set(OWN) < set(NUMBERED)


def test_cybership_moves_by_the_coefficients_that_it_says():
    state, delta, n = (0.5, -0.1, 0.2), 0.3, 15.0
    u, v, r = state
    values = {
        "u": u, "|u|u": abs(u) * u, "u³": u**3, "vr": v * r, "r²": r * r, "|n|n": n * n, "|n|u": n * u, "ur": u * r,
        "uv": u * v, "v": v, "|v|v": abs(v) * v, "|r|v": abs(r) * v, "r": r, "|v|r": abs(v) * r, "|r|r": abs(r) * r,
        "|u|uδ": abs(u) * u * delta, "|u|u|δ|δ": abs(u) * u * abs(delta) * delta,
    }  # fmt: skip
    expected = [
        sum(c * values[t] for (d, t), c in cybership.coefficients().items() if d == dof) for dof in "uvr"
    ]
    assert cybership.accelerations(u, v, r, delta, n) == pytest.approx(expected, rel=1e-12)


def test_output_error_gives_cybership_back_where_least_squares_does_not():
    given = data(0.002, 3, 60.0)
    truth = true_numbers()
    errors = {
        name: abs(numbered(method(given, 0))["c10"] / truth["c10"] - 1)
        for name, method in methods((1, 1)).items()
        if name != "ACO as printed"
    }
    assert errors["output error"] < 0.04 < errors["LS"]


def test_the_nomoto_ships_obey_their_equation():
    for ship in nomoto.SHIPS:
        run_of_it = nomoto.voyage(ship, duration=0.1 * ship.duration)
        slope = np.gradient(run_of_it.acceleration, nomoto.STEP)[2:-2]
        assert np.abs(slope - run_of_it.jerk[2:-2]).max() < 5e-3 * np.abs(run_of_it.jerk).max()
        assert nomoto.constants_of(ship.theta) == pytest.approx([ship.T1, ship.T2, ship.T3, ship.K])


def test_one_filter_on_both_sides_gives_the_nomoto_constants_and_the_printed_observer_does_not():
    ship = nomoto.PATROL
    seen = nomoto.voyage(ship, duration=60.0)
    found = {name: nomoto.constants_of(method(ship, seen, 0)) for name, method in p2.methods(1).items()}
    truth = nomoto.constants_of(ship.theta)
    assert found["one filter, RW-LSSVR"] == pytest.approx(truth, rel=2e-3)
    assert found["output error"] == pytest.approx(truth, rel=1e-2)
    assert abs(found["ESO as printed, RW-LSSVR"][1] / truth[1] - 1) > 0.5


def test_the_bound_shrinks_as_the_noise():
    ship = nomoto.PATROL
    seen = nomoto.voyage(ship, duration=60.0)
    assert p2.bound(ship, seen, 2e-3) == pytest.approx(2 * p2.bound(ship, seen, 1e-3), rel=1e-2)


def test_the_container_ship_holds_its_speed_and_turns_with_its_rudder():
    assert np.allclose(accelerations(np.array([8.0, 0, 0, 0, 0, 0]), 0.0, 80 / 60)[1:], 0.0)
    straight = run(lambda t, psi, asked: (0.0, 80 / 60), 400.0, step=2.0, within=1)
    assert straight.states[-1, 0] == pytest.approx(8.0, rel=0.1)
    assert straight.states[-1, 0] == pytest.approx(straight.states[-20, 0], rel=2e-3)
    record = run(zigzag(10.0, 10.0, 80 / 60), 120.0)
    assert record.states[40, 2] > 0.0  # positive rudder, to starboard
    assert 10.0 < np.degrees(record.psi.max()) < 25.0


def test_a_free_run_of_the_library_is_that_of_the_ship_for_the_ships_own_coefficients():
    given = data(0.0, 0, 30.0)
    found = methods((1, 1))["output error"](given, 0)
    shares = r_squared(free_run(found, given.zigzag, cybership.sensed(0.002)), given.zigzag.states)
    assert (shares > 0.9999).all()


def test_the_tankers_methods_are_in_the_order_that_the_bias_gives_them():
    case = clean(20.0, 60.0)
    found = {n: float(fitness(METHODS[n].errors(case, 0))) for n in METHODS if "BEL" not in n}
    assert max(found["LSSVM, b and stamps kept"], found["auto"]) < 0.1 * found["LSSVM as printed"]


def test_a_swarms_search_never_ends_above_the_worst_of_its_range():
    case = disturbed(clean(20.0, 40.0), 0.01, 0)
    found = METHODS["ABEL, U(t)"].errors(case, 0)
    assert found.shape == (3,)
    assert float(fitness(found)) < float(fitness(score(np.zeros(46), case)))


def test_a_model_at_rest_stays_at_its_first_state():
    case = clean(20.0, 40.0)
    still = score(np.zeros(sum(abkowitz.SIZES) + 3), case)
    assert still == pytest.approx(np.mean((case.truth.states - case.truth.states[0]) ** 2, axis=0))
