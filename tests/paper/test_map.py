"""The sensitivity map on results made up so that the answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from echobeam.reproduction import mapping
from echobeam.reproduction.catalogue import CLAIMS as ALL
from echobeam.reproduction.catalogue import FIGURES
from echobeam.reproduction.mapping import entries
from echobeam.reproduction.records import Entry, Estimate, Finding, Measured
from echobeam.reproduction.report import document, gathered, page
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import VARIATIONS, Setup, headline, long, multi, single, varied

TRIALS = 30
SINGLE = headline("paper-single")
CLAIMS = {claim.id: claim for claim in ALL}
BY_LABEL = {variation.label: variation for variation in VARIATIONS}
FLOORED = {
    "fewer trials",
    "min_rate 0",
    "min_rate 1e-4",
    "min_rate 2e-4",
    "exact CRB with min_rate 0",
}
NEEDLE = "pilot held on a needle beam"
RATES = {"temporal": 2.0, "pilot": 1.0, "pilot-needle": 1.0, "posterior": 3.0, "genie": 4.0}


def made_up(setup: Setup, rates=RATES, fallback: dict[str, float] | None = None) -> Outcome:
    """Return trials whose sum rate is a scheme's value, up to a little luck that trials share."""
    luck = 1 + 0.01 * np.random.default_rng(5).normal(size=TRIALS)
    slots = setup.scenario().n_slots
    sums = np.array([np.tile(rates[name] * luck[:, None], slots) for name in setup.schemes])
    shares = [(fallback or {}).get(name, 0.0) for name in setup.schemes]
    counts = np.array(shares)[:, None] * slots * 0.9 * np.ones(TRIALS)
    return Outcome(setup.point(TRIALS), {"sum_rate": sums, "fallback": counts}, {})


def all_of(*bases: Setup, changed: tuple[Outcome, ...] = ()) -> Results:
    """Return alike results of some setups and of all that is made of them, but a few."""
    setups = [
        *bases,
        *(varied(base, one) for base in bases for one in VARIATIONS if one.touches(base)),
    ]
    outcomes = {setup.name: made_up(setup) for setup in setups}
    assert {one.point.name for one in changed} <= set(outcomes)
    outcomes |= {one.point.name: one for one in changed}
    return Results(list(outcomes.values()), TRIALS, 0)


def mapped(claim: str, results: Results) -> dict[str, str]:
    """Return the map's row of a claim: judgement by reading."""
    found = entries(results, [CLAIMS[claim]])
    assert len({one.reading for one in found}) == len(found)
    return {one.reading: one.judgement for one in found}


def test_every_claim_of_the_mapped_figures_is_mapped_and_its_setups_are_run():
    assert [figure.id for figure in mapping.FIGURES] == ["t1", "test2-1", "t6", "t7-1", "t7-2"]
    run = {setup.name for setup in FIGURES["sensitivity"].points}
    for figure in mapping.FIGURES:
        for setup in figure.points:
            wanted = {varied(setup, one).name for one in VARIATIONS if one.touches(setup)}
            assert {setup.name, *wanted} <= run
    assert {claim.id for claim in mapping.CLAIMS} == {
        claim.id for claim in ALL if claim.figure in {one.id for one in mapping.FIGURES}
    }


def test_a_verdict_that_one_reading_flips_is_another_there_and_nowhere_else():
    worse = made_up(varied(single(), BY_LABEL["P_T = 2"]), {"temporal": 0.5, "pilot": 1.0})
    found = mapped("outperforms-pilot", all_of(multi(), single(), changed=(worse,)))
    assert found.pop("P_T = 2") == "in part"
    assert set(found) == {"default reading", *BY_LABEL} - {"P_T = 2"}
    assert set(found.values()) == {"reproduced"}


def test_the_claims_own_measure_is_applied():
    doubled = made_up(varied(SINGLE, BY_LABEL["ripple 1"]), {"temporal": 3.0, "pilot": 1.0})
    found = entries(all_of(SINGLE, changed=(doubled,)), [CLAIMS["single-improvement"]])
    ours = {one.reading: one.finding.measured.headline.value for one in found}
    assert ours["ripple 1"] == pytest.approx(200.0)
    assert ours["default reading"] == ours["P_T = 2"] == pytest.approx(100.0)
    assert {one.finding.claim for one in found} == {CLAIMS["single-improvement"]}


def test_what_stands_in_for_a_scheme_is_measured_under_its_name():
    needle = made_up(varied(SINGLE, BY_LABEL[NEEDLE]), RATES | {"pilot-needle": 9.0})
    assert needle.point.schemes == ("temporal", "pilot-needle")
    found = mapped("single-improvement", all_of(SINGLE, changed=(needle,)))
    assert found[NEEDLE] == "not reproduced"
    assert found["default reading"] == "in part"


