"""The ledger and the docstrings tell one story: neither may name what the other does not know."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from echobeam.scenario.model import Scenario

ROOT = Path(__file__).parents[2]
LEDGER = ROOT / "docs" / "ledger.md"
SOURCE = ROOT / "src" / "echobeam"
COLUMNS = ["Eq.", "Functions", "As printed", "As we do", "Why", "Switch"]
LAST = 57

_NUMBER = r"\((\d+)([a-z]?)\)"
_ITEM = re.compile(_NUMBER)
_NEXT = re.compile(r"\s*(-|–|to|,\s*and|,|and)\s*(?:Eqs?\.\s*)?(?=\(\d+[a-z]?\))")
_ANCHOR = re.compile(r"\bEqs?\.?\s*(?=\(\d)|(?<![\w\]`)])(?=\(\d{1,2}[a-z]?\))")
_CARELESS = re.compile(r"\bEqs?\.?\s*\d|\bEqs?\s+\(|\b[Ee]quations?\s+\(?\d")


@dataclass(frozen=True)
class Row:
    """One line of the ledger."""

    equation: str
    functions: list[str]
    switches: list[str]
    cells: list[str]


def cells_of(line: str) -> list[str]:
    """Return the cells of a table's line; a pipe after a backslash belongs to the text."""
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]


def read_ledger(text: str) -> dict[str, Row]:
    """Return the rows of all tables of equations, by equation."""
    rows: dict[str, Row] = {}
    inside = False
    for line in text.splitlines():
        if not line.startswith("|"):
            inside = False
            continue
        cells = cells_of(line)
        if cells == COLUMNS:
            inside = True
        elif inside and not set(line) <= set("|-: "):
            assert len(cells) == len(COLUMNS), f"{len(cells)} cells in {line!r}"
            number = cells[0]
            assert re.fullmatch(r"\d+[a-z]?", number), f"no equation's number: {number!r}"
            assert number not in rows, f"Eq. ({number}) has two rows"
            code = re.compile(r"`([^`]+)`")
            rows[number] = Row(number, code.findall(cells[1]), code.findall(cells[5]), cells)
    return rows


def equations_named(text: str) -> set[str]:
    """Return the equations that a text names, ranges written out.

    Read are "Eq. (7)", "Eqs. (1)-(3)", "Eq. (1) to Eq. (3)", "Eqs. (8), (10) and (12)", and a
    number that stands alone in brackets, such as (38f), or (50) to (57).
    """
    found: set[str] = set()
    for anchor in _ANCHOR.finditer(text):
        item = _ITEM.match(text, anchor.end())
        while item:
            found.add(item[1] + item[2])
            link = _NEXT.match(text, item.end())
            following = _ITEM.match(text, link.end()) if link else None
            if link and following and link[1] in ("-", "–", "to"):
                found |= {str(n) for n in range(int(item[1]) + 1, int(following[1]))}
            item = following
    return found


def docstrings(source: str) -> Iterator[str]:
    """Yield the docstrings of a source file: also those that stand below a constant or a field."""
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield node.value.value


def all_docstrings() -> dict[str, str]:
    """Return the docstrings of every file of the package, joined, by the file's name."""
    return {
        str(path.relative_to(SOURCE)): "\n\n".join(docstrings(path.read_text(encoding="utf-8")))
        for path in sorted(SOURCE.rglob("*.py"))
    }


def faults_of_sources(sources: Mapping[str, str], rows: Mapping[str, Row]) -> list[str]:
    """Return what docstrings name and the ledger does not know, or what cannot be read."""
    faults = []
    for name, text in sources.items():
        unknown = equations_named(text) - set(rows)
        faults += [f"{name} names Eq. ({number}), no row" for number in sorted(unknown)]
        faults += [f"{name}: write Eq. (N), not {m[0]!r}" for m in _CARELESS.finditer(text)]
    return faults


def resolve(path: str) -> tuple[object, list[str]]:
    """Return what a dotted path names, and its docstring with those of all that contain it."""
    parts = path.split(".")
    if parts[0] != "echobeam":
        raise LookupError(f"{path} is not in echobeam")
    for split in range(len(parts), 0, -1):
        try:
            found: object = import_module(".".join(parts[:split]))
        except ModuleNotFoundError as error:
            if error.name is None or not path.startswith(error.name):
                raise
            continue
        texts = [inspect.getdoc(found) or ""]
        for attribute in parts[split:]:
            found = getattr(found, attribute)
            texts.append(inspect.getdoc(found) or "")
        return found, texts
    raise LookupError(path)


def scenario_keys() -> set[str]:
    """Return the dotted keys of the scenario file."""
    return {
        f"{table}.{key}"
        for table, field in Scenario.model_fields.items()
        for candidate in (field.annotation, *getattr(field.annotation, "__args__", ()))
        for key in getattr(candidate, "model_fields", {})
    }


