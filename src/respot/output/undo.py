"""Takes a conversion back: originals return to their places, or a folder that respot wrote goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from respot.archives import is_own, read_files
from respot.correction.conversion import RECORD
from respot.correction.proof import VerifyError
from respot.issues import BadInputError, Issue
from respot.output import kept
from respot.output.disk import flush, link, look_alike, mirror, read_all, remove
from respot.output.folders import not_ours, read_record, refuse_fixed, sha256
from respot.output.kept import Kept
from respot.output.workplace import is_cut_short, restore, workplace

#: Where files lie that were changed after a conversion and had to give way.
_ASIDE = "changed"


@dataclass(frozen=True)
class Undone:
    """What was taken back.

    Parameters
    ----------
    folder : Path
        The folder.
    kind : str
        ``in_place``: originals are back; ``folder``: what respot wrote is gone; ``cut_short``: a conversion that was
        killed between two steps.
    calibration : str, optional
        Hash of the calibration that was applied.
    restored, removed, set_aside : sequences of str
        Files that are as before, that are gone, and where changed ones lie now; paths in the folder.
    left : int
        Conversions in place that can still be taken back.
    issues : sequence of Issue
        What a person should know.
    """

    folder: Path
    kind: str
    calibration: str | None = None
    restored: Sequence[str] = ()
    removed: Sequence[str] = ()
    set_aside: Sequence[str] = ()
    left: int = 0
    issues: Sequence[Issue] = field(default=())

    def as_json(self) -> dict[str, object]:
        """Record of INTERFACES.md, `undo`, without schema, version and issues."""
        return {
            "folder": str(self.folder),
            "kind": self.kind,
            "calibration": self.calibration,
            "restored": list(self.restored),
            "removed": list(self.removed),
            "set_aside": list(self.set_aside),
            "left": self.left,
        }


def undo(path: Path, force: bool = False) -> Undone:
    """Take the last conversion of a folder back.

    Parameters
    ----------
    path : Path
        The folder, or ``respot.json`` in it.
    force : bool
        Restore originals over files that were changed since, which are set aside; remove a folder whose source is not
        found any more.

    Raises
    ------
    BadInputError
        ``NOTHING_TO_UNDO``; ``CHANGED_SINCE`` if something would be lost; ``ORIGINALS_LOST``; ``CANNOT_WRITE``;
        ``IN_USE``.
    VerifyError
        What was restored is not what was kept; the folder is as it was.
    """
    folder = path.parent if path.name == RECORD else path
    whole = folder.resolve()
    if is_cut_short(whole):
        restore(whole)
        return Undone(folder, "cut_short", left=len(kept.numbers(whole)))
    if not whole.is_dir():
        raise BadInputError("CANNOT_READ", "no such folder", str(folder))
    refuse_fixed(whole, "copy it into a folder, and take the conversion back there")
    numbers = kept.numbers(whole)
    record = read_record(whole)
    if numbers:
        return _restore(folder, kept.load(whole, numbers[-1]), record or {}, len(numbers) - 1, force)
    if record is None:
        message = f"holds no conversion: no {RECORD}, and no originals in {kept.FOLDER}. Was it taken back before?"
        raise BadInputError("NOTHING_TO_UNDO", message, str(folder))
    if "in_place" in record:
        message = f"{kept.FOLDER} is gone, in which the originals were kept. Nothing was changed"
        raise BadInputError("ORIGINALS_LOST", message, str(folder))
    return _remove(folder, record, force)


# ------------------------------------------------------------------------------------------------------------- in place


def _restore(folder: Path, replaced: Kept, record: Mapping[str, object], left: int, force: bool) -> Undone:
    whole = folder.resolve()
    with workplace(whole) as place:
        files = read_files(whole)  # refuses links, through which a restored file could land elsewhere
        edited = [
            path for path, (_, after) in replaced.files.items() if path not in files or sha256(files[path]) != after
        ]
        if edited and not force:
            raise _edited(folder, edited, files)
        aside = {path: _aside(whole, replaced, path) for path in edited if path in files}
        mirror(whole, place.new)
        for path, name in aside.items():
            _put(place.new / path, place.new / name)
        for path, (before, _) in replaced.files.items():
            (place.new / path).unlink(missing_ok=True)
            if before is not None:
                _put(whole / replaced.original(path), place.new / path)
        remove(place.new / replaced.folder)
        _remove_empty(
            place.new, [f"{kept.FOLDER}/any", *(path for path, (before, _) in replaced.files.items() if not before)]
        )
        look_alike(whole, place.new)
        flush(place.new)
        _check(place.new, files, replaced)
        place.put()
    issues = [
        Issue("STAYS_CHANGED", "was changed after the conversion, which did not write it: it stays", str(folder / path))
        for path in _changed(record, files, replaced)
    ]
    issues += [
        Issue("SET_ASIDE", f"was changed after the conversion; it lies in {name} now", str(folder / path))
        for path, name in aside.items()
    ]
    restored = [path for path, (before, _) in replaced.files.items() if before is not None]
    removed = [path for path, (before, _) in replaced.files.items() if before is None]
    return Undone(folder, "in_place", replaced.calibration, restored, removed, list(aside.values()), left, issues)


def _edited(folder: Path, edited: Sequence[str], files: Mapping[str, bytes]) -> BadInputError:
    names = ", ".join(edited[:5]) + (f" and {len(edited) - 5} more" if len(edited) > 5 else "")
    gone = " (or removed)" if any(path not in files for path in edited) else ""
    message = (
        f"changed{gone} after the conversion: {names}. --force brings the originals back and keeps what was changed in "
        f"{kept.FOLDER}/{_ASIDE}. Nothing was changed"
    )
    return BadInputError("CHANGED_SINCE", message, str(folder / edited[0]))


def _aside(folder: Path, replaced: Kept, path: str) -> str:
    """Free name for a file that has to give way."""
    base = f"{kept.FOLDER}/{_ASIDE}/{replaced.number:04d}/{path}.changed"
    name, count = base, 2
    while (folder / name).exists():
        name, count = f"{base}.{count}", count + 1
    return name


def _put(file: Path, place: Path) -> None:
    place.parent.mkdir(parents=True, exist_ok=True)
    link(file, place)


def _remove_empty(root: Path, paths: Iterable[str]) -> None:
    """Remove the folders of files that are gone, as far as nothing else is in them."""
    for path in paths:
        for folder in (root / path).parents:
            if folder == root or any(folder.iterdir()):
                break
            folder.rmdir()


def _check(staged: Path, files: Mapping[str, bytes], replaced: Kept) -> None:
    """Read all that was made from the disk: the originals by their hashes, everything else as it was."""
    written = {path: data for path, data in read_all(staged).items() if not is_own(path)}
    hashes = {path: before for path, (before, _) in replaced.files.items() if before is not None}
    for path in sorted({*written, *files, *hashes}):
        data = written.get(path)
        if path in replaced.files:
            if (None if data is None else sha256(data)) != replaced.files[path][0]:
                raise VerifyError(f"{path}: what was restored is not the original")
        elif data != files.get(path):
            message = "was changed while the conversion was taken back; run it again. Nothing was changed"
            raise BadInputError("SOURCE_CHANGED", message, path)


def _changed(record: Mapping[str, object], files: Mapping[str, bytes], replaced: Kept) -> list[str]:
    """Files that the conversion only copied, and that are not now what they were then."""
    contents = record.get("contents")
    if not isinstance(contents, dict):
        return []
    return [
        path
        for path, data in files.items()
        if path in contents and path not in replaced.files and contents[path] != sha256(data)
    ]


# --------------------------------------------------------------------------------------------------------- a new folder


def _remove(folder: Path, record: Mapping[str, object], force: bool) -> Undone:
    """Remove a folder that respot wrote, if it is as respot wrote it and the source is still there."""
    strange = not_ours(folder)
    if strange:
        message = f"{strange}. The source of this folder was never changed; remove the folder by hand if you like"
        raise BadInputError("CHANGED_SINCE", message, str(folder))
    source = Path(str(record.get("source", "")))
    if not force and not _still_there(source, record):
        message = (
            f"was made from {source}, which is not there as it was (seen from here): this folder may be the only copy. "
            "--force removes it"
        )
        raise BadInputError("CHANGED_SINCE", message, str(folder))
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())
    with workplace(folder.resolve()) as place:
        place.take()
    calibration = record.get("calibration")
    hash_ = calibration.get("hash") if isinstance(calibration, dict) else None
    return Undone(folder, "folder", hash_ if isinstance(hash_, str) else None, removed=names)


def _still_there(source: Path, record: Mapping[str, object]) -> bool:
    """Whether the source of a conversion is still what it was."""
    contents, files = record.get("contents"), record.get("files")
    if not isinstance(contents, dict) or not isinstance(files, dict):
        return False
    try:
        found = read_files(source)
    except BadInputError:
        return False
    before = {**contents, **{path: each.get("before") for path, each in files.items()}}
    return all(path in found and sha256(found[path]) == hash_ for path, hash_ in before.items())
