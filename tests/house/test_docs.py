"""The pages say what the code does: keys, variables, names, commands, links and snippets."""

from __future__ import annotations

import ast
import configparser
import math
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import click
import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt, MinLen
from click.testing import CliRunner
from pydantic import BaseModel
from pydantic.fields import FieldInfo

import echobeam
from echobeam.beamforming.methods import METHODS as SOLVERS
from echobeam.cli.main import COMMANDS, cli
from echobeam.cli.problem_document import ACCEPTED, answer_document, read_problem
from echobeam.scenario.built_in import BUILT_IN
from echobeam.scenario.load import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import PARAMETERS
from echobeam.schemes import registry
from echobeam.schemes.configure import configure
from echobeam.simulation.dataset import TRACK_VARIABLES, VARIABLES, coordinates
from echobeam.simulation.summary import SchemeSummary
from echobeam.units import UNITS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
TEXTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]

_FENCE = re.compile(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    title: str
    text: str


def blocks(text: str, *languages: str) -> list[Block]:
    """Return a page's fenced blocks of some languages, without those that include a file."""
    found = [Block(m[1], m[2] or "", m[3]) for m in _FENCE.finditer(text)]
    return [b for b in found if b.language in languages and not b.text.startswith("--8<--")]


def prose(text: str) -> str:
    """Return a page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def tables(text: str, first: str) -> list[list[str]]:
    """Return the rows of all tables whose first column has this header."""
    rows: list[list[str]] = []
    inside = False
    for line in prose(text).splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not line.startswith("|"):
            inside = False
        elif cells[0] == first:
            inside = True
        elif inside and not set(line) <= set("|-: "):
            rows.append(cells)
    return rows


def page(name: str) -> str:
    """Return the text of a page."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def code(cell: str) -> str:
    """Return what stands in backticks in a cell."""
    match = re.fullmatch(r"`([^`]+)`", cell)
    assert match, f"not one piece of code: {cell!r}"
    return match[1]


# Scenario file


def table_of(annotation: Any) -> type[BaseModel] | None:
    """Return the table that a field holds, if it holds one."""
    for candidate in (annotation, *get_args(annotation)):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def scenario_fields() -> Iterator[tuple[str, FieldInfo]]:
    """Yield the dotted keys of the scenario file and their fields."""
    for name, field in Scenario.model_fields.items():
        table = table_of(field.annotation)
        if name == PARAMETERS:
            continue  # a file has them as [schemes.NAME]
        if table is None:
            yield name, field
        else:
            yield from ((f"{name}.{key}", inner) for key, inner in table.model_fields.items())


def unit_of(field: FieldInfo) -> str:
    """Return the SI unit of a field, '-' for one without."""
    kinds = set(re.findall(r"'kind': '(\w+)'", repr(field)))
    if kinds == {"time", "length"}:  # points of a path
        return "s, m"
    assert len(kinds) <= 1, field
    return next(iter(UNITS[kinds.pop()]), "-") if kinds else "-"


def number(value: float) -> str:
    """Return a bound as a person writes it."""
    names = {math.pi: "π", -math.pi: "−π", math.pi / 2: "π/2"}
    return names.get(value, f"{value:g}" if value != int(value) else str(int(value)))


def bounds_of(field: FieldInfo) -> dict[type, float]:
    """Return the bounds of a field by their kind."""
    metadata = [*field.metadata]
    for option in get_args(field.annotation):  # where a key may be left out
        metadata += getattr(option, "__metadata__", ())
    for item in tuple(metadata):
        metadata += getattr(item, "metadata", [])
    kinds = {Gt: "gt", Ge: "ge", Lt: "lt", Le: "le"}
    return {
        kind: getattr(item, attribute)
        for item in metadata
        for kind, attribute in kinds.items()
        if isinstance(item, kind)
    }


WORDS = {
    "array.facing": '`"down"`, `"ahead"`, or a list of 3 numbers',
    "uav.waypoints": "a list of points `[t, x, y, z]`",
    "objects.path": "a list of points `[t, x, y]`",
    "objects.velocity": "any number, or a list of 2",
    "objects.acceleration": "any number, or a list of 2",
    "trace.origin": "any number, or a list of 2",
}
"""Words for keys that accept more than one kind of value."""


def accepted(key: str, field: FieldInfo) -> str:
    """Return what a key accepts, in the words of the page."""
    annotation = field.annotation
    options = [a for a in (annotation, *get_args(annotation)) if a is not type(None)]
    if get_origin(annotation) is Literal:
        return ", ".join(
            f'`"{option}"`' if isinstance(option, str) else f"`{option}`"
            for option in get_args(annotation)
        )
    if annotation is bool:
        return "`true`, `false`"
    if annotation is str:
        return "a text" + (
            ", not empty" if any(isinstance(m, MinLen) for m in field.metadata) else ""
        )
    if key == "schemes":
        return "a list of texts, not empty"
    if key in WORDS:
        return WORDS[key]
    if key == "coverage.ripple":
        return '≥ 0, or a text such as `"0.1 N_t"`'
    for option in options:
        bare = get_args(option)[0] if get_origin(option) is Annotated else option
        if get_origin(bare) is tuple:
            return f"a list of {len(get_args(bare))} numbers"
    if get_origin(annotation) is tuple:
        return f"a list of {len(get_args(annotation))} numbers"
    low, high = bounds_of(field), bounds_of(field)
    whole = "a whole number, " if int in options or "int" in str(annotation) else ""
    match (Gt in low, Ge in low, Lt in high, Le in high):
        case (False, False, False, False):
            return "any number"
        case (True, False, False, False):
            return f"{whole}> {number(low[Gt])}"
        case (False, True, False, False):
            return f"{whole}≥ {number(low[Ge])}"
        case (False, True, False, True):
            return f"{whole}{number(low[Ge])} to {number(high[Le])}"
        case (True, False, True, False):
            return f"between {number(low[Gt])} and {number(high[Lt])}, both excluded"
        case (True, False, False, True):
            return f"{whole}> {number(low[Gt])}, at most {number(high[Le])}"
    raise AssertionError(f"{key}: no words for {field!r}")


def default_document(key: str, cell: str) -> dict[str, Any]:
    """Return a minimal scenario that has the default of the page at one key."""
    *parents, last = key.split(".")
    value = tomllib.loads(f"value = {code(cell)}")["value"]
    document: dict[str, Any] = {"name": "test"}
    if not parents:
        return document | {last: value}
    table: dict[str, Any] = {"objects": {"angle": 1.0}, "trace": {"file": "x.csv"}}.get(
        parents[0], {}
    )
    table = {**table, last: value}
    return document | {parents[0]: [table] if parents[0] == "objects" else table}


def value_at(scenario: Scenario, key: str) -> Any:
    """Return the value of a dotted key; of the first object."""
    found: Any = scenario
    for part in key.split("."):
        found = getattr(found[0] if isinstance(found, tuple) else found, part)
    return found


def test_the_page_has_every_key_of_the_scenario_file() -> None:
    keys = [code(row[0]) for row in tables(page("scenario"), "Key")]
    assert sorted(keys) == sorted(key for key, _ in scenario_fields())


@pytest.mark.parametrize(("key", "field"), [pytest.param(k, f, id=k) for k, f in scenario_fields()])
def test_a_key_is_described_as_it_is(key: str, field: FieldInfo) -> None:
    (row,) = [row for row in tables(page("scenario"), "Key") if row[0] == f"`{key}`"]
    _, unit, default, accepts, meaning = row
    assert unit == unit_of(field)
    assert accepts == accepted(key, field)
    assert len(meaning) > 5
    if field.is_required():
        assert default == "required"
    elif field.default is None:
        assert default == "none"
    else:
        documented = Scenario.model_validate(default_document(key, default))
        assert value_at(documented, key) == field.default


def test_every_key_named_anywhere_exists() -> None:
    keys = {key for key, _ in scenario_fields()}
    heads = "|".join({key.split(".")[0] for key in keys if "." in key})
    for path in TEXTS:
        named = re.findall(rf"`((?:{heads})\.[a-z_0-9]+)`", path.read_text(encoding="utf-8"))
        assert set(named) <= keys, path.name


# Results


def test_the_page_has_every_variable_as_it_is_written() -> None:
    rows = {code(row[0]): (row[1], row[2]) for row in tables(page("results"), "Variable")}
    written = VARIABLES | TRACK_VARIABLES
    assert rows == {name: (", ".join(v.dims), v.units) for name, v in written.items()}


def test_the_page_has_every_coordinate() -> None:
    made = coordinates(load_scenario("paper-single"), ["a"], 1, np.array([["omni"]]))
    rows = {code(row[0]): row[1] for row in tables(page("results"), "Coordinate")}
    assert rows == {name: ", ".join(dims) for name, (dims, _, _) in made.items()}


def test_the_page_has_every_figure_of_the_summary() -> None:
    (table,) = re.findall(r"## The summary as JSON.*?\n## ", page("results"), re.DOTALL)
    named = {name for row in tables(table, "Key") for name in re.findall(r"`(\w+)`", row[0])}
    assert named == set(SchemeSummary.__slots__)


# Schemes, methods, problems, names, rooms


def test_the_page_has_every_built_in_scheme() -> None:
    assert [code(row[0]) for row in tables(page("schemes"), "Name")] == list(registry.BUILT_IN)


def test_the_page_has_every_method_and_the_truth_about_fast() -> None:
    rows = {code(row[0]): row[1] for row in tables(page("beam-design"), "Method")}
    assert list(rows) == list(SOLVERS)
    assert ("the same as `sdp`" in rows["fast"]) == (SOLVERS["fast"] == SOLVERS["sdp"])


def test_the_page_has_every_key_of_a_problem_and_its_answer() -> None:
    keys = [code(row[0]) for row in tables(page("beam-design"), "Key")]
    assert sorted(keys) == sorted(ACCEPTED)
    (example,) = blocks(page("beam-design"), "json")
    problem = read_problem(example.text)
    answer = answer_document(echobeam.design_beams(problem))
    _, _, description = page("beam-design").partition("The answer has")
    assert set(answer) <= set(re.findall(r"`(\w+)`", description))


def test_the_interface_has_every_public_name() -> None:
    named = set(re.findall(r"echobeam\.(\w+)", page("api")))
    assert set(echobeam.__all__) <= named
    for path in re.findall(r"^::: ([\w.]+)$", page("api"), re.MULTILINE):
        home, _, name = path.rpartition(".")
        assert hasattr(__import__(home, fromlist=[name]), name), path


def test_the_interface_has_all_that_the_pages_import() -> None:
    """Public from the package itself, or listed under its own place; of a module, its functions."""
    listed = page("api")
    public = [getattr(echobeam, name) for name in echobeam.__all__]
    for path in TEXTS:
        for block in blocks(path.read_text(encoding="utf-8"), "python"):
            for node in ast.walk(ast.parse(block.text)):
                module = str(node.module) if isinstance(node, ast.ImportFrom) else ""
                names = [alias.name for alias in node.names] if module else []
                for name in names if module.startswith("echobeam") else []:
                    found = getattr(import_module(module), name)
                    known = any(found is each for each in public)
                    assert known or f"::: {module}.{name}" in listed, (path.name, name)


def test_the_rooms_are_those_of_the_import_rules() -> None:
    rules = configparser.ConfigParser()
    rules.read(ROOT / ".importlinter")
    layers = rules["importlinter:contract:rooms"]["layers"].split("\n")
    (drawn,) = [b for b in blocks(page("architecture"), "text") if b.title == "rooms"]
    rooms = [line.split("  ")[0].strip() for line in drawn.text.splitlines()]
    assert rooms == [layer.strip() for layer in layers if layer.strip()]


# Commands


def commands_of(text: str) -> list[list[str]]:
    """Return the words of every `echobeam ...` in shell blocks, up to a pipe or redirection."""
    lines = [
        line for block in blocks(text, "sh", "bash", "console") for line in block.text.splitlines()
    ]
    split = [shlex.split(line.removeprefix("$ "), comments=True) for line in lines]
    stops = {"|", ">", ">>", "&&", ";"}
    whole = []
    for words in split:
        end = next((i for i, word in enumerate(words) if word in stops), len(words))
        if words[:1] == ["echobeam"]:
            whole.append(words[1:end])
    return whole


def check_command(words: list[str], files: set[str]) -> None:
    """Check a whole command as click and the scenario would, without running it."""
    if not words or words[0].startswith("-"):
        cli.make_context("echobeam", list(words), resilient_parsing=True)
        return
    command = cli.get_command(click.Context(cli), words[0])
    assert command is not None, f"echobeam {words[0]}: no such command"
    context = command.make_context(words[0], words[1:])
    given = context.params
    if isinstance(given.get("scenario"), str):
        assert given["scenario"] in BUILT_IN or given["scenario"] in files, words
        source = given["scenario"] if given["scenario"] in BUILT_IN else "paper-multi"
        load_scenario(source, given.get("overrides", ()))
    for scheme in given.get("schemes", ()):
        name, _, parameters = scheme.partition(":")
        assert name in registry.BUILT_IN or name in files, words
        if name in registry.BUILT_IN and not any(file in parameters for file in files):
            configure(load_scenario("paper-multi"), scheme)


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.stem)
def test_commands_exist_as_they_are_written(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    files = {block.title for block in blocks(text, "python", "json", "toml")}
    files |= set(re.findall(r"> (\S+\.toml)", text))
    for words in commands_of(text):
        check_command(words, files)
    for inline in re.findall(r"`echobeam ([^`]+)`", prose(text)):
        words = shlex.split(inline)
        assert words[0] in COMMANDS or words[0].startswith("-"), inline
        command = cli.get_command(click.Context(cli), words[0])
        options = {o for p in command.params for o in p.opts} if command else {"--help"}
        assert {word for word in words[1:] if word.startswith("--")} <= options, inline


def test_the_options_of_run_are_all_there() -> None:
    command = cli.get_command(click.Context(cli), "run")
    assert command is not None
    named = {o for row in tables(page("index"), "Option") for o in re.findall(r"`(--\w+)`", row[0])}
    assert named == {o for p in command.params for o in p.opts if o.startswith("--")}
    assert [code(row[0]).split()[1] for row in tables(page("index"), "Command")] == list(COMMANDS)


def test_the_options_of_traffic_are_all_there() -> None:
    command = cli.get_command(click.Context(cli), "traffic")
    assert command is not None
    rows = tables(page("command-line"), "Option of `traffic`")
    named = {o for row in rows for o in re.findall(r"`(--[\w-]+)`", row[0])}
    options = {o for p in command.params for o in p.opts if o.startswith("--")}
    assert named == options - {"--force"}  # described with --out


def test_make_targets_exist() -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        named = re.findall(r"`make (\w+)`", text)
        named += [line[1] for b in blocks(text, "sh") if (line := re.match(r"make (\w+)", b.text))]
        assert set(named) <= targets, path.name


@pytest.mark.parametrize(
    "text",
    [
        "```sh\nechobeam fly\n```",
        "```sh\nechobeam run paper-multi --trails 3\n```",
        "```sh\nechobeam run paper-mutli\n```",
        "```sh\nechobeam run paper-multi --set uav.hight=3\n```",
        "```sh\nechobeam run paper-multi --scheme needle\n```",
        "```sh\nechobeam run\n```",
    ],
)
def test_a_command_that_lies_is_found(text: str) -> None:
    (words,) = commands_of(text)
    with pytest.raises((AssertionError, click.ClickException, ValueError)):
        check_command(words, set())


# Links


def anchors(text: str) -> set[str]:
    """Return the anchors of a page's headings and of the names that mkdocstrings puts on it."""
    headings = re.findall(r"^#+ (.+)$", prose(text), re.MULTILINE)
    slugs = {
        re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading.replace("`", "")).strip().lower())
        for heading in headings
    }
    return slugs | set(re.findall(r"^::: ([\w.]+)$", text, re.MULTILINE))


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.stem)
def test_links_lead_somewhere(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(text)):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        there = path.parent / file if file else path
        assert there.exists(), target
        if anchor:
            assert anchor in anchors(there.read_text(encoding="utf-8")), target


