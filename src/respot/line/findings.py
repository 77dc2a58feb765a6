"""What a line keeps of the fit and the conversion of a robot: a few figures, and its effects with how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from respot.calibration.calibration import Calibration
from respot.calibration.effects.term import Term
from respot.program.robot import Robot

Record = Mapping[str, Any]
#: What is kept of an effect's record.
_KEPT = ("name", "where", "parameters", "named", "not_separated_from", "remedy")
#: Parameters of the rigid part, which stand first in a calibration's covariance.
_RIGID = 6


def identity(robot: Robot | None) -> dict[str, Any]:
    """Return the robot's own name, language, model and version of its controller, as its backup has them."""
    if robot is None:
        return {}
    version = robot.machine.facts.get("version")
    return {
        "robot": robot.name,
        "language": robot.language,
        "model": robot.machine.model,
        "version": "" if version is None else version.value,
    }


def fit_figures(record: Record) -> dict[str, Any]:
    """Return the figures of the JSON object of a fit that a line shows; errors are RMS of 3D distances [mm]."""
    heldout = (record.get("heldout") or {}).get("after") or {}
    return {
        "kind": record["kind"],
        "spots": record["n_matched"],
        "inliers": record["n_inliers"],
        "before": record["before"]["rms"],
        "after": record["after"]["rms"],
        "heldout": heldout.get("rms"),
        "unexplained": bool((record.get("unexplained") or {}).get("present")),
    }


def effects_of(fit: Record, model: Calibration | None, written: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return each effect of a fit.

    Parameters
    ----------
    fit : mapping
        The JSON object of the fit.
    model : Calibration or None
        With its precision: it adds ``covariance`` of the parameters, in their units, and the ``form`` that they scale.
    written : sequence of str
        Labels of the effects that were written into points.
    """
    sure = {} if model is None else {label: (form, block) for label, form, block in _blocks(model)}
    found = []
    for effect in fit.get("effects", ()):
        label = _label(effect["name"], effect["where"])
        form, covariance = sure.get(label, (None, None))
        told = {key: effect.get(key) for key in _KEPT}
        found.append({**told, "written": label in written, "form": form, "covariance": covariance})
    return found


def _blocks(model: Calibration) -> Iterator[tuple[str, Record, list[list[float]]]]:
    """Label, form and covariance of each term of a calibration."""
    if model.precision is None:
        return
    start, covariance = _RIGID, model.precision.covariance
    for term in model.terms:
        end = start + len(term.parameters)
        yield term.label, dict(term.form), covariance[start:end, start:end].tolist()
        start = end


def _label(name: str, where: Record) -> str:
    """Label of an effect's term, as `Term.label` has it."""
    return Term(name, where, ()).label
