"""Robots of a line with what was found on them."""

from __future__ import annotations

TRAITS = ("group", "station", "gun", "generation", "language", "model")


def effect(name="joint_zero", where=None, values=(0.1,), covariance=None, form=None, named=True):
    parameters = {f"v{row}": {"value": value, "unit": "deg", "ci95": None} for row, value in enumerate(values)}
    told = {"where": {"axis": 3} if where is None else where, "named": named, "covariance": covariance}
    return {"name": name, "parameters": parameters, "form": form or {}, **told}


def robot(name, *effects, spots=20, **traits):
    return {"name": name, "spots": spots, "effects": list(effects), **dict.fromkeys(TRAITS, ""), **traits}
