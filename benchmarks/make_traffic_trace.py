"""Make the shipped trace of the scenario `traffic` with the traffic simulator SUMO.

A straight road of 600 m with two lanes, one minute, a sample every half second: cars of mixed
speeds, slow trucks, some vehicles that join the road or leave it half way, and one car that stops
in the right lane for a while.

    pip install -e '.[sumo]'
    python benchmarks/make_traffic_trace.py

writes src/echobeam/scenario/presets/traffic-trace.xml.gz; an argument gives another place. The
seed is fixed, and the same version of SUMO gives the same XML.
"""

from __future__ import annotations

import gzip
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

SEED = 7
WARM_UP = 60  # s, until the road has filled
DURATION = 60  # s
OUTPUT = Path(__file__).parents[1] / "src/echobeam/scenario/presets/traffic-trace.xml.gz"

NODES = """<nodes>
  <node id="west" x="0" y="0"/><node id="east" x="600" y="0"/>
</nodes>"""

EDGES = """<edges>
  <edge id="road" from="west" to="east" numLanes="2" speed="22.2"/>
</edges>"""

ROUTES = """<routes>
  <vType id="car" vClass="passenger" accel="2.6" decel="4.5" sigma="0.5"
         speedFactor="normc(0.7,0.12,0.45,1.0)"/>
  <vType id="truck" vClass="truck" accel="1.1" decel="4.0" sigma="0.3" maxSpeed="9.5"/>
  <flow id="car" type="car" begin="0" end="130" probability="0.22" from="road" to="road"
        departLane="best" departSpeed="desired"/>
  <flow id="truck" type="truck" begin="4" end="130" period="26" from="road" to="road"
        departLane="0" departSpeed="desired"/>
  <flow id="leaves" type="car" begin="48" end="120" period="19" from="road" to="road"
        departLane="best" departSpeed="desired" arrivalPos="340"/>
  <vehicle id="stops" type="car" depart="56" departLane="0" departSpeed="desired">
    <route edges="road"/>
    <stop lane="road_0" endPos="320" duration="12"/>
  </vehicle>
  <flow id="joins" type="car" begin="66" end="120" period="17" from="road" to="road"
        departLane="0" departPos="280" departSpeed="0"/>
</routes>"""


def make_trace() -> bytes:
    """Return the trace as XML."""
    import sumo

    tools = Path(sumo.SUMO_HOME) / "bin"
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name, text in (("nodes", NODES), ("edges", EDGES), ("routes", ROUTES)):
            (place / f"{name}.xml").write_text(text)
        build = "-n nodes.xml -e edges.xml -o net.xml"
        simulate = (
            f"-n net.xml -r routes.xml --seed {SEED} --step-length 0.1 --step-method.ballistic "
            f"--begin 0 --end {WARM_UP + DURATION + 0.1} --no-step-log --precision 3 "
            "--fcd-output fcd.xml --fcd-output.attributes id,x,y,speed,type,lane "
            f"--device.fcd.begin {WARM_UP} --device.fcd.period 0.5"
        )
        for tool, options in (("netconvert", build), ("sumo", simulate)):
            subprocess.run(
                [tools / tool, *options.split()], cwd=place, check=True, stdout=subprocess.DEVNULL
            )
        return with_own_comment((place / "fcd.xml").read_bytes())


def with_own_comment(xml: bytes) -> bytes:
    """Replace SUMO's header comment, which holds the date and the paths of this machine."""
    comment = f"<!-- SUMO {version('eclipse-sumo')}, benchmarks/make_traffic_trace.py -->"
    return re.sub(rb"<!--.*?-->", comment.encode(), xml, count=1, flags=re.DOTALL)


def main() -> None:
    """Write the trace; no name and no time go into the gzip header."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else OUTPUT
    target.write_bytes(gzip.compress(make_trace(), 9, mtime=0))
    print(f"{target}: {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
