"""The tool offset of a fit on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from respot.cli.display import heading, line

if TYPE_CHECKING:
    from respot.calibration.spot_fit import SpotFit


def show_tool(fit: SpotFit) -> None:
    """Print an offset that is part of the model: interval of each component, and the evidence."""
    trial = fit.tool
    if fit.method != "robust" or trial is None or trial.effect is None or trial.fit is None:
        return
    heading("tool offset, from the TCP of the source, axes of the tool (95 % intervals, given the model)")
    for name, parameter in trial.effect.parameters.items():
        if parameter["value"] is None:
            line(f"  {name}: not determined")
        else:
            low, high = parameter["ci95"]
            line(f"  {name}: {parameter['value']:9.3f} +- {(high - low) / 2.0:.3f} mm")
    found = trial.fit.identifiability
    line(f"  rank {found.rank} of 3, condition number {found.condition:.1f}")
    line(f"  {trial.verdict}")
    floor = trial.effect.evidence["noise_floor"]
    sigma = f"residuals of {trial.fit.sigma:.3f} mm per coordinate"
    if floor is None:
        line(f"  {sigma}; the noise is not known (--noise), so no cause is named")
    else:
        verdict = "reach" if trial.effect.evidence["floor_reached"] else "do not reach"
        line(f"  {sigma} {verdict} the known noise of {floor:g} mm")
