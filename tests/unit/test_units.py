import math

import pytest

from echobeam.units import UNITS, QuantityError, parse_quantity


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("80 m", "length", 80.0),
        ("80m", "length", 80.0),
        (" 0.1 km ", "length", 100.0),
        ("-90 deg", "angle", -math.pi / 2),
        ("30 GHz", "frequency", 30e9),
        ("0.01 ms", "time", 1e-5),
        ("54 km/h", "speed", 15.0),
        ("-5 m/s^2", "acceleration", -5.0),
        ("4e-4 bit/s/Hz", "rate", 4e-4),
        ("1e3", "number", 1000.0),
        (7, "length", 7.0),
    ],
)
def test_a_quantity_is_read_in_si(text, kind, value):
    assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "kind", "word"),
    [
        ("80 kg", "length", "unknown unit 'kg'"),
        ("80 m", "angle", "rad"),
        ("fast", "speed", "not a number"),
        ("", "speed", "not a number"),
        ("nan", "speed", "not a number"),
        (math.nan, "speed", "not finite"),
        (math.inf, "speed", "not finite"),
        ("1e999 m", "length", "not finite"),
        (True, "length", "not a quantity"),
        (None, "length", "not a quantity"),
        ([1], "length", "not a quantity"),
        ("5 m/s", "number", "unknown unit"),
    ],
)
def test_what_is_no_quantity_says_what_would_be(text, kind, word):
    with pytest.raises(QuantityError, match=r"expected") as caught:
        parse_quantity(text, kind)
    assert word in str(caught.value)


@pytest.mark.parametrize("text", ["100,5 m", "100,5", "-1,000 m"])
def test_a_decimal_comma_is_named(text):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, "length")
    assert str(caught.value) == f"{text!r} is no number; decimals take a point"


@pytest.mark.parametrize(
    ("text", "watts"),
    [
        ("30 dBm", "1 W"), ("30 dbm", "1 W"), ("0dBW", "1 W"), ("-10 dBW", "0.1 W"),
        ("20 mW", "0.02 W"), ("3 W", "3 W"), ("1e9 dBm", "inf W"),
    ],
)  # fmt: skip
def test_a_power_in_watts_is_explained(text, watts):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, "number")
    message = str(caught.value)
    assert message.startswith(
        f"{text!r} is a power of {watts}; expected a plain number: radio.power, "
    )
    assert "echobeam describe" in message


@pytest.mark.parametrize(("text", "ratio"), [("3 dB", "1.9953"), ("-3dB", "0.50119"), ("0 dBi", 1)])
def test_a_ratio_in_decibels_is_given_as_it_would_be_written(text, ratio):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, "number")
    message = f"{text!r} is a ratio of {ratio} in power; expected a plain number: powers and gains "
    message += "are linear"
    assert str(caught.value) == message


def test_a_level_of_what_is_no_power_is_an_unknown_unit():
    with pytest.raises(QuantityError, match=r"unknown unit 'dBm' in '30 dBm'; expected .* in m"):
        parse_quantity("30 dBm", "length")


def test_every_kind_counts_its_si_unit_as_one():
    for units in UNITS.values():
        assert not units or 1.0 in units.values()
