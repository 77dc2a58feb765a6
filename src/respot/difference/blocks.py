"""Blocks of statements that stand elsewhere: removed here, added there, word for word."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from respot.difference.canonical import Key
from respot.difference.programs import CodePair, FilePair

#: A single statement is a block if it is about one of these, has so many tokens, and occurs nowhere else among what
#: came and went: in its file, or in the robot if it went to another file. A form's other statements are all alike.
_TELLING = frozenset(("motion", "weld", "io", "call"))
_TELLING_TOKENS = 3


@dataclass(frozen=True, eq=False)
class Block:
    """A block that moved: where it stood and where it stands, as ranges of statements of two routines."""

    old_file: FilePair
    new_file: FilePair
    old: CodePair
    new: CodePair
    old_start: int
    new_start: int
    length: int


@dataclass(frozen=True, eq=False)
class _Run:
    file: FilePair
    pair: CodePair
    start: int
    keys: list[Key]


def moved_blocks(files: Iterable[FilePair]) -> list[Block]:
    """Find the blocks that moved within a robot's programs, the longest first, and take them out of the gaps.

    Parameters
    ----------
    files : iterable of FilePair
        Files whose code is aligned.
    """
    removed: list[_Run] = []
    added: list[_Run] = []
    for file in files:
        for pair in file.code:
            for i0, i1, j0, j1 in pair.gaps():
                if i0 < i1:
                    removed.append(_Run(file, pair, i0, [file.old.key(item) for item in pair.old.code[i0:i1]]))
                if j0 < j1:
                    added.append(_Run(file, pair, j0, [file.new.key(item) for item in pair.new.code[j0:j1]]))
    places: dict[Key, list[tuple[int, int]]] = {}
    for run_index, run in enumerate(added):
        for offset, found in enumerate(run.keys):
            places.setdefault(found, []).append((run_index, offset))
    counts = [_counts(runs) for runs in (removed, added)]
    candidates = sorted(
        (candidate for run in removed for candidate in _candidates(run, added, places)),
        key=lambda candidate: -candidate[-1],
    )
    blocks: list[Block] = []
    for run, start, target_index, target_start, length in candidates:
        target = added[target_index]
        if length == 1:
            single = run.keys[start]
            about = run.file.old.dialect.about(run.pair.old.code[run.start + start])
            scope = id(run.file) if run.file is target.file else 0
            if about not in _TELLING or len(single) < _TELLING_TOKENS:
                continue
            if any(count[scope, single] > 1 for count in counts):
                continue
        olds = range(run.start + start, run.start + start + length)
        news = range(target.start + target_start, target.start + target_start + length)
        if not run.pair.moved_old.isdisjoint(olds) or not target.pair.moved_new.isdisjoint(news):
            continue
        run.pair.moved_old.update(olds)
        target.pair.moved_new.update(news)
        blocks.append(Block(run.file, target.file, run.pair, target.pair, olds[0], news[0], length))
    return blocks


def _counts(runs: Iterable[_Run]) -> Counter[tuple[int, Key]]:
    """Count each statement of some runs in its file, by the identity of the file, and in the robot, by 0."""
    found: Counter[tuple[int, Key]] = Counter()
    for run in runs:
        for single in run.keys:
            found[id(run.file), single] += 1
            found[0, single] += 1
    return found


def _candidates(
    run: _Run, added: list[_Run], places: dict[Key, list[tuple[int, int]]]
) -> Iterator[tuple[_Run, int, int, int, int]]:
    """Yield the maximal runs of equal statements: where each begins on both sides, and its length."""
    for start, first in enumerate(run.keys):
        for target_index, target_start in places.get(first, ())[:20]:
            target = added[target_index]
            if start and target_start and run.keys[start - 1] == target.keys[target_start - 1]:
                continue
            length = 1
            while (
                start + length < len(run.keys)
                and target_start + length < len(target.keys)
                and run.keys[start + length] == target.keys[target_start + length]
            ):
                length += 1
            yield run, start, target_index, target_start, length
