"""Traces from the traffic simulator SUMO: a straight road and its vehicles.

Read `making` first. A `plan` says who enters when and where; `documents` writes the simulator's
input, `simulator` runs its programs, and `making` writes the trace while it is simulated. SUMO is
an optional package and runs as a process of its own: nothing here imports it.
"""
