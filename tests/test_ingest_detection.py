"""Which columns are position, heading and the rest, the better sensor first; and the units they are in."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ingest_tables import table

from ingest.detect import Rule, detect, quality_mask, stated_sigma
from ingest.units import UnknownUnit, factor_to_si


@pytest.mark.parametrize(
    ("unit", "scale"),
    [
        ("deg", np.pi / 180), ("cdeg", np.pi / 18_000), ("degE7", np.pi / 1.8e9), ("rad", 1.0),
        ("mrad/s", 1e-3),
        ("deg/s", np.pi / 180), ("kn", 1852 / 3600), ("km/h", 1 / 3.6), ("m/s/s", 1.0), ("cm/s", 0.01),
        ("m/s^2", 1.0),
        ("rpm", 1 / 60), ("rev/s", 1.0), ("percent", 0.01), ("%", 0.01), ("kN", 1e3), ("Nm", 1.0),
        ("ft", 0.3048),
        ("kg.m²", 1.0), ("us", 1e-6), ("µs", 1e-6), ("ms", 1e-3), ("min", 60.0), ("1/s", 1.0),
        ("hPa", 100.0), ("mm", 1e-3),
        ("rad/s", 1.0), ("deg/min", np.pi / 10_800), ("nmi", 1852.0), ("dm/s", 0.1),
    ],
)  # fmt: skip
def test_factor_to_si(unit, scale):
    assert factor_to_si(unit) == (pytest.approx(scale, rel=1e-12), 0.0)


def test_temperature_has_an_offset():
    scale, offset = factor_to_si("cdegC")
    assert scale * 2_000 + offset == pytest.approx(293.15)


def test_unknown_unit_names_the_nearest():
    with pytest.raises(UnknownUnit, match="knots"):
        factor_to_si("knotz")


PARTS = st.lists(
    st.sampled_from(["m", "km", "s", "min", "h", "deg", "mrad", "rev", "kN", "kg", "m²", "s^2", "%"]),
    min_size=1,
    max_size=3,
)


@given(PARTS.map("/".join) | PARTS.map(".".join))
def test_units_multiply_and_divide(text):
    factors = [factor_to_si(part)[0] for part in re.split(r"[/.]", text)]
    first, rest = factors[0], np.prod(factors[1:])
    assert factor_to_si(text) == (pytest.approx(first / rest if "/" in text else first * rest), 0.0)


@given(st.text(max_size=12))
def test_any_text_is_a_unit_or_not(text):
    try:
        scale, offset = factor_to_si(text)
    except UnknownUnit as error:
        assert repr(text)[1:-1] in str(error) or text in str(error)
        return
    assert np.isfinite(offset)
    assert scale > 0 or not np.isfinite(scale)


POSITION = Rule(
    "position", r"GPS(\[\d\])?", {"latitude": "lat", "longitude": "lon"}, "deg",
    options={"quality": "fix", "quality_min": 3, "satellites": "sats", "hdop": "hdop", "hdop_scale": 0.01},
)  # fmt: skip


def gps(n: int = 20, **more) -> pd.DataFrame:
    return table(np.arange(n) * 0.2, **({"lat": np.linspace(63, 63.1, n), "lon": np.full(n, 10.0)} | more))


def test_rule_holds():
    (source,) = detect([POSITION], {"GPS": gps(fix=np.full(20, 4)), "GPSX": gps()})
    assert (source.topic, source.device, source.unit) == ("GPS", None, "deg")
    assert source.options == {"quality": "fix", "quality_min": 3}


def test_placeholders_are_no_source():
    zero = np.zeros(20)
    assert not detect([POSITION], {"GPS": gps(lat=zero, lon=zero)})
    assert not detect([POSITION], {"GPS": gps(lat=np.full(20, np.nan))})
    assert not detect([POSITION], {"GPS": gps(fix=np.ones(20))})
    assert not detect([POSITION], {"GPS": gps(lat=["north"] * 20)})
    wind = Rule("wind", "W", {"speed": "s", "direction": "d"}, "deg")
    assert not detect([wind], {"W": table(np.arange(9), s=np.zeros(9), d=np.zeros(9))})


def test_a_rudder_may_be_amidships():
    rudder = Rule("rudder", "R", {"value": "angle"}, "deg")
    assert detect([rudder], {"R": table(np.arange(9), angle=np.zeros(9))})


def test_one_source_per_device_best_first():
    short, long = gps(5, source=np.full(5, 1)), gps(50, source=np.full(50, 2))
    both = pd.concat([short, long]).sort_index(kind="stable")
    sources = detect([POSITION], {"GPS": both})
    assert [s.device for s in sources] == [2, 1]
    assert "source 2" in sources[0].name


def test_a_direct_measurement_beats_a_filter():
    filtered = Rule("position", "POS", {"latitude": "lat", "longitude": "lon"}, "deg", rank=40)
    sources = detect([filtered, POSITION], {"POS": gps(200), "GPS": gps(20)})
    assert [s.topic for s in sources] == ["GPS", "POS"]


def test_the_more_precise_of_two_receivers_is_chosen():
    rule = replace(POSITION, options={**POSITION.options, "fixes": {3: 2.5, 4: 0.02}})
    plain, fixed = (
        gps(fix=np.full(20, 3), hdop=np.full(20, 90)),
        gps(fix=np.full(20, 4), hdop=np.full(20, 90)),
    )
    sources = detect([rule], {"GPS": plain, "GPS[1]": fixed})
    assert [s.topic for s in sources] == ["GPS[1]", "GPS"]
    assert sources[0].rank - sources[1].rank == pytest.approx(4.0, abs=0.3)


def test_a_stated_accuracy_orders_receivers_and_is_a_sigma():
    rule = replace(POSITION, options={"accuracy": "var", "accuracy_power": 0.5, "accuracy_scale": 10.0})
    good, poor = gps(var=np.full(20, 1e-6)), gps(var=np.r_[0.0, -1.0, np.nan, np.full(17, 4.0)])
    first, second = detect([rule], {"GPS": poor, "GPS[1]": good})
    assert (first.topic, second.topic) == ("GPS[1]", "GPS")
    sigma = stated_sigma(second.options, poor)
    assert np.isnan(sigma[:3]).all() and sigma[3:].tolist() == [20.0] * 17
    assert stated_sigma(detect([rule], {"GPS": gps()})[0].options, gps()) is None
    assert "accuracy_power" not in detect([rule], {"GPS": gps(var=np.zeros(20))})[0].options


def test_precision_never_lifts_a_filter_above_a_measurement():
    filtered = Rule(
        "position", "POS", {"latitude": "lat", "longitude": "lon"}, "deg", 40, {"accuracy": "acc"}
    )
    rule = replace(POSITION, options={"accuracy": "acc"})
    tables = {"POS": gps(acc=np.full(20, 1e-6)), "GPS": gps(acc=np.full(20, 1e3))}
    assert [s.topic for s in detect([filtered, rule], tables)] == ["GPS", "POS"]


def test_what_the_receiver_calls_bad_is_masked():
    rows = gps(6, fix=[4, 4, 4, 4, 1, 4], sats=[9, 2, 0, 9, 9, 9], hdop=[90, 90, 90, 9999, 90, np.nan])
    assert quality_mask(POSITION.options, rows).tolist() == [True, False, True, False, False, True]
