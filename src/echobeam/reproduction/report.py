"""Findings as files: `claims.json` for programs, `claims.md` for readers."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from echobeam.reproduction.records import Entry, Estimate, Finding, Judgement, Verdict
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import CALIBRATED, DEFAULT, HEADLINE_SHARE
from echobeam.store.writing import replacing
from echobeam.version import __version__

VERDICTS: tuple[Verdict, ...] = ("reproduced", "in part", "not reproduced")
JUDGEMENTS: tuple[Judgement, ...] = (*VERDICTS, "not judged")


def write_claims(
    findings: Sequence[Finding],
    results: Results,
    directory: Path,
    sensitivity: Sequence[Entry] = (),
) -> None:
    """Write both files, each atomically."""
    texts = {
        "claims.json": json.dumps(
            document(findings, sensitivity, results.settings), indent=1, allow_nan=False
        )
        + "\n",
        "claims.md": page(findings, results, sensitivity),
    }
    for name, text in texts.items():
        with replacing(directory / name) as temporary:
            temporary.write_text(text, encoding="utf-8")


def document(
    findings: Sequence[Finding],
    sensitivity: Sequence[Entry] = (),
    settings: Sequence[str] = (),
) -> dict[str, list[Any]]:
    """Return findings, map and settings as a JSON document; NaN and infinity become null."""
    found: dict[str, list[Any]] = {"claims": [_entry(finding) for finding in findings]}
    if sensitivity:
        found["sensitivity"] = [_mapped(one) for one in sensitivity]
    if settings:
        found["set"] = list(settings)
    return found


def _mapped(one: Entry) -> dict[str, object]:
    measured = one.finding.measured
    ours = measured.headline
    return {
        "id": one.finding.claim.id,
        "reading": one.reading,
        "quantity": next(iter(measured.estimates)),
        "ours": _number(ours.value),
        "interval": [_number(ours.low), _number(ours.high)] if ours.random else None,
        "unit": measured.unit,
        "trials": one.trials,
        "fallbacks": _number(one.fallbacks),
        "verdict": one.judgement,
    }


def _entry(finding: Finding) -> dict[str, object]:
    claim, ours = finding.claim, finding.measured.headline
    return {
        "id": claim.id,
        "figure": claim.figure,
        "text": claim.text,
        "paper": claim.paper,
        "ours": _number(ours.value),
        "interval": [_number(ours.low), _number(ours.high)] if ours.random else None,
        "reading": claim.reading,
        "verdict": finding.verdict,
    }


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def page(findings: Sequence[Finding], results: Results, sensitivity: Sequence[Entry] = ()) -> str:
    """Return the page: the table of findings, the sensitivity map, all readings and rules."""
    effect = "; the sensitivity map shows the effect of other values" if sensitivity else ""
    counts = [sum(one.verdict == verdict for one in findings) for verdict in VERDICTS]
    said = ", ".join(f"{count} {verdict}" for count, verdict in zip(counts, VERDICTS, strict=True))
    lines = [
        "# The paper's claims",
        "",
        f"{len(findings)} claims: {said}. echobeam {__version__}, {results.trials} trials per "
        f"point and {HEADLINE_SHARE:g} times as many for the two percentages, seed "
        f"{results.seed}; intervals are 95 %. Verdicts are computed by the rules "
        "below, from intervals: with too few trials for a decision the weaker verdict is given, "
        "and more trials may change it. If a claim has several numbers the table shows the first, "
        "with its name; all numbers, their measures and the rules are below. *Within 20 %, "
        "calibrated*: the rule for a printed number, met with parameters that the paper does not "
        "give and that were chosen because they meet it. *By construction*: the claim follows from "
        "the definition of the schemes.",
        "",
        f"Calibrated: {CALIBRATED}. Agreement supports this reading of the "
        f"paper, but is not an independent confirmation{effect}.",
        "",
        *_changed(results.settings),
        "| Figure | Claim | Paper | Ours | Verdict |",
        "|---|---|---|---|---|",
    ]
    lines += [_row(finding) for finding in findings]
    lines += _map(sensitivity)
    lines += ["", "## Readings and rules", ""]
    lines += [_paragraph(finding) for finding in findings]
    return "\n".join(lines) + "\n"


def _changed(settings: Sequence[str]) -> list[str]:
    """Return a paragraph on the settings that differ from the paper's, if there are any."""
    if not settings:
        return []
    texts = ", ".join(f"`{text}`" for text in settings)
    return [f"**Not the paper's setting**: all points were run with {texts}.", ""]


