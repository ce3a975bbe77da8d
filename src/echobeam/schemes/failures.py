"""Failures of users' code: the line at fault, and the user's part of the traceback.

User's code is what lies neither in this package nor in Python's library nor, if anything else is
left, among installed packages. A plugged-in scheme is itself an installed package: its frames are
those of the package that was entered first.
"""

from __future__ import annotations

import inspect
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from traceback import FrameSummary, StackSummary, TracebackException, extract_tb

_PACKAGE = Path(__file__).resolve().parents[1]
_LIBRARY = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib"))
_INSTALLED = ("site-packages", "dist-packages")
_LOADERS = ("importlib_metadata",)
"""Installed packages that may stand in for Python's own when a scheme is loaded."""


def failure(error: BaseException) -> str:
    """Return an error in one line: ``file, line N, in function: Type: message``."""
    place = _place(error)
    try:
        text = str(error)
    except Exception:  # a user's exception may have any method
        text = "without a text that could be printed"
    if isinstance(error, SyntaxError) and error.msg:
        text = error.msg  # its text repeats file and line
    said = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return f"{place}: {said}" if place else said


def written_at(function: object) -> str:
    """Return ``file, line N: `` of a function that is written in Python, empty for others."""
    code = getattr(inspect.unwrap(function), "__code__", None)  # type: ignore[arg-type]
    return f"{_short(code.co_filename)}, line {code.co_firstlineno}: " if code else ""


def is_users(error: BaseException) -> bool:
    """Whether an error was raised in a user's code, or in what that called."""
    return bool(_own(extract_tb(error.__traceback__)))


def users_traceback(error: BaseException) -> str:
    """Return the traceback from the user's first line on; all of it if there is none."""
    whole = TracebackException.from_exception(error)
    own = _own(whole.stack)
    if own or _unread(error):
        whole.stack = StackSummary.from_list(list(whole.stack)[own[0] :] if own else [])
    return "".join(whole.format())


def _unread(error: BaseException) -> bool:
    """Whether a file could not even be read as Python: its own line is in no stack."""
    return (
        isinstance(error, SyntaxError)
        and error.filename is not None
        and Path(error.filename).is_file()
    )


def _place(error: BaseException) -> str:
    """Return file, line and function of the innermost line of the user's code, if any."""
    if _unread(error):
        assert isinstance(error, SyntaxError)
        return f"{_short(str(error.filename))}, line {error.lineno}"
    stack = extract_tb(error.__traceback__)
    own = _own(stack)
    if not own:
        return ""
    frame = stack[own[-1]]
    function = "" if frame.name == "<module>" else f", in {frame.name}"
    return f"{_short(frame.filename)}, line {frame.lineno}{function}"


def _own(stack: Sequence[FrameSummary]) -> list[int]:
    """Return the places in a stack of the user's code, outermost first."""
    outside = [index for index, frame in enumerate(stack) if _is_outside(frame.filename)]
    written = [index for index in outside if _distribution(stack[index].filename) is None]
    if written or not outside:
        return written
    entered = _distribution(stack[outside[0]].filename)
    return [index for index in outside if _distribution(stack[index].filename) == entered]


def _is_outside(filename: str) -> bool:
    """Whether a file is neither ours nor Python's own."""
    if filename.startswith("<frozen"):
        return False
    path = Path(filename)
    if _PACKAGE in path.parents or _distribution(filename) in _LOADERS:
        return False
    return _distribution(filename) is not None or not any(
        library in path.parents for library in _LIBRARY
    )


def _distribution(filename: str) -> str | None:
    """Return the name below the folder of installed packages; None if it is not among them."""
    parts = Path(filename).parts
    places = [index for index, part in enumerate(parts) if part in _INSTALLED]
    return parts[places[-1] + 1] if places else None


def _short(filename: str) -> str:
    """Return a path as it would be typed here."""
    path = Path(filename)
    try:
        return str(path.relative_to(Path.cwd()))
    except (ValueError, OSError):
        return filename
