"""A synthetic result with the contract's shape, for the tests of the pictures.

The numbers are plausible (geometry, shrinking errors, beams that widen with the error), so that
the pictures made from it can be judged by eye, but nothing here comes from the simulation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

STATES = ["angle", "distance", "velocity"]
MEASUREMENTS = ["angle", "delay", "doppler"]
MODES = ["omni", "directional", "pilot"]
C = 299792458.0

SCENARIO = """\
name = "{name}"
schemes = ["temporal", "pilot"]
[array]
n_tx = {n_tx}
spacing = 0.5
axis = "vertical"
[radio]
carrier = "30 GHz"
power = {power}
noise = 1.0
alpha0 = 1.0
[uav]
height = "{height} m"
speed = "{speed} m/s"
heading = "-90 deg"
[frame]
slot = "10 ms"
slots_per_frame = {per_frame}
frames = {frames}
[coverage]
width = 3.0
"""


def build_result(
    schemes: Sequence[str] = ("temporal", "pilot"),
    trials: int = 30,
    slots: int = 10,
    angles: Sequence[float] = (75.0, 135.0),
    velocities: Sequence[float] = (30.0, -3.0),
    n_tx: int = 30,
    per_frame: int = 10,
    height: float = 100.0,
    speed: float = 15.0,
    power: float = 1.0,
    seed: int = 0,
    name: str = "paper-multi",
    coming_and_going: bool = False,
    with_bound: bool = False,
) -> xr.Dataset:
    """Return a result; ``angles`` in degrees, one object each."""
    rng = np.random.default_rng(seed)
    K, S, T = len(angles), len(schemes), trials
    time = 0.01 * np.arange(slots)
    v = np.array(velocities[:K], dtype=float)
    x0 = height / np.tan(np.deg2rad(np.array(angles, dtype=float)))
    x = x0 + v * time[:, None]
    z = np.broadcast_to((height - speed * time)[:, None], x.shape)
    state = np.stack([np.arctan2(z, x), np.hypot(x, z), np.broadcast_to(v, x.shape)], axis=-1)
    truth = np.broadcast_to(state, (T, slots, K, 3)).copy()
    present = np.ones((T, slots, K), dtype=bool)
    if coming_and_going:
        for k in range(K):
            first = (k * slots) // (2 * max(K, 1))
            present[:, :first, k] = False
            present[:, first + slots // 2 :, k] = False
    truth[~present] = np.nan

    since = np.arange(slots) % per_frame
    omni = since == 0
    phase = np.where(omni, "omni", "directional")
    phases = np.array([_phases(scheme, phase) for scheme in schemes]).reshape(S, slots)
    shape = (S, T, slots, K)
    out = {
        "predicted": np.full((*shape, 3), np.nan),
        "estimated": np.full((*shape, 3), np.nan),
        "estimated_cov": np.full((*shape, 3, 3), np.nan),
        "measured": np.full((*shape, 3), np.nan),
        "measured_var": np.full((*shape, 3), np.nan),
        "beam": np.full((*shape, n_tx, 2), np.nan),
        "sinr": np.full(shape, np.nan),
        "covered": np.full(shape, np.nan),
    }
    fallback = np.zeros((S, T, slots), dtype=bool)
    noise = rng.standard_normal((T, slots, K, 3))
    for s, scheme in enumerate(schemes):
        _fill(out, s, scheme, truth, noise, omni, n_tx, power)
    out["predicted_cov"] = 1.5 * out["estimated_cov"]
    out["true_var"] = out["measured_var"].copy()
    out["radar_snr"] = 1e3 * out["sinr"]
    out["rate"] = np.log2(1 + out["sinr"])
    for s, scheme in enumerate(schemes):
        if scheme.startswith("pilot"):
            out["rate"][s][:, omni] = 0.0
    for values in out.values():
        values[np.broadcast_to(~present.reshape(1, *present.shape), shape)] = np.nan
    result = _label(out, truth, present, schemes, phases, time)
    modes = np.array([MODES.index(str(one)) for one in phases.flat], dtype=np.int8)
    modes = np.broadcast_to(modes.reshape(S, 1, slots), (S, T, slots))
    result["mode"] = (("scheme", "trial", "slot"), modes.copy())
    identity = np.where(present, np.arange(K), -1)
    result["identity"] = (("trial", "slot", "object"), identity)
    place = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=-1)
    place = np.where(present[..., None], place, np.nan)
    result["position"] = (("trial", "slot", "object", "axis"), place)
    uav = np.stack([0 * time, 0 * time, height - speed * time], axis=-1)
    result["uav_position"] = (("slot", "axis"), uav)
    result["uav_velocity"] = (("slot", "axis"), np.tile([0.0, 0.0, -speed], (slots, 1)))
    result["fallback"] = (("scheme", "trial", "slot"), fallback)
    result.attrs = {
        "scenario": SCENARIO.format(
            name=name, n_tx=n_tx, power=power, height=height, speed=speed,
            per_frame=per_frame, frames=max(1, slots // per_frame),
        ),
        "names": [f"object {k + 1}" for k in range(K)],
        "seed": seed, "echobeam_version": "0", "created": "2024-01-01T00:00:00+00:00",
    }  # fmt: skip
    if with_bound:
        # Every trial has the same covariance.
        bound = np.sqrt(np.einsum("...ii->...i", out["estimated_cov"][:, 0]))
        result["bound"] = (("scheme", "slot", "object", "state"), 0.8 * bound)
    return result


def _phases(scheme: str, phase: np.ndarray) -> np.ndarray:
    if scheme == "omni":
        return np.full(phase.shape, "omni", dtype="<U11")
    return np.where(phase == "omni", "pilot", phase) if scheme.startswith("pilot") else phase


def _fill(out, s, scheme, truth, noise, omni, n_tx, power):
    """Fill one scheme's arrays: the mean of all measurements so far, or the pilot's held."""
    slots, K = truth.shape[1:3]
    held = scheme.startswith("pilot")
    std = np.array([np.deg2rad(4.0), 1.5, 30.0])
    for n in range(slots):
        count = 1 if held else n + 1
        error = 0.0 * noise[:, n] if scheme == "genie" else std * noise[:, :count].mean(axis=1)
        spread = std / np.sqrt(count)
        out["estimated"][s, :, n] = truth[:, n] + error
        out["estimated_cov"][s, :, n] = np.diag(spread**2)
        if omni[n] or not held:
            out["measured"][s, :, n, :, 0] = truth[:, n, :, 0] + std[0] * noise[:, n, :, 0]
            out["measured_var"][s, :, n] = std**2
        else:
            out["measured_var"][s, :, n] = np.inf
        believed = out["estimated"][s, :, n - 1] - truth[:, n - 1] + truth[:, n]
        if n and scheme != "pilot":
            out["predicted"][s, :, n] = believed
        d = truth[:, n, :, 1]
        if omni[n] or scheme == "omni":
            gain = np.full(d.shape, power / max(K, 1))
        else:
            aim = truth[:, n, :, 0] if scheme == "genie" else believed[..., 0]
            active = n_tx if scheme in ("genie", "water-filling") else _aperture(n, held, n_tx)
            m = np.arange(n_tx)
            w = np.exp(1j * np.pi * m * np.sin(aim)[..., None]) * (m < active)
            w *= np.sqrt(power / max(K, 1) / active)
            out["beam"][s, :, n] = np.stack([w.real, w.imag], axis=-1)
            if scheme not in ("genie", "water-filling"):
                out["covered"][s, :, n] = 3.0 * std[0]
            a = np.exp(1j * np.pi * m * np.sin(truth[:, n, :, 0])[..., None])
            gain = np.abs((a.conj() * w).sum(axis=-1)) ** 2
        out["sinr"][s, :, n] = gain / d**2


def _aperture(n: int, held: bool, n_tx: int) -> int:
    return max(1, n_tx // 5) if held else min(n_tx, n_tx // 5 + 4 * n)


def _label(out, truth, present, schemes, phases, time) -> xr.Dataset:
    common = ("scheme", "trial", "slot", "object")
    last = {
        "predicted": ("state",), "estimated": ("state",),
        "predicted_cov": ("state", "state_b"), "estimated_cov": ("state", "state_b"),
        "measured": ("measurement",), "measured_var": ("measurement",),
        "true_var": ("measurement",), "covered": (),
        "beam": ("antenna", "part"), "sinr": (), "rate": (), "radar_snr": (),
    }  # fmt: skip
    variables = {name: ((*common, *last[name]), values) for name, values in out.items()}
    variables["truth"] = (("trial", "slot", "object", "state"), truth)
    variables["present"] = (("trial", "slot", "object"), present)
    return xr.Dataset(
        variables,
        coords={
            "scheme": list(schemes),
            "slot": np.arange(1, len(time) + 1),
            "time": ("slot", time),
            "state": STATES,
            "measurement": MEASUREMENTS,
            "part": ["re", "im"],
            "axis": ["x", "y", "z"],
            "phase": (("scheme", "slot"), phases),
        },
    )


def build_unlabelled(
    schemes: Sequence[str] = ("temporal", "pilot"), axis: str = "vertical", **options
) -> xr.Dataset:
    """Return a result with tracks: options as of `build_result`, whose objects come and go.

    The track of an object has its number. It is born tentative in the slot after the object
    appears, is confirmed in the next, and coasts for two slots after the object has left. One
    more track is of nobody and confirmed in slots 4 to 6, and one is tentative in slot 2 alone.
    A track is in another column in every slot.
    """
    result = build_result(schemes, coming_and_going=True, **options)
    result.attrs["scenario"] = (
        result.attrs["scenario"].replace('"vertical"', f'"{axis}"')
        + '[radar]\ndetections = "unlabelled"\n'
    )
    truth = result["truth"].values
    present = result["present"].values
    trials, slots, K = present.shape
    C, shape = K + 2, (result.sizes["scheme"], trials, slots, K + 2)
    id, about = (np.full(shape, -1) for _ in range(2))
    status, state = np.zeros(shape, dtype=np.int8), np.full((*shape, 3), np.nan)

    def put(track, slot, stage, whom, where):
        column = (track + slot) % C
        id[..., slot, column], status[..., slot, column] = track, stage
        about[..., slot, column], state[..., slot, column, :] = whom, where

    for k in range(K):
        there = np.flatnonzero(present[0, :, k])
        for slot in range(there[0] + 1, min(there[-1] + 3, slots)):
            stage = 1 if slot == there[0] + 1 else 2 if slot <= there[-1] else 3
            last = min(slot, there[-1])
            error = np.array([1e-3, 0.2, 1.0]) * (1.0 + 0.1 * k)
            put(k, slot, stage, k if slot == last else -1, truth[:, last, k] + error)
    for slot in range(3, min(6, slots)):
        put(K, slot, 2, -1, np.array([np.deg2rad(40.0), 150.0, 0.0]))
    if slots > 1:
        put(K + 1, 1, 1, -1, np.array([np.deg2rad(120.0), 110.0, 0.0]))
    per_track = ("scheme", "trial", "slot", "track")
    result["track_id"], result["track_status"] = (per_track, id), (per_track, status)
    result["track_object"] = (per_track, about)
    result["track_state"] = ((*per_track, "state"), state)
    result["shared"] = ((*per_track[:3], "object"), np.zeros((*shape[:3], K), dtype=bool))
    return result
