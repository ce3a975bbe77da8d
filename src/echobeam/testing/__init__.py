"""The kit that any scheme can be put through, ours and users' own."""

from echobeam.testing.conformance import check_scheme

__all__ = ["check_scheme"]
