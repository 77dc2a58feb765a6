"""All columns of all terms over the spots that count, and what each of them can explain beside a model.

Columns are in units of the prior, so that a direction in which the spots know less than the prior does is told by its
size alone: it is dropped. Everything is done on products of columns (Gram matrices): a model of some terms is judged
against thousands of others by small matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.term import Term
from respot.registration.covariance import jacobian

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

ABSORBED = 1e-3
"""A direction of which less than this (RMS) is no rigid motion is swallowed by the rigid part."""
_EIGEN_FLOOR = 1e-12


@dataclass(frozen=True, eq=False)
class Gains:
    """What each term explains beside a model.

    Attributes
    ----------
    squares : (terms,) array
        Sum of squares [mm^2].
    ranks : (terms,) int array
        Directions that the spots determine.
    sizes : (terms,) array
        Sum of squares of the parameters, in units of their priors: how far from plausible the answer is.
    whiteners : dict of int to (terms of that size, k, k) array
        By number of parameters: rows that turn products with the columns into independent shares.
    """

    squares: Array
    ranks: Rows
    sizes: Array
    whiteners: dict[int, Array]


@dataclass(frozen=True, eq=False)
class Span:
    """Independent directions of some terms.

    Attributes
    ----------
    chosen : tuple of int
        The terms, in their order.
    seen : (a, all columns) array
        Products of the orthonormal directions with all columns.
    coefficients : (a, parameters) array
        Each direction as a combination of the terms' columns.
    """

    chosen: tuple[int, ...]
    seen: Array
    coefficients: Array


class Bank:
    """Columns of terms over some spots, the rigid part projected out.

    Parameters
    ----------
    terms : sequence of Term
    columns : (m, 3, all parameters) array
        As `columns_of`, of the m spots that count.
    points : (m, 3) array
        Where these spots are, with the effects that are in the model already, source frame [mm].
    even : (3, 3) array, optional
        What makes the noise alike along all axes of the source frame: all shifts are seen through it.
    """

    def __init__(self, terms: Sequence[Term], columns: Array, points: Array, even: Array | None = None) -> None:
        self._even = even
        self.spots = len(points)
        self.terms = tuple(terms)
        sizes = np.array([len(term.parameters) for term in self.terms], dtype=np.intp)
        #: directions that a term uses at most, those first in which its prior moves the spots most
        self.leading = np.array([term.form.get("leading", len(term.parameters)) for term in self.terms], dtype=np.intp)
        stops = np.cumsum(sizes)
        self.slices = [slice(int(stop - size), int(stop)) for size, stop in zip(sizes, stops, strict=True)]
        columns = np.ascontiguousarray(self.evened(columns).reshape(3 * self.spots, -1))
        self.raw = np.einsum("ij,ij->j", columns, columns)
        self._points = points
        points = points - points.mean(axis=0)
        extent = max(float(np.sqrt(np.mean(points**2))), 1e-9)
        self.rigid = np.linalg.qr(self.evened(jacobian(points / extent)).reshape(-1, 6))[0]
        for _ in range(2):  # products lose half of the digits
            columns = columns - self.rigid @ (self.rigid.T @ columns)
        self.columns = columns
        self._products: dict[int, Array] = {}
        #: indices of terms by number of parameters, and of their columns
        self.groups = {int(size): np.flatnonzero(sizes == size) for size in np.unique(sizes)}
        self.places = {
            size: np.array([range(self.slices[i].start, self.slices[i].stop) for i in members], dtype=np.intp)
            for size, members in self.groups.items()
        }

    def __len__(self) -> int:
        return len(self.terms)

    @cached_property
    def grams(self) -> dict[int, Array]:
        """Products of each term's columns with themselves, (terms, k, k), by number of parameters."""
        found = {}
        for size, places in self.places.items():
            stacked = np.empty((len(places), size, size))
            for row, place in enumerate(places):
                part = self.columns[:, place[0] : place[-1] + 1]
                stacked[row] = part.T @ part
            found[size] = stacked
        return found

    @cached_property
    def shares(self) -> Array:
        """Part of each term's columns (RMS, 0 to 1) that no rigid motion imitates, (terms,)."""
        left = np.einsum("ij,ij->j", self.columns, self.columns)
        return np.array([np.sqrt(left[part].sum() / max(float(self.raw[part].sum()), 1e-300)) for part in self.slices])

    def evened(self, shifts: Array) -> Array:
        """Shifts (m, 3, ...) of the source frame as the bank sees them."""
        if self._even is None:
            return shifts
        return np.asarray(np.einsum("ij,nj...->ni...", self._even, shifts))

    def sample(self, most: int, seed: int) -> tuple[Bank, Rows]:
        """Return a bank of no more than ``most`` spots, and which they are."""
        if self.spots <= most:
            return self, np.arange(self.spots)
        rows = np.sort(np.random.default_rng(seed).permutation(self.spots)[:most])
        part = Bank(self.terms, self.columns.reshape(self.spots, 3, -1)[rows], self._points[rows])
        part.rigid = np.linalg.qr(self.rigid.reshape(self.spots, 3, -1)[rows].reshape(-1, 6))[0]
        part.columns = part.columns - part.rigid @ (part.rigid.T @ part.columns)
        return part, rows

    @cached_property
    def rough(self) -> NDArray[np.float32]:
        """Columns in single precision: enough for what chance gains, at half of the time."""
        return self.columns.astype(np.float32)

    def project(self, vectors: Array) -> Array:
        """Vectors (3m, ...) without their rigid part."""
        result: Array = vectors - self.rigid @ (self.rigid.T @ vectors)
        return result

    def products(self, index: int) -> Array:
        """Products (k, all columns) of a term's columns with all others; kept, since a search asks again and again."""
        found = self._products.get(index)
        if found is None:
            found = self._products[index] = self.columns[:, self.slices[index]].T @ self.columns
        return found

    def span(self, chosen: Sequence[int], sigma: float) -> Span:
        """Independent directions of some terms, in their order.

        A term's directions are those in which it moves the spots, beside the terms before it, by more than noise when
        it is as large as its prior.

        Parameters
        ----------
        chosen : sequence of int
        sigma : float
            Noise per coordinate [mm].
        """
        seen = np.zeros((0, self.columns.shape[1]))
        coefficients = np.zeros((0, 0))
        for index in chosen:
            part = self.slices[index]
            own = self.products(index)
            beside = seen[:, part]
            gram = own[:, part] - beside.T @ beside
            raw = np.array([self.raw[part].sum()])
            whitener = self._whiten(gram[None], raw, sigma, self.leading[[index]], _EIGEN_FLOOR)[0][0]
            rows = whitener[np.any(whitener != 0.0, axis=1)]
            # the term's own columns, less what the directions before it have of them
            share = rows @ beside.T
            added = np.hstack([-share @ coefficients, rows])
            above = np.hstack([coefficients, np.zeros((len(coefficients), rows.shape[1]))])
            coefficients = np.vstack([above, added])
            seen = np.vstack([seen, rows @ own - share @ seen])
        return Span(tuple(chosen), seen, coefficients)

    def basis(self, span: Span) -> Array:
        """Orthonormal basis (3m, a) of a span."""
        if not span.chosen:
            return np.zeros((3 * self.spots, 0))
        part = np.hstack([self.columns[:, self.slices[index]] for index in span.chosen])
        return np.asarray(part @ span.coefficients.T)

    def gains(self, span: Span, products: Array, sigma: float) -> Gains:
        """What each term explains of a residual beside a span.

        Parameters
        ----------
        span : Span
            The terms in the model.
        products : (all columns,) array
            Products of the columns with the model's residual [mm].
        sigma : float
            Noise per coordinate [mm]: directions whose plausible size stays below it are not determined.
        """
        squares, ranks = np.zeros(len(self.terms)), np.zeros(len(self.terms), dtype=np.intp)
        sizes = np.zeros(len(self.terms))
        whiteners = {}
        for size, members in self.groups.items():
            places = self.places[size]
            part = span.seen[:, places]  # a, terms, k
            gram = self.grams[size] - np.einsum("atk,atl->tkl", part, part)
            whitener, kept = self._whiten(gram, self.raw[places].sum(axis=1), sigma, self.leading[members])
            shares = np.einsum("tkl,tl->tk", whitener, products[places])
            sizes[members] = np.sum((shares * np.linalg.norm(whitener, axis=2)) ** 2, axis=1)
            squares[members], ranks[members] = np.sum(shares**2, axis=1), kept
            whiteners[size] = whitener
        return Gains(squares, ranks, sizes, whiteners)

    @staticmethod
    def _whiten(gram: Array, raw: Array, sigma: float, leading: Rows, least: float = 0.0) -> tuple[Array, Rows]:
        values, vectors = np.linalg.eigh(gram)
        size = gram.shape[1]
        floor = np.maximum(np.maximum(sigma**2, least), ABSORBED**2 * raw / size)[:, None]
        known = (values > floor) & (np.arange(size) >= size - leading[:, None])
        factor = np.where(known, 1.0 / np.sqrt(np.where(known, values, 1.0)), 0.0)
        whitener = factor[:, :, None] * np.swapaxes(vectors, 1, 2)
        return whitener, known.sum(axis=1).astype(np.intp)
