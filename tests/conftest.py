"""Hypothesis without deadlines, and with the same examples in every run.

So a verdict is about the code and not about the machine's load or a draw; `pytest
--hypothesis-profile explore` draws anew.

A shell starts background jobs with interruptions ignored, and processes inherit that: tests of
interruptions have to undo it.
"""

import os
import signal

from hypothesis import settings

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before NumPy is loaded: as many workers as cores

settings.register_profile("fixed", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None)
settings.load_profile("fixed")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