def _map(sensitivity: Sequence[Entry]) -> list[str]:
    """Return the table of the readings under which each mapped claim holds."""
    by_claim: dict[str, list[Entry]] = {}
    for one in sensitivity:
        by_claim.setdefault(one.finding.claim.id, []).append(one)
    if not by_claim:
        return []
    firm = sum(_firm(entries) for entries in by_claim.values())
    figures = dict.fromkeys(one.finding.claim.figure for one in sensitivity)
    return [
        "",
        "## Sensitivity of the claims",
        "",
        f"Every claim of {', '.join(figures)}, measured and judged again by its own rule under "
        "each of these readings that affects its measurement; the numbers are in "
        f"`claims.json`. {firm} of {len(by_claim)} get the default's verdict wherever they are "
        f'judged. {_trials(sensitivity)} Two objects have fewer; "fewer trials" changes '
        "nothing else: if its verdict is weaker, the others may be so for lack of trials. "
        "Not judged: most beams were a fallback, or the measure is undefined (a share of a zero "
        "floor). Claims of other figures were not mapped.",
        "",
        f"| Claim | Default | {' | '.join(one.capitalize() for one in JUDGEMENTS)} |",
        "|---|---|---|---|---|---|",
        *(_over(name, entries) for name, entries in by_claim.items()),
    ]


def _trials(sensitivity: Sequence[Entry]) -> str:
    """Return a sentence on the numbers of trials of the map."""
    default, changed = (
        sorted({one.trials for one in sensitivity if (one.reading == DEFAULT.label) is wanted})
        for wanted in (True, False)
    )
    said = [" or ".join(map(str, some)) or "no" for some in (default, changed)]
    return f"{said[0]} trials in the default reading, {said[1]} in the others."


def _firm(entries: Sequence[Entry]) -> bool:
    """Return whether a claim has the same verdict wherever it is judged."""
    return len({one.judgement for one in entries} - {"not judged"}) == 1


def _over(name: str, entries: Sequence[Entry]) -> str:
    """Return a claim's row: the default's verdict, then the readings for each verdict."""
    default = next(one.judgement for one in entries if one.reading == DEFAULT.label)
    cells = [
        gathered(
            one.reading
            for one in entries
            if one.judgement == judgement and one.reading != DEFAULT.label
        )
        for judgement in JUDGEMENTS
    ]
    return f"| {name} | {default} | {' | '.join(cells)} |"


def gathered(readings: Iterable[str]) -> str:
    """Return readings as a line; readings that differ by a number share their words."""
    by_key: dict[str, list[str]] = {}
    for reading in readings:
        key, _, value = reading.rpartition(" ")
        numeric = value.replace("e-", "").replace(".", "").isdigit()
        values = by_key.setdefault(key if numeric else reading, [])
        values += [value] * numeric
    return "; ".join(f"{key} {', '.join(values)}".strip() for key, values in by_key.items()) or "-"


def _row(finding: Finding) -> str:
    claim, measured = finding.claim, finding.measured
    paper = claim.paper if isinstance(claim.paper, str) else f"{claim.paper:g} {measured.unit}"
    quantity, headline = next(iter(measured.estimates.items()))
    remark = f" ({claim.remark})" if claim.remark else ""
    return (
        f"| {claim.figure} | **{claim.id}**: {claim.text} | {paper} | {quantity}: "
        f"{written(headline, measured.unit)} | {finding.verdict}{remark} |"
    )


def _paragraph(finding: Finding) -> str:
    claim, measured = finding.claim, finding.measured
    found = "; ".join(
        f"{name} {written(one, measured.unit)}" for name, one in measured.estimates.items()
    )
    return (
        f"- **{claim.id}** ({finding.verdict}). Measured: {found}. Reading: {claim.reading}. "
        f"Rule: {claim.judge.text}."
    )


def written(estimate: Estimate, unit: str = "") -> str:
    """Return a number with its interval and unit as text."""
    if estimate.low == estimate.value == math.inf:
        return "none"
    if math.isnan(estimate.value):
        return "undefined"
    digits = 0 if unit == "slot" else _decimals(estimate)
    value, low, high = (
        _end(x, estimate, digits) for x in (estimate.value, estimate.low, estimate.high)
    )
    number = f"{value} ({low} to {high})" if estimate.random else value
    return f"{unit} {number}" if unit == "slot" else f"{number} {unit}".strip()


def _end(x: float, estimate: Estimate, digits: int) -> str:
    """Return a number as text, or on which side of the evaluated range it is."""
    if math.isfinite(x):
        return f"{x:.{digits}f}"
    if estimate.looked is None or math.isnan(x):
        return "unknown"
    return f"above {estimate.looked[1]:g}" if x > 0 else f"below {estimate.looked[0]:g}"


def _decimals(estimate: Estimate) -> int:
    """Return the decimals for two digits of the interval's half-width, else three digits."""
    if not estimate.random and math.isfinite(estimate.value):
        plain = f"{estimate.value:.3g}"
        if "e" not in plain:
            return len(plain.partition(".")[2])
    half, size = (estimate.high - estimate.low) / 2, abs(estimate.value)
    scale = half if estimate.random and math.isfinite(half) else size / 10
    if not math.isfinite(scale) or scale == 0:
        return 0
    return max(0, min(6, 1 - math.floor(math.log10(scale))))
