"""Finds the grammars, templates, samples and data that ship with respot.

A wheel carries them inside the package; a checkout and an editable install have them at the top of the repository.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parents[2]


def resource(*parts: str) -> Path:
    """Path of a shipped file or folder, e.g. ``resource("grammars", "krl.lark")``.

    Raises
    ------
    FileNotFoundError
        Neither the installed package nor a checkout around it has the resource.
    """
    installed = Path(str(resources.files("respot"))).joinpath(*parts)
    if installed.exists():
        return installed
    checkout = _CHECKOUT.joinpath(*parts)
    if (_CHECKOUT / "pyproject.toml").is_file() and checkout.exists():
        return checkout
    raise FileNotFoundError(f"respot is installed without {'/'.join(parts)}: install it again")
