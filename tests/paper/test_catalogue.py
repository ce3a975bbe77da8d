"""The records: every id resolves, every claim has its figure, every setup is the paper's."""

import pytest

from echobeam.faults import InputError
from echobeam.reproduction.catalogue import CLAIMS, FIGURES, choose
from echobeam.reproduction.run import setups_of
from echobeam.reproduction.setups import VARIATIONS, height, long, multi, single, varied
from echobeam.schemes.registry import find_scheme

PAPER = ["approx", "t1", "test2-1", "test2-2", "t3", "t4", "t5", "t6", "t7-1", "t7-2", "aa_acr"]


def test_every_result_figure_of_the_paper_is_there_in_its_order():
    assert list(FIGURES) == [*PAPER, "sensitivity"]
    assert all(figure.caption for figure in FIGURES.values())


@pytest.mark.parametrize("name", FIGURES)
def test_every_id_resolves_to_scenarios_that_load(name):
    (figure,) = choose([name])
    assert figure.id == name
    for setup in figure.points:
        point = setup.point(20)
        assert point.trials >= 2
        assert all(find_scheme(scheme).name == scheme for scheme in point.schemes)


def test_unknown_ids_are_refused_with_those_there_are():
    with pytest.raises(InputError, match=r"t9, fig1; there are approx, t1"):
        choose(["t1", "t9", "fig1"])


def test_every_claim_belongs_to_a_figure_and_has_a_name_of_its_own():
    assert {claim.figure for claim in CLAIMS} == set(PAPER)
    assert len({claim.id for claim in CLAIMS}) == len(CLAIMS)
    for claim in CLAIMS:
        assert claim.text
        assert claim.reading
        assert claim.judge.text


def test_setups_of_one_name_are_one_setup():
    setups = [setup for figure in FIGURES.values() for setup in figure.points]
    for setup in setups:
        assert [other for other in setups if other.name == setup.name and other != setup] == []
    assert len(setups_of(list(FIGURES.values()))) == len({setup.name for setup in setups})


@pytest.mark.parametrize("base", [multi(), single(), long(), height(100)], ids=lambda s: s.name)
def test_a_variation_changes_what_it_says_and_nothing_else(base):
    default = base.scenario().model_dump()
    floor = default["coverage"]["min_rate"]
    for variation in (one for one in VARIATIONS if one.touches(base)):
        setup = varied(base, variation)
        changed = setup.scenario().model_dump()
        different = {
            f"{table}.{key}": changed[table][key]
            for table, values in default.items()
            if isinstance(values, dict)
            for key, value in values.items()
            if changed[table][key] != value
        }
        expected = dict(variation.overrides)
        if variation.power != 1.0:
            expected["radio.power"] = variation.power
            if floor:
                expected["coverage.min_rate"] = pytest.approx(variation.power * floor)
        assert different == expected, variation.label
        others = [one for one in setup.schemes if one not in base.schemes]
        assert others == list(variation.stands_in.values())
        assert (setup.keep, setup.point(200).trials) == (base.keep, 60 if floor else 200)


def test_a_variation_touches_setups_in_which_it_changes_something():
    touched = {
        base.name: {one.label for one in VARIATIONS if one.touches(base)}
        for base in (multi(), single(), height(100))
    }
    floored = {
        "fewer trials",
        "min_rate 0",
        "min_rate 1e-4",
        "min_rate 2e-4",
        "exact CRB with min_rate 0",
    }
    assert touched["multi-n30"] == {one.label for one in VARIATIONS}
    assert touched["single-n30"] == touched["multi-n30"] - floored
    assert touched["height-100"] == touched["single-n30"] - {"pilot held on a needle beam"}


def test_arrays_of_another_size_keep_the_ripple_in_proportion():
    for n in (40, 50):
        scenario = multi(n).scenario()
        assert (scenario.array.n_tx, scenario.array.receivers) == (n, n)
        assert scenario.ripple == pytest.approx(0.1 * n)
    assert single(30).scenario().ripple == 3.0
