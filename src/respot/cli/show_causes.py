"""What a fit found and did not find, on the terminal: causes, rivals, what is hidden, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from respot.cli.display import Column, heading, line, table
from respot.figures.verdict import verdict
from respot.figures.words import chance, effect_noun, figure, listing, place, separation, value_text

if TYPE_CHECKING:
    from respot.calibration.spot_fit import SpotFit

_MOST_PARAMETERS = 9
_MOST_TRIED = 6
_SHOWN_ELSEWHERE = ("swapped_ids", "convention", "tool_offset")
#: Effects that a list or a backup proves: no further spot does.
_PROVE_THEMSELVES = ("swapped_ids", "convention", "wrong_frame")


def show_causes(fit: SpotFit, record: Mapping[str, Any]) -> None:
    """Print what is left and why.

    Parameters
    ----------
    fit : SpotFit
    record : mapping
        The same as JSON values (of a method for comparison: of our fit beside it).
    """
    heading("what is left, and why")
    effects = record["effects"]
    for effect in effects:
        word = "named" if effect["named"] else "consistent with"
        judged_before = effect["name"] in _SHOWN_ELSEWHERE
        where = "" if judged_before else f" {place(effect['where'])}".rstrip()
        line(f"  {effect['name']}{where} ({word}): {effect['remedy']['text']}")
        if not judged_before:
            _show_evidence(effect)
    if not effects:
        line("  no effect found beyond the rigid transform")
    _show_lost(fit, record)
    _show_unknown(record)
    if effects:
        said = verdict(record)
        heading("in short")
        line(f"  {said.headline}")
        for text in (said.error, said.advice):
            if text:
                line(f"  {text}")


def _show_evidence(effect: Mapping[str, Any]) -> None:
    parameters = list(effect["parameters"].items())
    for name, parameter in parameters[:_MOST_PARAMETERS]:
        line(f"      {name:16} {value_text(parameter['value'], parameter['ci95'], parameter['unit'])}")
    if len(parameters) > _MOST_PARAMETERS:
        line(f"      and {len(parameters) - _MOST_PARAMETERS} more (--json)")
    line(f"      by luck alone as much: {chance(effect['p_value'])}; {separation(effect)}")
    rows = [["with it", figure(effect["evidence"].get("heldout_rms"), 3)]]
    rows += [[_rival(rival["name"]), figure(rival["heldout_rms"], 3)] for rival in effect["rivals"]]
    table([Column("      in its place", number=False), Column("held-out RMS")], [[f"      {a}", b] for a, b in rows])


def _rival(name: str) -> str:
    return name if name == "without it" else effect_noun(name)


def _show_lost(fit: SpotFit, record: Mapping[str, Any]) -> None:
    trial = fit.tool
    if trial is not None and not trial.accepted and trial.figures is not None:
        line(f"  tool_offset was tried and is not part of the model: {trial.verdict}")
    tried = [each for each in record["effects_tried"] if each["name"] not in _SHOWN_ELSEWHERE]
    if tried:
        names = [f"{each['name']} {place(each['where'])}".strip() for each in tried[:_MOST_TRIED]]
        more = f" and {len(tried) - _MOST_TRIED} more" if len(tried) > _MOST_TRIED else ""
        line(f"  tried and not proved, the nearest first: {', '.join(names)}{more}")


def _show_unknown(record: Mapping[str, Any]) -> None:
    unexplained = record["unexplained"]
    if unexplained["present"]:
        line(f"  unexplained: {unexplained['text']}")
        names = [each["column"] for each in unexplained["correlates"]]
        if names:
            line(f"  it follows most: {listing(names)}")
    hidden: Sequence[Mapping[str, Any]] = record["hidden"]
    if hidden:
        names = [f"{each['name']} {place(each['where'])}".strip() for each in hidden]
        line(f"  these spots cannot show: {listing(names)} (the rigid part or the tool swallows them)")
    for question in record["questions"]:
        line(f"  not asked: {question['text']}")
    for text in record["measure_next"]:
        line(f"  measure next: {text}")
    causes = [effect for effect in record["effects"] if effect["name"] not in _PROVE_THEMSELVES]
    if any(effect["not_separated_from"] for effect in causes):
        line("  which spots of the program that would be: save with -o CAL.json, then respot plan SOURCE -c CAL.json")
