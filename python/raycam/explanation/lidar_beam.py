"""Explains one pulse of a lidar.

The explanation contains the sub-rays of the pulse's beam, the surfaces that return light, and the echoes of
the waveform.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import Floats, whole
from ..errors import LidarError, SettingsError
from ..io import atomic_files
from ..lidar import Lidar
from ..lidar.pulse_tracer import PulseTracer
from ..lidar.scan_notices import LOST
from ..lidar.scanning import detect_echoes, lidar_named, select_echoes
from .digits import number, vector
from .lidar_figure import beam_figure
from .lidar_steps import BeamSteps

if TYPE_CHECKING:
    from ..world import World

__all__ = ["BeamExplanation", "explain_beam"]

MAX_ROWS = 40
"""Maximum number of surfaces listed in the text."""


class BeamExplanation(BeamSteps):
    """The explanation of one pulse of a lidar.

    `str()` lists the surfaces and echoes; `svg()` and `save_figure` draw them. Arrays with [m] have a row for
    each surface that returns light to a sub-ray, arrays with [e] one for each echo.
    """

    def __str__(self) -> str:
        """The steps with formulas and numbers, as text."""
        settings = self.lidar.settings
        lines = [
            f"Pulse {self.firing} of {self.lidar.title}, ring {self.ring}, at {number(self.time)} s",
            f"  starts at {vector(self.origin)} m and points to {vector(self.direction)} in sensor axes",
            f"  {settings['beam_samples']} sub-rays, each with 1/{settings['beam_samples']} of the energy; divergence "
            f"{number(1e3 * settings['beam_divergence'][0])} x {number(1e3 * settings['beam_divergence'][1])} mrad",
            "",
            "Surfaces: each returns E = w pi f cos(theta) / L^2",
        ]
        for row in range(min(len(self.ray), MAX_ROWS)):
            bounce = f", over {self.bounces[row]} mirrors or glass faces" if self.bounces[row] else ""
            lines.append(
                f"  sub-ray {self.ray[row]}: {self.names[row]} at L = {number(self.length[row])} m, "
                f"E = {number(self.energy[row], 4)}{bounce}"
            )
        if len(self.ray) > MAX_ROWS:
            lines.append(f"  ... and {len(self.ray) - MAX_ROWS} more")
        if not len(self.ray):
            lines.append("  none: no surface in the beam returns light")
        lines += [
            "",
            f"Echoes: maxima of the sum of pulses of {number(2.355 * self.sigma, 4)} m (half maximum)",
        ]
        for row, length in enumerate(self.echo_length):
            ratio = (
                "unknown, because range_10 is unknown"
                if np.isinf(self.signal[row])
                else number(self.signal[row], 4)
            )
            lines.append(
                f"  {number(length)} m: E = {number(self.echo_energy[row], 4)}, signal-to-noise {ratio} (threshold 5), "
                f"purity {number(self.purity[row], 3)}: {self.lost[row]}"
            )
        if not len(self.echo_length):
            lines.append("  none")
        return "\n".join(lines)

    def svg(self) -> str:
        """Returns the figure as SVG.

        The figure shows the sub-rays with the surfaces, and below them the waveform with the threshold.
        """
        return beam_figure(self)

    def _repr_svg_(self) -> str:
        """The figure that a notebook shows."""
        return self.svg()

    def save_figure(self, path: str | os.PathLike[str]) -> None:
        """Writes the figure as .svg; raises `SettingsError` for another extension."""
        check_beam_figure(path)
        atomic_files.write(path, self.svg().encode())


def check_beam_figure(path: str | os.PathLike[str]) -> None:
    """Raises `SettingsError` if the figure of a beam cannot be written with this extension."""
    if Path(path).suffix.lower() != ".svg":
        raise SettingsError(
            f"{os.fspath(path)}: unsupported format; figures of lidar beams require .svg",
            code="unknown_format",
        )


def explain_beam(world: World, lidar: Lidar | str, firing: int, *, frame: int = 0) -> BeamExplanation:
    """Explains pulse number `firing` of a lidar.

    The explanation contains the pulse's sub-rays, the surfaces that they meet, and the echoes. `lidar` is a
    `Lidar`, or the name of a lidar of the world. `frame` is the number of the frame, as in `raycam.scan`; the
    explained echoes become the points of this scan.

    Raises `LidarError` for an unknown lidar, and `SettingsError` for a pulse that the pattern does not
    contain.
    """
    if isinstance(lidar, str):
        lidar = lidar_named(world, lidar)
    if not isinstance(lidar, Lidar):
        raise LidarError(f"lidar must be a raycam.Lidar, not {type(lidar).__name__}", code="wrong_type")
    frame = whole("frame", frame, 0)
    pattern = lidar.pattern(frame)
    firing = whole("firing", firing, 0, len(pattern) - 1)
    tracer, block = PulseTracer(world, lidar, pattern, frame, None), range(firing, firing + 1)
    found = tracer.trace(block)
    tracer.warn_of_colors()
    echoes, lost, signal = detect_echoes(tracer, found, block)
    chosen = select_echoes(echoes, lost == 0, lidar)
    reasons = [LOST[code] for code in lost.tolist()]
    for row in set(np.flatnonzero(lost == 0).tolist()) - set(chosen.tolist()):
        reasons[row] = f'not reported, because returns is "{lidar.returns}"'
    objects = world.objects
    turns, places = lidar.track.at(pattern.times[firing : firing + 1])
    start = places[0] + turns[0] @ pattern.origins[firing]
    axis = turns[0] @ pattern.directions[firing]
    across = found.fields["position"] - start
    across = across - (across @ axis)[:, None] * axis
    offset = np.where(found.bounces == 0, np.linalg.norm(across, axis=1), np.nan)
    sign = np.sign(across @ (turns[0] @ _upwards(pattern.directions[firing])))
    return BeamExplanation(
        lidar,
        firing,
        float(pattern.times[firing]),
        int(pattern.rings[firing]),
        pattern.origins[firing],
        pattern.directions[firing],
        found.ray,
        found.length,
        offset * np.where(sign < 0.0, -1.0, 1.0),
        found.energy,
        found.bounces,
        ["fog" if i < 0 else objects[i].name for i in found.fields["instance"].tolist()],
        echoes.length,
        echoes.energy,
        signal,
        echoes.purity.astype(float),
        reasons,
    )


def _upwards(direction: Floats) -> Any:
    """Returns the unit vector nearest to z that is perpendicular to a direction.

    For the direction z, the result is x.
    """
    above = np.eye(3)[2] - direction[2] * direction
    length = np.linalg.norm(above)
    return above / length if length > 1e-9 else np.eye(3)[0]
