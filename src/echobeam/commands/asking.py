"""Requests of a user: the input of a command, with all its errors reported together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from textwrap import indent
from typing import SupportsIndex, TypeVar

from echobeam.faults import InputError
from echobeam.numerals import whole
from echobeam.scenario.built_in import BUILT_IN
from echobeam.scenario.dump import value_text
from echobeam.scenario.load import Source, load_scenario, written_schemes
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import configure_all
from echobeam.simulation.run import check_count
from echobeam.store.workers import Workers
from echobeam.store.writing import check_writable
from echobeam.traces.source import read_samples

Found = TypeVar("Found")

Settings = Mapping[str, object] | Sequence[str]
"""Overrides of a scenario: ``{"uav.height": "80 m"}``, or texts ``"uav.height=80 m"``."""


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a user, not validated yet.

    Attributes
    ----------
    source
        Scenario, name of a built-in one, or path of a scenario file.
    schemes
        Names or files; empty for the scenario's schemes.
    trials
        Number of trials; None for the scenario's.
    seed
        Seed of all randomness.
    overrides
        Texts ``KEY=VALUE``.
    trace
        Path of a trace that gives the objects' motion.
    workers
        Processes on this machine, or a cluster.
    resume, force
        Continue an interrupted run; replace existing results.
    """

    source: Source
    schemes: tuple[str, ...]
    trials: SupportsIndex | None
    seed: SupportsIndex
    overrides: tuple[str, ...]
    trace: str | None
    workers: Workers
    resume: bool
    force: bool

    def read(self, also: Sequence[Callable[[], object]] = ()) -> Asked:
        """Read and validate the scenario, its schemes and the numbers of a run.

        Parameters
        ----------
        also
            Further inputs to read; their errors are reported with the others.

        Raises
        ------
        InputError
            With all errors of the input in one message.
        """
        faults = Faults()
        for text in self.overrides:
            faults.of(_check_setting, text)
        settings = [text for text in self.overrides if "=" in text]
        scenario = faults.of(load_scenario, self.source, settings)
        if self.trace is not None:
            faults.of(_check_trace, self.trace)
            scenario = scenario and faults.of(scenario.with_trace, self.trace)
        known = scenario or load_scenario(BUILT_IN[0], ANY_PARAMETER)
        for name in self.schemes:
            faults.of(configure_all, known, [name])
        own = None if scenario is not None else written_schemes(self.source, settings)
        if not self.schemes and own != ():
            faults.of(_labelled, self._label(), configure_all, known, own)
        faults.of(check_count, 1 if self.trials is None else self.trials, 0)
        faults.of(check_count, 1, self.seed)
        for further in also:
            faults.of(further)
        faults.check()
        assert scenario is not None
        count, seed = check_count(
            scenario.trials if self.trials is None else self.trials, self.seed
        )
        return Asked(scenario, self.schemes or scenario.schemes, count, seed)

    def check_place(self, path: Path | None) -> None:
        """Refuse a path that no result can be written to; the default one is left to the run.

        Raises
        ------
        StoreError
            Names the path and the reason.
        """
        if path is not None and not (self.resume and path.is_file()):
            check_writable(path, force=self.force)

    def _label(self) -> str:
        return self.source.name if isinstance(self.source, Scenario) else fspath(self.source)


ANY_PARAMETER = {"radar.detections": "unlabelled"}
"""Change of a scenario that lets a scheme have all parameters that it has in any scenario."""


@dataclass(frozen=True, slots=True)
class Asked:
    """Validated request: scenario, schemes, number of trials and seed."""

    scenario: Scenario
    schemes: tuple[str, ...]
    trials: int
    seed: int