def test_every_page_is_in_the_navigation() -> None:
    listed = re.findall(r"^ +- .*?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(listed) == [path.name for path in PAGES]


# Snippets

LONG = ("schemes", "reproducibility", "python", "tracks", "sensing", "three-dimensions")
"""Pages whose snippets take seconds."""


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in LONG))
        for path in TEXTS
    ],
)
def test_snippets_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every Python block of a page, in order and in one namespace; a titled one is a file too.

    Two trials show as well as many whether a snippet runs.
    """
    whole = echobeam.simulate

    def two_trials(*args: Any, **options: Any) -> Any:
        return whole(*args, **options | {"trials": min(options.get("trials", 2), 2)})

    monkeypatch.setattr(echobeam, "simulate", two_trials)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names: dict[str, Any] = {"__name__": f"docs_{path.stem}"}
    text = path.read_text(encoding="utf-8")
    for block in blocks(text, "toml", "json"):
        if block.title:
            Path(block.title).write_text(block.text, encoding="utf-8")
    for number, block in enumerate(blocks(text, "python"), start=1):
        if block.title:
            Path(block.title).parent.mkdir(parents=True, exist_ok=True)
            Path(block.title).write_text(block.text, encoding="utf-8")
        place = f"{path.name}, block {number}"
        exec(compile(block.text, place, "exec", dont_inherit=True), names)


OUTPUTS = [
    pytest.param(block, id=f"{path.stem}: {block.title}", marks=[pytest.mark.slow] * slow)
    for path in TEXTS
    for block in blocks(path.read_text(encoding="utf-8"), "text")
    if block.title.startswith("echobeam ")
    for slow in [not block.title.startswith("echobeam describe ")]
]
"""Blocks whose title is the command that prints them, or of whose output they are a part."""


@pytest.mark.parametrize("block", OUTPUTS)
def test_an_output_is_what_its_command_prints(
    block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, shlex.split(block.title)[1:], catch_exceptions=False)
    assert block.text.rstrip() in done.stdout


@pytest.mark.slow
def test_snippets_have_the_types_that_they_are_given(tmp_path: Path) -> None:
    """Every Python block, a page's together, by `mypy --strict`: what is shown is typed."""
    pytest.importorskip("mypy")
    files = sorted((ROOT / "examples").glob("*.py"))
    for path in TEXTS:
        found = blocks(path.read_text(encoding="utf-8"), "python")
        files.append(tmp_path / f"page_{path.stem.lower().replace('-', '_')}.py")
        files[-1].write_text("\n".join(block.text for block in found), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", *map(str, files)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "MYPYPATH": str(ROOT / "src")},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_scheme_of_the_pages_is_found_in_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks(page("schemes"), "python"):
        if block.title:
            Path(block.title).write_text(block.text, encoding="utf-8")
    for name in ("mine.py:equal", "particles.py:particles", "road.py:road"):
        assert registry.find_scheme(name).name == name.partition(":")[2]


def test_a_schemes_example_stays_short() -> None:
    """A scheme with a belief of its own takes some sixty lines."""
    (cloud,) = [b for b in blocks(page("schemes"), "python") if b.title == "particles.py"]
    code = [line for line in cloud.text.splitlines() if line.strip()]
    assert len(code) <= 60


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings_handlers.python")
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    config = load_config(str(ROOT / "mkdocs.yml"), strict=True, site_dir=str(tmp_path))
    build(config)
    assert (tmp_path / "api" / "index.html").is_file()
    for written in tmp_path.rglob("*.html"):  # a reader without a network sees the same pages
        text = written.read_text(encoding="utf-8")
        assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"?https?:", text), written
    style = tmp_path / "vendor" / "katex" / "katex.min.css"
    fonts = re.findall(r"url\((fonts/[\w-]+\.woff2)\)", style.read_text(encoding="utf-8"))
    assert fonts
    assert all((style.parent / font).is_file() for font in fonts)


def test_the_page_of_claims_judges_every_claim() -> None:
    from echobeam.reproduction.catalogue import CLAIMS

    page = (DOCS / "claims.md").read_text(encoding="utf-8")
    judged = re.findall(r"^\| [\w-]+ \| \*\*([\w-]+)\*\*:", page, flags=re.MULTILINE)
    assert sorted(judged) == sorted(claim.id for claim in CLAIMS)
