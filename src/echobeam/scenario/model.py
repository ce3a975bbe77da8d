"""Scenario: everything that is simulated, typed, frozen and validated."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from echobeam.brief import html_table
from echobeam.scenario.built_in import ships
from echobeam.scenario.checking import ScenarioError, checked, override
from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.geometry import check_background, check_geometry
from echobeam.scenario.quantities import FrozenMapping, SchemeParameters, ripple_value
from echobeam.scenario.tables import (
    DEFAULT_SCHEMES,
    DIRECTIONAL,
    PARAMETERS,
    ArrayTable,
    Count,
    CoverageTable,
    FilterTable,
    FrameTable,
    ObjectTable,
    RadarTable,
    RadioTable,
    Table,
    TraceTable,
    TracksTable,
    TruthTable,
    UavTable,
)

LONGEST_NAME = 200
"""Bytes of a scenario's name: most file systems take 255 in a file's, which has a suffix more."""

MOST_SAMPLES = 1 << 22
"""Samples of a slot's echo signal over all antennas: 64 MB in each of some ten arrays."""

FEWEST_SUBCARRIERS = 29
"""Cells of the CFAR along the delay: one under test, 4 guard and 24 training cells."""


GeometryName = Literal["road", "ground"]


class Scenario(Table):
    """Complete, validated scenario; see the scenario file's reference in the documentation."""

    name: Annotated[str, Field(min_length=1)]
    description: str = ""
    schemes: tuple[Annotated[str, Field(min_length=1)], ...] = DEFAULT_SCHEMES
    trials: Count = 200
    """Trials that a run makes unless told otherwise."""
    geometry: GeometryName = "road"
    """The paper's vertical plane above a road, or the ground in two dimensions."""
    array: ArrayTable = ArrayTable()
    radio: RadioTable = RadioTable()
    radar: RadarTable = RadarTable()
    uav: UavTable = UavTable()
    objects: tuple[ObjectTable, ...] = ()
    frame: FrameTable = FrameTable()
    filter: FilterTable = FilterTable()
    coverage: CoverageTable = CoverageTable()
    tracks: TracksTable = TracksTable()
    truth: TruthTable = TruthTable()
    trace: TraceTable | None = None
    scheme_parameters: SchemeParameters = FrozenMapping({})
    """Parameters of schemes, by name; in a file ``[schemes.NAME]`` in place of ``schemes``."""

    @model_validator(mode="before")
    @classmethod
    def _split_schemes(cls, document: Any) -> Any:
        """Read ``schemes`` as a list of names, or as tables of parameters in the order run."""
        if not isinstance(document, Mapping) or not isinstance(document.get("schemes"), Mapping):
            return document
        tables = document["schemes"]
        return {**document, "schemes": tuple(tables), PARAMETERS: tables}

    @model_validator(mode="after")
    def _check_parameters(self) -> Scenario:
        """Refuse parameters of schemes that do not run: no file can say so."""
        if self.scheme_parameters and tuple(self.scheme_parameters) != self.schemes:
            raise ValueError(
                f"{PARAMETERS}: for {', '.join(self.scheme_parameters)}; expected all schemes in "
                f"their order, {', '.join(self.schemes)}"
            )
        return self

    @model_validator(mode="after")
    def _check_geometry(self) -> Scenario:
        """Refuse keys of the other geometry, and motions that cannot be."""
        check_geometry(self)
        return self

    @model_validator(mode="after")
    def _check_movers(self) -> Scenario:
        """Refuse two answers to what moves the objects."""
        if self.trace is not None and self.objects:
            raise ValueError("objects: not together with a trace; remove one of the two")
        return self

    @model_validator(mode="after")
    def _check_terrain(self) -> Scenario:
        """Refuse ground that is above the UAV."""
        height, key = self.uav.height, "uav.height"
        if self.geometry == "ground":
            height, key = self.uav.lowest(self.frame.slot * self.n_slots), "the UAV's lowest height"
        if self.truth.terrain >= height:
            raise ValueError(
                f"truth.terrain: {self.truth.terrain:g} m is not accepted; expected below "
                f"{key}, {height:g} m"
            )
        return self

    @model_validator(mode="after")
    def _check_headings(self) -> Scenario:
        """Refuse an object at rest whose cross-section depends on its heading."""
        if self.radar.target in DIRECTIONAL:
            for number, item in enumerate(self.objects):
                if item.rests:
                    still = "velocity: 0 m/s" if item.path is None else "path: one that stays"
                    raise ValueError(
                        f"objects.{number}.{still} is no heading, on which the echo of "
                        f"radar.target = {self.radar.target!r} depends; expected a motion, "
                        "or a target that is alike from all sides: constant, swerling1, "
                        "3gpp-human, 3gpp-small-uav"
                    )
        return self

    @model_validator(mode="after")
    def _check_signal(self) -> Scenario:
        """Refuse signals that do not fit in memory, or too short for orthogonal streams."""
        elements = self.radar.subcarriers * self.radar.symbols
        antennas = max(self.array.n_tx, self.array.receivers)
        check_background(self)
        if self.radar.model != "signal":
            return self
        if self.radar.clutter > 0.0:
            raise ValueError(
                f"radar.clutter: {self.radar.clutter:g} is not accepted with signals; expected 0: "
                "the ground echoes with radar.ground_clutter"
            )
        if elements * antennas > MOST_SAMPLES:
            raise ValueError(
                f"radar.subcarriers x radar.symbols: {elements} resource elements on {antennas} "
                f"antennas; expected at most {MOST_SAMPLES} samples in all"
            )
        if self.radar.subcarriers < FEWEST_SUBCARRIERS:
            raise ValueError(
                f"radar.subcarriers: {self.radar.subcarriers} is not accepted with signals; "
                f"expected at least {FEWEST_SUBCARRIERS}, the cells of the threshold's window"
            )
        if elements < self.array.n_tx:
            raise ValueError(
                f"radar.subcarriers x radar.symbols: {elements} resource elements; expected at "
                f"least one for each of the {self.array.n_tx} transmit antennas"
            )
        return self

    @field_validator("name")
    @classmethod
    def _check_name(cls, name: str) -> str:
        """Refuse a name that would be a path: results are named after it."""
        if any(mark in name for mark in "/\\") or name in (".", ".."):
            raise ValueError(f"{name!r} is not accepted; expected a name without a slash")
        if not name.strip() or not name.isprintable():
            raise ValueError(f"{name!r} is not accepted; expected a name of printable characters")
        if len(name.encode()) > LONGEST_NAME:
            raise ValueError(
                f"{name[:20]!r}... is not accepted; expected a name of at most {LONGEST_NAME} bytes"
            )
        return name

    def replace(self, overrides: Mapping[str, object]) -> Scenario:
        """Return the scenario with some keys replaced, validated like a file.

        Parameters
        ----------
        overrides
            Dotted keys and their values, units allowed: ``{"uav.height": "80 m"}``.

        Raises
        ------
        ScenarioError
            Names every key that is at fault, its value and what is accepted.
        """
        if not isinstance(overrides, Mapping):
            raise ScenarioError(
                f"{overrides!r} is not accepted; expected dotted keys and their values, such as "
                '{"uav.height": "80 m"}'
            )
        document = tomllib.loads(self.to_toml())
        if self.trace is not None:  # whose name may hold bytes that no text can
            document["trace"]["file"] = self.trace.file
        faults = [fault for item in overrides.items() if (fault := override(document, *item))]
        scenario = checked(Scenario, document, self.name, faults)
        return scenario.located(Path()) if "trace.file" in overrides else scenario

    def with_trace(self, path: str | Path) -> Scenario:
        """Return the scenario with its objects moved by another trace file."""
        table = self.trace.model_dump() if self.trace is not None else {}
        if self.trace is None and self.objects:
            table["max_objects"] = len(self.objects)
        place = str(Path(path).absolute())
        document = self.model_dump(exclude_unset=True) | {
            "objects": (),
            "trace": table | {"file": place},
        }
        return Scenario.model_validate(document)

    def located(self, folder: Path) -> Scenario:
        """Return the scenario with its trace's whole path, if that is relative to a folder."""
        if self.trace is None:
            return self
        beside = folder / self.trace.file
        if ships(self.trace.file) and not beside.is_file():
            return self
        return self.with_trace(beside)

    def to_toml(self) -> str:
        """Return the complete TOML text; loading it gives an equal scenario, bit for bit."""
        return dump_scenario(self)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy, see the tables; other schemes do not keep the parameters of the old."""
        if update and "schemes" in update:
            update = {PARAMETERS: {}, **update}
        return super().model_copy(update=update, deep=deep)

    def __repr__(self) -> str:
        """Return a line: name, objects, antennas, slots and schemes."""
        moved = "a trace" if self.trace is not None else f"{len(self.objects)} object(s)"
        return (
            f"<Scenario {self.name}: {moved}, {self.array.n_tx} antennas, {self.n_slots} slots, "
            f"schemes {', '.join(self.schemes)}>"
        )

    def _repr_html_(self) -> str:
        """Return the key numbers as a table, for notebooks; `to_toml` says all."""
        moved = {"trace": self.trace.file} if self.trace else {"objects": len(self.objects)}
        array, frame = self.array, self.frame
        rows = {
            "description": self.description,
            "schemes": ", ".join(self.schemes),
            **moved,
            "antennas": f"{array.n_tx} to send, {array.receivers} to receive",
            "carrier": f"{self.radio.carrier / 1e9:g} GHz",
            "height": f"{self.uav.start(self.geometry)[2]:g} m",
            "slots": f"{frame.frames} x {frame.slots_per_frame} of {1e3 * frame.slot:g} ms",
            "trials": self.trials,
        }
        return html_table(f"Scenario {self.name}", rows)

    def __str__(self) -> str:
        """Return the same line."""
        return repr(self)

    @property
    def n_slots(self) -> int:
        """Slots of a run, over all frames."""
        return self.frame.slots_per_frame * self.frame.frames

    @property
    def n_objects(self) -> int:
        """K: the most objects that are in the scene at once."""
        return self.trace.max_objects if self.trace is not None else len(self.objects)

    @property
    def unlabelled(self) -> bool:
        """Whether detections are unlabelled: the UAV has tracks of its own, not a roster."""
        return self.radar.detections == "unlabelled"

    @property
    def calm(self) -> Scenario:
        """The scenario without random numbers in the motion and in the height of the ground."""
        return self.replace({"truth.process_noise": False, "truth.altitude_errors": False})

    @property
    def truth_stds(self) -> tuple[float, float, float]:
        """Standard deviations of nature's process noise for each slot, rad, m, m/s."""
        own, believed = self.truth, self.filter
        return (
            believed.angle_std if own.angle_std is None else own.angle_std,
            believed.distance_std if own.distance_std is None else own.distance_std,
            believed.velocity_std if own.velocity_std is None else own.velocity_std,
        )

    @property
    def ripple(self) -> float:
        """B of (38f) as a number."""
        return ripple_value(self.coverage.ripple, self.array.n_tx)