def faults_of_rows(rows: Mapping[str, Row]) -> list[str]:
    """Return what the ledger claims and the code does not confirm."""
    faults = [f"Eq. ({n}) has no row" for n in range(1, LAST + 1) if str(n) not in rows]
    keys = scenario_keys()
    for row in rows.values():
        parameters: set[str] = set()
        if not row.functions and row.cells[1] != "-":
            faults.append(f"row {row.equation}: neither a function nor '-'")
        for path in row.functions:
            try:
                found, texts = resolve(path)
            except (LookupError, AttributeError, ImportError) as error:
                faults.append(f"row {row.equation}: {path} is not there: {error}")
                continue
            whole = row.equation.rstrip("abcdefgh")
            if not {row.equation, whole} & equations_named("\n\n".join(texts)):
                faults.append(f"row {row.equation}: {path} does not name Eq. ({row.equation})")
            if callable(found) and not isinstance(found, ModuleType):
                parameters |= set(inspect.signature(found).parameters)
        for switch in row.switches:
            if switch not in (keys if "." in switch else parameters):
                faults.append(f"row {row.equation}: there is no switch {switch}")
    return faults


def test_every_equation_of_a_docstring_has_a_row() -> None:
    assert faults_of_sources(all_docstrings(), read_ledger(LEDGER.read_text("utf-8"))) == []


def test_every_equation_has_a_row_and_every_row_is_true() -> None:
    assert faults_of_rows(read_ledger(LEDGER.read_text("utf-8"))) == []


@pytest.mark.slow
def test_the_docstrings_name_most_of_the_paper() -> None:
    """A parser that finds nothing would pass the tests above."""
    named = set().union(*map(equations_named, all_docstrings().values()))
    assert len(named) > 50


HEAD = "| " + " | ".join(COLUMNS) + " |\n|---|---|---|---|---|---|\n"
SINR = "| 7 | `echobeam.physics.link.sinr` | a \\| b | same | - | `loss`, `array.axis` |\n"


def test_a_row_is_read_with_its_functions_and_switches() -> None:
    row = read_ledger("text\n\n" + HEAD + SINR)["7"]
    assert row.functions == ["echobeam.physics.link.sinr"]
    assert row.switches == ["loss", "array.axis"]
    assert row.cells[2] == "a \\| b"


def test_a_true_row_passes() -> None:
    faults = faults_of_rows(read_ledger(HEAD + SINR))
    assert [fault for fault in faults if not fault.endswith("has no row")] == []
    assert len(faults) == LAST - 1


@pytest.mark.parametrize(
    ("lie", "said"),
    [
        ("link.sinr", "echobeam.physics.link.sinner"),
        ("physics.link", "physics.links"),
        ("echobeam.physics", "numpy.linalg"),
        ("`loss`", "`power`"),
        ("`array.axis`", "`array.axes`"),
        ("| 7 |", "| 40 |"),
        ("`echobeam.physics.link.sinr`", "sinr"),
    ],
)
def test_a_row_that_lies_is_found(lie: str, said: str) -> None:
    faults = faults_of_rows(read_ledger(HEAD + SINR.replace(lie, said)))
    assert [fault for fault in faults if not fault.endswith("has no row")] != []


@pytest.mark.parametrize(
    "text", [HEAD + SINR + SINR, HEAD + "| seven | - | | | | |\n", HEAD + "| 7 | - |\n"]
)
def test_a_broken_table_is_refused(text: str) -> None:
    with pytest.raises(AssertionError):
        read_ledger(text)


def test_a_docstring_that_names_an_unknown_equation_is_found() -> None:
    rows = read_ledger(HEAD + SINR)
    assert faults_of_sources({"a.py": "The SINR, Eq. (7)."}, rows) == []
    assert len(faults_of_sources({"a.py": "The SINR, Eqs. (7) to (9)."}, rows)) == 2
    assert len(faults_of_sources({"a.py": "By Eq. 7."}, rows)) == 1


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("Eq. (7)", {"7"}),
        ("Eqs. (3)-(5)", {"3", "4", "5"}),
        ("Eqs. (3) to (5)", {"3", "4", "5"}),
        ("Eq. (3) to Eq. (5)", {"3", "4", "5"}),
        ("Eqs. (8), (10) and\n    (12).", {"8", "10", "12"}),
        ("Eqs. (2)-(4), (9), and Eq. (11)", {"2", "3", "4", "9", "11"}),
        ("the coverage (38f) of problem (38)", {"38f", "38"}),
        ("Eqs. (38e), (38f)", {"38e", "38f"}),
        ("(51)-(53) of the relaxed problem (50)", {"50", "51", "52", "53"}),
        ("an array of shape (2,), f(3), `g`(4) and (T, K)", set()),
    ],
)
def test_equations_are_read_as_they_are_written(text: str, named: set[str]) -> None:
    assert equations_named(text) == named


def test_docstrings_are_read_wherever_they_stand() -> None:
    source = (
        '"""Module."""\nA = 1\n"""Constant."""\ndef f():\n    """Function."""\n    x = "text"\n'
    )
    assert sorted(docstrings(source)) == ["Constant.", "Function.", "Module."]
