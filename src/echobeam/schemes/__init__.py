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
