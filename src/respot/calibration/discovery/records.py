"""What discovery found in the shapes that every report shows: effects, what was tried, what is hidden, what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from scipy import stats

from respot.calibration.discovery.discover import LEAST_SPOTS, Accepted, Discovery
from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.effect import Effect, Rival
from respot.calibration.observations import Observations

_DETERMINED = 0.5
"""A parameter is determined when its standard deviation is less than this part of what is plausible before."""
_MOST = 6


def effects_of(found: Discovery) -> tuple[Effect, ...]:
    """Records of the accepted effects, the strongest first."""
    return tuple(_effect(each, found) for each in found.accepted)


def _effect(each: Accepted, found: Discovery) -> Effect:
    term = each.term
    reach = float(stats.t.ppf(0.975, max(found.fit.free, 1.0)))
    parameters = {}
    for parameter, value, sd in zip(term.parameters, each.values, each.sd, strict=True):
        known = bool(sd < _DETERMINED * parameter.prior)
        parameters[parameter.name] = {
            "value": float(value) if known else None,
            "unit": parameter.unit,
            "ci95": [float(value - reach * sd), float(value + reach * sd)] if known else None,
        }
    schemes = [scheme for scheme in each.with_it.rms if scheme in each.table.without.rms]
    with_it, without = (held.over(schemes) if schemes else None for held in (each.with_it, each.table.without))
    rivals = [Rival("without it", without)] if without is not None else []
    for rival, held, _, _ in each.table.rivals[:_MOST]:
        both = [scheme for scheme in schemes if scheme in held.rms]
        rivals.append(Rival(rival.label, held.over(both) if both else None))
    return Effect(
        name=term.effect,
        where=dict(term.where),
        named=each.named,
        remedy=MECHANISMS[term.effect].remedy(term, each.values),
        heldout_gain=without - with_it if with_it is not None and without is not None else None,
        p_value=each.p_value,
        parameters=parameters,
        not_separated_from=tuple(rival.label for rival in each.not_separated),
        rivals=tuple(rivals),
        evidence={
            "form": {name: value for name, value in term.form.items() if isinstance(value, str | int | float)},
            "heldout_rms": with_it,
            "heldout_by_scheme": {
                scheme: {"with": each.with_it.rms[scheme], "without": each.table.without.rms[scheme]}
                for scheme in schemes
            },
            "criterion_lead": min((float(apart) for _, _, apart, _ in each.table.rivals), default=None),
        },
    )


def tried_of(found: Discovery) -> list[dict[str, Any]]:
    """What was tried and is not in the model, the least likely to come by chance first."""
    records = []
    for term, chance, beyond in sorted(found.tried, key=lambda each: each[1:]):
        if chance > 0.01:
            verdict = f"chance explains as much (p = {chance:.2g})"
        elif beyond < 0.0:
            verdict = f"would fit a little better (p = {chance:.2g}), but does not help spots that were left out"
        else:
            verdict = f"adds less than its parameters cost (p = {chance:.2g})"
        records.append(
            {"name": term.effect, "where": dict(term.where), "p_value": chance, "heldout_rms": None, "verdict": verdict}
        )
    return records


def hidden_of(found: Discovery) -> list[dict[str, Any]]:
    """Effects that these spots cannot show."""
    return [
        {
            "name": each.term.effect,
            "where": dict(each.term.where),
            "share": 1.0 - each.share,
            "absorbed_by": each.absorbed_by,
            "measure": MECHANISMS[each.term.effect].separates,
        }
        for each in found.hidden
    ]


def measure_next_of(found: Discovery) -> list[str]:
    """What to measure to tell what these spots do not."""
    texts = []
    for each in found.accepted:
        if each.not_separated:
            others = _listed(rival.label for rival in each.not_separated)
            own = MECHANISMS[each.term.effect].separates
            texts.append(f"To tell {each.term.label} from {others}: {own}.")
    if found.accepted and found.unexplained.reached is None:
        texts.append(
            "Measure some spots three times (a column `repeat`), or give --noise: without a known noise nobody can say "
            "whether what is left is only noise, and no lasting cause is named."
        )
    return texts


def questions_of(observations: Observations | None, spots: int, found: Discovery | None) -> list[dict[str, Any]]:
    """What could not be asked at all, and how many spots are missing for it."""
    questions: list[dict[str, Any]] = []
    if spots < LEAST_SPOTS:
        text = f"Which effects are behind the residual? At least {LEAST_SPOTS} spots are needed to ask."
        questions.append({"text": text, "missing": LEAST_SPOTS - spots})
    if observations is None or found is None:
        return questions
    if observations.absolute_accuracy:
        text = "Is it the arm? Its controller compensates the arm (absolute accuracy); effects of the arm are refused."
        questions.append({"text": text, "missing": None})
    elif not observations.has_arm:
        text = (
            "Is it the arm? Without joints (j1 ...) and --robot, or a backup with machine data, that cannot be asked."
        )
        questions.append({"text": text, "missing": None})
    if observations.rotations is None:
        text = "Is it tool or gun? Without the tool's orientation at each spot that cannot be asked."
        questions.append({"text": text, "missing": None})
    if not any(column.role == "time" for column in observations.columns.values()):
        text = "Does it drift or warm up? Without a column with the time of each measurement that cannot be asked."
        questions.append({"text": text, "missing": None})
    return questions


def _listed(names: Iterable[str]) -> str:
    every = list(dict.fromkeys(names))
    return ", ".join(every[:_MOST]) + (f" and {len(every) - _MOST} more" if len(every) > _MOST else "")
