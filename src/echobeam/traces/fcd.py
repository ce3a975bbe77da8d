"""SUMO floating-car data: ``<fcd-export><timestep time=".."><vehicle id x y speed/>...``.

The file is parsed by expat in chunks without a tree, so memory does not grow with the file.
Document types are refused, and with them all expandable entities. Persons and containers are
ignored; coordinates must be metres (SUMO writes degrees under
``--fcd-output.geo``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.parsers import expat

from echobeam.traces.sample import Sample, TraceError, fault, read_number


def fcd_samples(chunks: Iterable[bytes], path: Path) -> Iterator[Sample]:
    """Yield the samples of an FCD file in the order of the file.

    Parameters
    ----------
    chunks
        XML, decompressed, in chunks.
    path
        The file's name, for messages.

    Raises
    ------
    TraceError
        If the XML is damaged, truncated, has a document type or is not an FCD export, if a value
        is missing or not a number, or if a time step goes back in time.
    """
    reader = _FcdReader(path)
    for chunk in chunks:
        reader.feed(chunk)
        yield from reader.samples
        reader.samples.clear()
    reader.close()


class _FcdReader:
    """Handlers of expat with their shared state."""

    def __init__(self, path: Path) -> None:
        self.samples: list[Sample] = []
        self._path = path
        self._in_export = False
        self._time: float | None = None
        self._last_time = float("-inf")
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype

    def feed(self, chunk: bytes) -> None:
        try:
            self._parser.Parse(chunk, False)
        except LookupError as error:  # the codec that the declaration names
            raise fault(self._path, 1, f"{error}; accepted is UTF-8") from None
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise fault(
                self._path, error.lineno, f"damaged XML ({reason}); accepted is a SUMO FCD export"
            ) from None

    def close(self) -> None:
        try:
            self._parser.Parse(b"", True)
        except expat.ExpatError as error:
            raise fault(
                self._path, error.lineno, "the file is cut off before </fcd-export>"
            ) from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "vehicle" and self._in_export:
            self.samples.append(self._sample(attributes))
        elif tag == "timestep" and self._in_export:
            self._begin_timestep(attributes)
        elif tag == "fcd-export":
            self._in_export = True
        elif not self._in_export:
            raise self._fault(f"<{tag}> is not a SUMO FCD export; accepted is <fcd-export>")

    def _end(self, tag: str) -> None:
        if tag == "timestep":
            self._time = None

    def _begin_timestep(self, attributes: dict[str, str]) -> None:
        time = self._number(attributes, "timestep", "time")
        if time < self._last_time:
            raise self._fault(
                f"timestep {time:g} goes back in time, after {self._last_time:g}; accepted are "
                "time steps in increasing order"
            )
        self._time = self._last_time = time

    def _sample(self, attributes: dict[str, str]) -> Sample:
        if self._time is None:
            raise self._fault("<vehicle> outside a <timestep>; accepted only inside one")
        name = attributes.get("id", "")
        if not name:
            raise self._fault("<vehicle> without id; accepted is a non-empty id")
        return Sample(
            self._time,
            name,
            self._number(attributes, "vehicle", "x"),
            self._number(attributes, "vehicle", "y"),
            self._number(attributes, "vehicle", "speed") if "speed" in attributes else float("nan"),
            self._parser.CurrentLineNumber,
        )

    def _number(self, attributes: dict[str, str], tag: str, column: str) -> float:
        text = attributes.get(column)
        if text is None:
            raise self._fault(f'<{tag}> without {column}; accepted is {column}="number"')
        return read_number(self._path, self._parser.CurrentLineNumber, column, text)

    def _refuse_doctype(self, name: str, *_: object) -> None:
        raise self._fault(
            f"document type {name!r} refused (its entities could be made to expand without end); "
            "accepted is XML without <!DOCTYPE>"
        )

    def _fault(self, text: str) -> TraceError:
        return fault(self._path, self._parser.CurrentLineNumber, text)
