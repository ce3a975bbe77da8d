"""Findings as files: `claims.json` for programs, `claims.md` for readers."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

from echobeam.reproduction.records import Entry, Estimate, Finding, Measured, Verdict
from echobeam.reproduction.results import Results
from echobeam.reproduction.rules import near
from echobeam.reproduction.setups import CALIBRATED
from echobeam.store.writing import replacing
from echobeam.version import __version__

VERDICTS: tuple[Verdict, ...] = ("reproduced", "in part", "not reproduced")


def write_claims(
    findings: Sequence[Finding],
    results: Results,
    directory: Path,
    sensitivity: Sequence[Entry] = (),
) -> None:
    """Write both files, each whole or not at all."""
    texts = {
        "claims.json": json.dumps(document(findings), indent=1, allow_nan=False) + "\n",
        "claims.md": page(findings, results, sensitivity),
    }
    for name, text in texts.items():
        with replacing(directory / name) as temporary:
            temporary.write_text(text, encoding="utf-8")


def document(findings: Sequence[Finding]) -> dict[str, list[dict[str, object]]]:
    """Return the findings as JSON knows them: what is not a finite number is null."""
    return {"claims": [_entry(finding) for finding in findings]}


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
    """Return the findings as a table to read, the sensitivity map, every reading and rule."""
    counts = [sum(one.verdict == verdict for one in findings) for verdict in VERDICTS]
    said = ", ".join(f"{count} {verdict}" for count, verdict in zip(counts, VERDICTS, strict=True))
    lines = [
        "# The paper's claims",
        "",
        f"{len(findings)} claims: {said}. echobeam {__version__}, {results.trials} trials per "
        f"point, seed {results.seed}; intervals are 95 %. Verdicts are computed by the rules "
        "below, from intervals: where trials are too few to tell, the lesser verdict stands, and "
        "more trials may change it. Of a claim's several numbers the table shows the first; all "
        "stand below it.",
        "",
        f"Calibrated: {CALIBRATED}. Agreement is evidence for that reading of the "
        "paper, not an independent confirmation; the sensitivity map shows how much hangs on it.",
        "",
        "| Figure | Claim | Paper | Ours | Verdict |",
        "|---|---|---|---|---|",
    ]
    lines += [_row(finding) for finding in findings]
    lines += _map(sensitivity)
    lines += ["", "## Readings and rules", ""]
    lines += [_paragraph(finding) for finding in findings]
    return "\n".join(lines) + "\n"


def _map(sensitivity: Sequence[Entry]) -> list[str]:
    """Return the sensitivity map as a table, judged by the rule of the headline claims."""
    if not sensitivity:
        return []
    return [
        "",
        "## Sensitivity of the headline improvements",
        "",
        "Improvement in slot 6, one reading changed at a time from the default, with fewer trials; "
        "judged by the headline claims' rule. Fallback: directional slots in which no beams met "
        "all that was asked, in the scheme that had more of them. Where most did not, what was "
        "measured is no design of the paper's, and not judged.",
        "",
        "| Scenario | Reading | Ours | Paper | Fallback | Verdict |",
        "|---|---|---|---|---|---|",
        *(
            f"| {one.objects} | {one.change} | {written(one.improvement, '%')} | {one.paper} % | "
            f"{100 * one.fallbacks:.3g} % | {_judged(one)} |"
            for one in sensitivity
        ),
    ]


def _judged(entry: Entry) -> str:
    """Return the verdict on one row of the map, by the headline claims' rule."""
    if entry.fallback:
        return "not judged"
    return near(entry.paper).decide(Measured({"improvement": entry.improvement}))


def _row(finding: Finding) -> str:
    claim, measured = finding.claim, finding.measured
    paper = claim.paper if isinstance(claim.paper, str) else f"{claim.paper:g} {measured.unit}"
    ours = written(measured.headline, measured.unit)
    return (
        f"| {claim.figure} | **{claim.id}**: {claim.text} | {paper} | {ours} | {finding.verdict} |"
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
    """Return a number with its interval and unit as it is printed."""
    digits = 0 if unit == "slot" else _decimals(estimate)
    value, low, high = (
        f"{x:.{digits}f}" if math.isfinite(x) else "none"
        for x in (estimate.value, estimate.low, estimate.high)
    )
    number = f"{value} ({low} to {high})" if estimate.random else value
    if unit == "slot":
        return f"{unit} {number}"
    return number if number == "none" else f"{number} {unit}".strip()


def _decimals(estimate: Estimate) -> int:
    """Return decimals that show two digits of the interval's half-width, or three in all."""
    if not estimate.random and math.isfinite(estimate.value):
        plain = f"{estimate.value:.3g}"
        if "e" not in plain:
            return len(plain.partition(".")[2])
    half, size = (estimate.high - estimate.low) / 2, abs(estimate.value)
    scale = half if estimate.random and math.isfinite(half) else size / 10
    if not math.isfinite(scale) or scale == 0:
        return 0
    return max(0, min(6, 1 - math.floor(math.log10(scale))))
