"""Schemes: what the UAV knows and decides.

A scheme is a choice of three parts, and most files here hold one kind of part:

- `frames`: when to look around and when to send beams,
- `trackers`: how detections become a belief about every object, and how it is predicted,
- `beamers`: how a belief becomes beams.

`parts.SchemeOfParts` runs any choice of them; `temporal`, `water_filling`, `pilot` and `omni` name
the paper's choices, `genie` is a whole scheme of its own. Read `base` first: it has the contract
that every scheme keeps. `registry` finds schemes and parts by name, `configure` gives them their
parameters, `doors` turns a user's function into a scheme.
"""

from __future__ import annotations

import sys
from types import ModuleType


class _Room(ModuleType):
    """Package that returns the names of its schemes when it is called: `echobeam.schemes()`."""

    def __call__(self) -> list[str]:
        from echobeam.schemes.registry import schemes

        return schemes()


sys.modules[__name__].__class__ = _Room