def test_readings_that_do_not_touch_a_claim_are_not_listed():
    one, two = all_of(SINGLE), all_of(long())
    assert set(mapped("single-improvement", one)) == {"default reading", *BY_LABEL} - FLOORED
    # measured on the proposed scheme alone, though the pilot scheme is run as well
    assert set(mapped("dips-at-omni-slots", two)) == {"default reading", *BY_LABEL} - {NEEDLE}
    assert set(mapped("gap-shrinks", two)) == {"default reading", *BY_LABEL}


def test_fallback_beams_leave_a_reading_unjudged_where_the_claim_hangs_on_them():
    setup = varied(long(), BY_LABEL["ripple 5"])
    results = all_of(long(), changed=(made_up(setup, fallback={"pilot": 0.6, "temporal": 0.4}),))
    found = {one.reading: one for one in entries(results, [CLAIMS["gap-shrinks"]])}
    assert found["ripple 5"].judgement == "not judged"
    assert found["ripple 5"].fallbacks == pytest.approx(0.6)
    (alone,) = (
        one for one in entries(results, [CLAIMS["dips-at-omni-slots"]]) if one.reading == "ripple 5"
    )
    assert alone.fallbacks == pytest.approx(0.4)
    assert alone.judgement == alone.finding.verdict == "not reproduced"


def test_the_floor_is_not_judged_where_there_is_none():
    def kept(setup: Setup) -> Outcome:
        """Return the far object exactly on a floor of 4e-4."""
        found = made_up(setup)
        shape = (2, TRIALS, setup.scenario().n_slots, 2)
        return replace(found, kept={"rate": np.full(shape, 4e-4)})

    setups = [varied(multi(), one) for one in VARIATIONS]
    results = Results([kept(setup) for setup in (multi(), *setups)], TRIALS, 0)
    found = mapped("floor-kept", results)
    assert {reading for reading, said in found.items() if said == "not judged"} == {
        "min_rate 0",
        "exact CRB with min_rate 0",
    }
    # floors go with P_T: the same rate is a share of 10 % of a floor ten times as high
    assert found["P_T = 10"] == "not reproduced"
    assert found["default reading"] == found["P_T = 0.5"] == "reproduced"


def test_a_reading_that_was_not_run_is_missed_instead_of_taken_for_the_default():
    results = all_of(SINGLE)
    del results.outcomes[varied(SINGLE, BY_LABEL["ripple 5"]).name]
    with pytest.raises(KeyError, match="ripple 5"):
        entries(results, [CLAIMS["single-improvement"]])


def entry(claim: str, reading: str, ours: tuple[float, float, float], share: float = 0.0) -> Entry:
    measured = Measured({"improvement": Estimate(*ours)}, "%")
    return Entry(Finding(CLAIMS[claim], measured), reading, 60, share)


HEADLINES = [
    replace(entry("single-improvement", "default reading", (142, 137, 148)), trials=200),
    entry("single-improvement", "P_T = 2", (150.0, 135.0, 165.0)),
    entry("single-improvement", "P_T = 10", (151.0, 136.0, 166.0)),
    entry("single-improvement", "exact CRB", (61.0, 40.0, 82.0), 0.125),
    entry("single-improvement", "needle", (20.0, -5.0, 45.0)),
    replace(entry("multi-improvement", "default reading", (150, 140, 160)), trials=200),
    entry("multi-improvement", "ripple 1", (150.0, 140.0, 160.0), 0.8),
]


def test_the_page_shows_over_which_readings_a_claim_holds():
    text = page([], Results([], 200, 0), HEADLINES)
    assert "200 trials in the default reading, 60 in the others." in text
    assert "| single-improvement | reproduced | P_T = 2, 10 | exact CRB | needle | - |" in text
    assert "| multi-improvement | reproduced | - | - | - | ripple 1 |" in text
    assert "1 of 2 get the default's verdict wherever they are judged" in text


def test_the_page_says_nothing_of_a_map_that_was_not_made():
    assert "the sensitivity map shows" in page([], Results([], 200, 0), HEADLINES)
    assert "ensitivity" not in page([], Results([], 200, 0))


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        ([], "-"),
        (["exact CRB"], "exact CRB"),
        (["P_T = 0.5", "ripple 1", "P_T = 10"], "P_T = 0.5, 10; ripple 1"),
        (["min_rate 0", "min_rate 1e-4", "exact CRB with min_rate 0"],
         "min_rate 0, 1e-4; exact CRB with min_rate 0"),
    ],
)  # fmt: skip
def test_readings_are_gathered_by_what_they_change(readings, said):
    assert gathered(readings) == said


def test_the_document_has_an_entry_for_every_claim_and_reading():
    rows = document([], HEADLINES)["sensitivity"]
    assert [(row["id"], row["reading"]) for row in rows] == [
        (one.finding.claim.id, one.reading) for one in HEADLINES
    ]
    assert rows[3] == {
        "id": "single-improvement", "reading": "exact CRB", "quantity": "improvement",
        "ours": 61.0, "interval": [40.0, 82.0], "unit": "%", "trials": 60,
        "fallbacks": 0.125, "verdict": "in part",
    }  # fmt: skip
