"""Environment of a run: what its numbers depend on, by name."""

import platform
from importlib.metadata import version

import pytest

from echobeam.simulation.environment import differences, environment, processor_model

INTEL = """\
processor\t: 0
vendor_id\t: GenuineIntel
cpu family\t: 6
model\t\t: 85
model name\t: Intel(R) Xeon(R) Processor @ 2.90GHz
cpu MHz\t\t: 2900.000
flags\t\t: fpu sse2 avx avx2 {more}

processor\t: 1
vendor_id\t: GenuineIntel
"""
ARM = """\
processor\t: 0
BogoMIPS\t: 243.75
Features\t: fp asimd evtstrm
CPU implementer\t: 0x41
CPU part\t: 0xd0c
"""


def test_every_library_and_the_processor_are_named():
    named = dict(part.split(" ", 1) for part in environment().split("; "))
    assert named.pop("python") == platform.python_version()
    assert named.pop("processor").startswith(platform.machine())
    assert named == {name: version(name) for name in ("numpy", "scipy", "numba", "clarabel")}


@pytest.mark.parametrize(
    ("text", "model"),
    [
        (INTEL.format(more="avx512f"), "GenuineIntel 6 85 avx512f"),
        (INTEL.format(more="fma"), "GenuineIntel 6 85 avx2"),
        (ARM, "0x41 0xd0c asimd"),
        ("no such thing", ""),
        ("", ""),
    ],
)
def test_a_processor_is_told_by_its_model_and_widest_vectors(text, model):
    """Neither by its clock, which wanders, nor by its name, which a cloud may choose."""
    assert processor_model(text) == model


def test_differences_are_what_differs_alone():
    one, other = "python 3.11; scipy 1.12; numba 0.60", "python 3.11; scipy 1.17; clarabel 1 a"
    assert differences(one, other) == {
        "scipy": ("1.12", "1.17"),
        "numba": ("0.60", "none"),
        "clarabel": ("none", "1 a"),
    }
    assert differences(one, one) == {}
