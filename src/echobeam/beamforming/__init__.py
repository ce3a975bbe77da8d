"""Beam design: problem (38) in, beams with a proved bound out.

Read `design` first, the one door. It hands a `problem` to a method, and judges the `proposal` that
comes back by code that imports no solver. Methods differ in one function, problem to proposal:

`fast`        the `direct` solver on beams, compiled; what it leaves goes to the relaxation
`sdp`         the `relaxation`: exact for linear arrays, a bound for planar ones
`reference`   the paper's SDR + SCA + IRM through CVXPY

`expected` is a room of its own with its own door: beams for beliefs in place of angles.

`certify` examines beams and proves bounds. Shared mathematics: `coverage` and `ellipse` (the grid
of (38f)), `subspace` (real coordinates), `objective` (rates), `power` and `flat` (closed forms).
`direct` and `relaxation` do not know each other.
"""
