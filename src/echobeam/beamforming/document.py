"""Problem (38) and its answer as JSON: what `echobeam beam` reads and prints."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from echobeam.beamforming.answer import BeamAnswer
from echobeam.beamforming.problem import BeamProblem, ProblemError

VECTORS = {
    "angles_deg": "a list of numbers, degrees",
    "distances": "a list of positive numbers, m",
    "coverage_halfwidths_deg": "a list of numbers from 0 to 90, degrees",
    "ripple": "a number or a list of numbers, at least 0",
    "min_rate": "a number or a list of numbers, at least 0, bit/s/Hz",
}
SCALARS = {
    "power": "a positive number",
    "noise": "a positive number",
    "n_tx": "a whole number from 1",
}
OPTIONAL = {
    "alpha0": "a positive number",
    "spacing": "a positive number, wavelengths",
    "axis": '"vertical" or "horizontal"',
    "resolution_deg": "a positive number, degrees",
    "warm_start_re": "one list of n_tx numbers per object, with warm_start_im",
    "warm_start_im": "one list of n_tx numbers per object, with warm_start_re",
}
ACCEPTED = {**VECTORS, **SCALARS, **OPTIONAL}
"""Every key of a problem document, and what it takes; null leaves an optional one out."""

BROADCAST = ("ripple", "min_rate")
DEGREES = "_deg"


def read_problem(text: str, source: str = "problem") -> BeamProblem:
    """Return the problem (38) that a JSON text states.

    Parameters
    ----------
    text
        A JSON object with the keys of `ACCEPTED`: those of `BeamProblem`, angles in degrees.
    source
        Name of the file, for messages.

    Raises
    ------
    ProblemError
        If the text is no JSON object, a key is unknown or missing, or a value is not what its key
        takes; all faults in one message, each with the file, the key and the value.
    """
    document = {
        key: value
        for key, value in _parsed(text, source).items()
        if not (value is None and key in OPTIONAL)
    }
    faults = [
        f"{key}: no such key; accepted are {', '.join(ACCEPTED)}"
        for key in document
        if key not in ACCEPTED
    ]
    faults += [
        f"{key}: missing; expected {accepted}"
        for key, accepted in {**VECTORS, **SCALARS}.items()
        if key not in document
    ]
    faults += [fault for key, value in document.items() if (fault := _fault(key, value))]
    faults += _misfits(document, faults)
    if not faults:
        try:
            return BeamProblem(**_arguments(document))
        except ProblemError as error:
            faults = str(error).split("; ")
    raise ProblemError("\n".join(f"{source}: {fault}" for fault in faults))


def answer_document(answer: BeamAnswer) -> dict[str, Any]:
    """Return an answer as a dictionary for JSON; what is infinite or undefined becomes None."""
    missed = answer.max_violation
    return {
        "beams_re": _lists(answer.beams.real),
        "beams_im": _lists(answer.beams.imag),
        "rates": _lists(answer.rates),
        "objective": _number(answer.objective),
        "upper_bound": _number(answer.upper_bound),
        "gap": _number(answer.gap),
        "status": answer.status,
        "message": answer.message,
        "max_violation": {
            "power": _number(missed.power),
            "rate": _number(missed.rate),
            "coverage": _number(missed.coverage),
        },
        "seconds": _number(answer.seconds),
        "iterations": int(answer.iterations),
    }


def _parsed(text: str, source: str) -> dict[str, Any]:
    doubled: list[str] = []

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = [key for key, _ in pairs]
        doubled.extend(sorted({key for key in keys if keys.count(key) > 1}))
        return dict(pairs)

    try:
        document = json.loads(text, object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:  # too many digits are a plain ValueError
        raise ProblemError(f"{source}: not JSON: {error}") from None
    if not isinstance(document, dict):
        raise ProblemError(
            f"{source}: {_shown(document)} is not a JSON object with the keys {', '.join(ACCEPTED)}"
        )
    if doubled:
        raise ProblemError("\n".join(f"{source}: {key}: given twice" for key in doubled))
    return document


def _fault(key: str, value: object) -> str | None:
    """Return what is wrong with one key's value, None if nothing is."""
    if key in VECTORS:
        good = _is_vector(value) or (key in BROADCAST and _is_number(value))
        good = good and all(_in_range(key, item) for item in np.atleast_1d(np.array(value)))
    elif key == "axis":
        good = value in ("vertical", "horizontal")
    elif key.startswith("warm_start_"):
        good = isinstance(value, list) and all(_is_vector(row) for row in value)
    else:
        good = key not in ACCEPTED or (_is_number(value) and _in_range(key, value))
    return None if good else f"{key}: {_shown(value)} is not {ACCEPTED[key]}"


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _is_vector(value: object) -> bool:
    return isinstance(value, list) and all(_is_number(item) for item in value)


def _in_range(key: str, value: Any) -> bool:
    number = float(value)
    match key:
        case "angles_deg":
            return True
        case "coverage_halfwidths_deg":
            return 0.0 <= number <= 90.0
        case "ripple" | "min_rate":
            return number >= 0.0
        case "n_tx":
            return number >= 1.0 and number == int(number)
        case _:
            return number > 0.0


def _misfits(document: dict[str, Any], faults: list[str]) -> list[str]:
    """Return which lists do not fit the number of objects that the angles give."""
    faulty = {fault.split(":")[0] for fault in faults}
    if "angles_deg" not in document or "angles_deg" in faulty:
        return []
    n_objects = len(document["angles_deg"])
    found = [
        f"{key}: {_shown(document[key])} has {len(document[key])} values, "
        f"expected {n_objects} as in angles_deg"
        for key in VECTORS
        if key not in faulty
        and isinstance(document.get(key), list)
        and len(document[key]) != n_objects
    ]
    return found + _warm_misfits(document, faulty, n_objects)


def _warm_misfits(document: dict[str, Any], faulty: set[str], n_objects: int) -> list[str]:
    parts = ("warm_start_re", "warm_start_im")
    given = [key for key in parts if key in document]
    if not given or faulty & {*parts, "n_tx"} or "n_tx" not in document:
        return []
    n_tx = int(document["n_tx"])
    found = [f"{key}: missing; expected {ACCEPTED[key]}" for key in parts if key not in given]
    return found + [
        f"{key}: expected {n_objects} lists of {n_tx} numbers"
        for key in given
        if [len(row) for row in document[key]] != [n_tx] * n_objects
    ]


def _arguments(document: dict[str, Any]) -> dict[str, Any]:
    arguments: dict[str, Any] = {}
    for key, value in document.items():
        if key.endswith(DEGREES):
            arguments[key.removesuffix(DEGREES)] = np.radians(np.array(value, dtype=float))
        elif not key.startswith("warm_start_"):
            arguments[key] = value
    if "warm_start_re" in document:
        real, imaginary = document["warm_start_re"], document["warm_start_im"]
        arguments["warm_start"] = np.array(real, dtype=float) + 1j * np.array(imaginary)
    return arguments


def _shown(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _lists(values: Any) -> Any:
    """Return nested lists of an array, None for what is not finite."""
    if values.ndim > 1:
        return [_lists(row) for row in values]
    return [_number(item) for item in values.tolist()]
