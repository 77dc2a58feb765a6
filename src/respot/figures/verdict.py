"""What a fit found and what to do about it, in a few sentences; shared by the page and the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from respot.figures.words import (
    REMEDY_PLACES,
    figure,
    finding,
    listing,
    number_word,
    sentence,
    separation,
)


@dataclass(frozen=True)
class Cause:
    """One cause in the verdict: what it is, and how sure that is."""

    text: str
    certainty: str
    named: bool


@dataclass(frozen=True)
class Verdict:
    """The short answer.

    Parameters
    ----------
    headline : str
        What was found, in a sentence.
    causes : tuple of Cause
        Each cause by itself; empty where nothing was found.
    error : str
        How the error changed, or what is left.
    advice : str
        What to do, in a sentence.
    """

    headline: str
    causes: tuple[Cause, ...]
    error: str
    advice: str


def record_of_causes(record: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the part of a record that holds effects: methods for comparison keep them in the robust fit beside."""
    beside = record.get("robust")
    return beside if isinstance(beside, Mapping) else record


def verdict(record: Mapping[str, Any]) -> Verdict:
    """Sum a fit up: what was found, how the error changed, what to do.

    Parameters
    ----------
    record : mapping
        The JSON object of ``respot fit``.
    """
    effects: Sequence[Mapping[str, Any]] = record_of_causes(record).get("effects") or ()
    causes = tuple(
        Cause(sentence(finding(effect)), separation(effect), bool(effect.get("named"))) for effect in effects
    )
    return Verdict(_headline(causes, record), causes, _error(record, bool(causes)), _advice(record, effects))


def _headline(causes: Sequence[Cause], record: Mapping[str, Any]) -> str:
    if len(causes) == 1:
        return causes[0].text
    if causes:
        named, unsure = sum(cause.named for cause in causes), sum(not cause.named for cause in causes)
        total = f"{sentence(number_word(len(causes))).rstrip('.')} causes were found beyond a plain shift and turn"
        if not unsure:
            return f"{total}."
        if not named:
            return f"{total}; none is proved."
        return f"{total}: {number_word(named)} named, {number_word(unsure)} not proved."
    if unexplained(record):
        return "Something is left beyond a plain shift and turn of the whole list, and no known effect explains it."
    return "Nothing was found beyond a plain shift and turn of the whole list."


def unexplained(record: Mapping[str, Any]) -> bool:
    """Whether the record says that structure is left that nothing explains."""
    return bool((record_of_causes(record).get("unexplained") or {}).get("present"))


def _error(record: Mapping[str, Any], found: bool) -> str:
    source = record_of_causes(record)
    heldout = source.get("heldout") or {}
    before, after, whose = heldout.get("before"), heldout.get("after"), heldout_words(heldout.get("scheme"))
    if not (before and after):
        before, after, whose = source["before"], source["after"], "all spots that were fitted"
    low, high = figure(after["rms"]), figure(before["rms"])
    if source is not record:
        whose = f"{whose}, in respot's own robust fit,"
    if not found:
        left = f"What is left is {figure(source['after']['rms'])} mm (RMS)"
        return f"{left}; for {whose} it is {low} mm. Nothing found is a result too."
    model = "this" if len(source.get("effects") or ()) == 1 else "these"
    if after["rms"] < before["rms"]:
        return f"With {model} in the model the error of {whose} falls from {high} to {low} mm (RMS)."
    return f"The error of {whose} does not fall with {model} in the model: {high} mm before, {low} mm after (RMS)."


def heldout_words(scheme: str | None) -> str:
    """Say which spots a held-out error is about."""
    if scheme and scheme.startswith("leave-one-out"):
        return "spots left out of the fit one by one"
    return "spots that took no part"


def _advice(record: Mapping[str, Any], effects: Sequence[Mapping[str, Any]]) -> str:
    sure, unsure = (_todo(effects, named) for named in (True, False))
    if sure or unsure:
        check = f"Check the cause first, it is not proved; then {unsure}" if unsure and not sure else ""
        later = f"Then check what is not proved, and {unsure}" if unsure and sure else ""
        return " ".join(sentence(text) for text in (sure, check, later) if text)
    if unexplained(record):
        correlates = [str(entry["column"]) for entry in record_of_causes(record)["unexplained"].get("correlates") or ()]
        hint = f" It goes together with {listing(correlates)}." if correlates else ""
        return f"Repair nothing yet: measure more first.{hint}"
    if record.get("method") == "affine":
        return "This fit is for comparison only; nothing can be written back from it."
    if record.get("kind") == "theory":
        return "Nothing to repair was found; the shift can be written into the programs with respot convert."
    return "Nothing to repair was found; the fit can be used with respot convert and respot predict as it is."


def _todo(effects: Sequence[Mapping[str, Any]], named: bool) -> str:
    places = [
        str(effect["remedy"].get("where") or "")
        for effect in effects
        if effect.get("remedy") and bool(effect.get("named")) == named
    ]
    return listing(
        REMEDY_PLACES[name][1] if name in REMEDY_PLACES else f"see to {name}" for name in dict.fromkeys(places) if name
    )