class Faults:
    """Collection of input errors, so that all of them are reported together."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        self.details = ""

    def of(self, read: Callable[..., Found], *arguments: object) -> Found | None:
        """Return the result of a call, or record its error and return None."""
        try:
            return read(*arguments)
        except InputError as error:
            self.messages.append(str(error))
            self.details += error.details
            return None

    def check(self) -> None:
        """Raise the recorded errors, if any.

        Raises
        ------
        InputError
            A single error unchanged, several as a list.
        """
        if len(self.messages) > 1:
            listed = "\n".join(indent(message, "  ") for message in self.messages)
            raise InputError(f"{len(self.messages)} errors in the input\n{listed}", self.details)
        if self.messages:
            raise InputError(self.messages[0], self.details)


def request(
    source: Source,
    *,
    schemes: str | Sequence[str] | None,
    scheme: str | Sequence[str] | None = None,
    trials: SupportsIndex | None,
    seed: SupportsIndex,
    set: Settings | None,
    trace: str | PathLike[str] | None,
    jobs: SupportsIndex,
    dask: str | None,
    resume: bool,
    force: bool,
) -> Request:
    """Return the request made by Python arguments, in the form of the command line's.

    Raises
    ------
    InputError
        If an argument is not accepted.
    """
    return Request(
        source,
        scheme_names(schemes, scheme),
        trials,
        seed,
        setting_texts(set),
        None if trace is None else fspath(trace),
        Workers(job_count(jobs), dask),
        resume,
        force,
    )


def scheme_names(
    schemes: str | Sequence[str] | None, scheme: str | Sequence[str] | None = None
) -> tuple[str, ...]:
    """Return the names of the requested schemes; none for the scenario's.

    Raises
    ------
    InputError
        If both arguments are given, no scheme is named, or a scheme is not a string.
    """
    if schemes is not None and scheme is not None:
        raise InputError("schemes and scheme mean the same; give only one of them")
    asked = scheme if schemes is None else schemes
    if asked is None:
        return ()
    names = (asked,) if isinstance(asked, str) or not isinstance(asked, Sequence) else tuple(asked)
    if not names:
        raise InputError("no scheme given; give at least one")
    for name in names:
        if not isinstance(name, str):
            raise InputError(
                f"scheme {name!r}: expected a name or path/to/file.py:name, so that resumed runs "
                "and other processes find it; echobeam.simulate also accepts functions and objects"
            )
    return names


def setting_texts(settings: Settings | None) -> tuple[str, ...]:
    """Return overrides as strings ``KEY=VALUE`` that are read back as the same values.

    Raises
    ------
    InputError
        If a scenario file cannot hold a value.
    """
    if settings is None:
        return ()
    if isinstance(settings, str):
        return (settings,)
    if not isinstance(settings, Mapping):
        return tuple(settings)
    return tuple(f"{key}={_text(key, value)}" for key, value in settings.items())


def _text(key: str, value: object) -> str:
    try:
        return value_text(value)
    except TypeError:
        raise InputError(
            f"--set {key}: {value!r} is not accepted; expected a string, a number, true, false or "
            "a list of them"
        ) from None


def job_count(jobs: SupportsIndex) -> int:
    """Return the number of processes as an int.

    Raises
    ------
    InputError
        If it is not a positive whole number.
    """
    count = whole(jobs)
    if count is None or count < 1:
        raise InputError(f"jobs: {jobs!r} is not accepted; expected a whole number from 1")
    return count


def target(
    out: str | PathLike[str] | None, source: Source, scenario: Scenario, ending: str
) -> Path:
    """Return the path of a result: as given, or in the current directory by the default name.

    That is the name of the scenario's file, since an edited copy may have kept the name inside,
    or the scenario's own name, with the ending.
    """
    if out is not None:
        return Path(out)
    if isinstance(source, Scenario) or source in BUILT_IN:
        return Path(scenario.name + ending)
    return Path(Path(source).stem + ending)


def _labelled(label: str, read: Callable[..., Found], *arguments: object) -> Found:
    """Return the result of a call; prefix its error with a label."""
    try:
        return read(*arguments)
    except InputError as error:
        raise InputError(
            "\n".join(f"{label}: {line}" for line in str(error).splitlines()), error.details
        ) from None


def _check_trace(path: str) -> None:
    """Refuse a trace that is not there; others are read with the run."""
    if not Path(path).exists():
        next(read_samples(path), None)


def _check_setting(text: str) -> None:
    """Refuse an override that is not ``KEY=VALUE``; the others are read with the scenario."""
    if not isinstance(text, str) or "=" not in text:
        raise InputError(f"--set {text}: expected KEY=VALUE, such as uav.height='80 m'")
