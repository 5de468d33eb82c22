"""The operators of the solvers, for developers of methods: displacements from tractions.

They describe an elastic half-space, or a block (thesis, section 2.1 and chapter 3; Love, Phil.
Trans. R. Soc. A 228 (1929) 377). Normal fields have the shape (ny, nx). Tangential fields have the
shape (2, ny, nx), with the components along x and y. Users import this module as
``asperity.operators``.
"""

from __future__ import annotations

import weakref

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import library
from ..base.check import array_of, number, poisson_ratio, positive
from ..base.check import whole as whole_number
from ..base.errors import NotConverged

__all__ = ["NormalOperator", "TangentialOperator", "normal", "tangential"]

FloatArray = NDArray[np.float64]

_open = library.call("operator_open")
_apply = library.call("operator_apply")
_symbol = library.call("operator_symbol")


class _Operator:
    """Common base of both operators: a handle of the library, and an iterative inverse."""

    nx: int
    ny: int
    lx: float
    ly: float
    boundary: str
    modulus: float
    _components: int

    def __init__(self, nx: int, ny: int, lx: float, ly: float | None, modulus: float,
                 boundary: str, poisson: float, thickness: float) -> None:
        self.nx, self.ny = whole_number("nx", nx), whole_number("ny", ny)
        self.lx, self.ly = library.lengths((self.ny, self.nx), lx, ly)
        self.modulus, self.boundary = positive("modulus", modulus), boundary
        free = library.flag_of_boundary(boundary)
        shear = self.modulus if self._components == 2 else 0.5 * self.modulus
        handle, mx, my = _open(int(self._components == 2), self.nx, self.ny, self.lx, self.ly, free,
                               shear, poisson, thickness)
        self._handle, self._transform = int(handle), (int(my), int(mx))
        weakref.finalize(self, library.close_soon, "operator_close", self._handle)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the fields."""
        return (self.ny, self.nx) if self._components == 1 else (2, self.ny, self.nx)

    def _field(self, name: str, field: ArrayLike) -> FloatArray:
        array = np.ascontiguousarray(array_of(name, field))
        if array.shape != self.shape:
            raise ValueError(f"{name}: has shape {array.shape}: must be {self.shape}")
        return array

    def _applied(self, tractions: FloatArray) -> FloatArray:
        """Return the displacements of a field that has been checked."""
        px, py = tractions if self._components == 2 else (tractions, np.zeros(self.shape))
        ux, uy = np.zeros((self.ny, self.nx)), np.zeros((self.ny, self.nx))
        _apply(self._handle, px.T, py.T, ux.T, uy.T)
        return np.stack([ux, uy]) if self._components == 2 else ux

    def _half(self, part: int) -> FloatArray:
        """Return a part of the symbol for the first half of the wave numbers along both axes."""
        my, mx = self._transform
        values = np.zeros((my // 2 + 1, mx // 2 + 1))
        _symbol(self._handle, part, values.T)
        return values

    def _whole(self, part: int, sign: int = 1) -> FloatArray:
        """Return a part of the symbol in the order of an FFT.

        `sign` is 1 for a part that is even in kx and ky, and -1 for one that is odd in both.
        """
        my, mx = self._transform
        kx, ky = np.arange(mx), np.arange(my)
        half = self._half(part)
        values = half[np.minimum(ky, my - ky)[:, None], np.minimum(kx, mx - kx)[None, :]]
        if sign < 0:
            flip_x = np.where(kx > mx // 2, -1.0, 1.0)
            flip_y = np.where(ky > my // 2, -1.0, 1.0)
            values = values * flip_x[None, :] * flip_y[:, None]
        return values

    def _solved(self, displacements: FloatArray, tolerance: float, most: int) -> FloatArray:
        """Return the tractions by conjugate gradients; the operator is symmetric and positive."""
        most = _checked(tolerance, most)
        periodic = self.boundary == "periodic"
        mean_axes = (-2, -1)
        target = displacements
        if periodic:
            target = target - target.mean(axis=mean_axes, keepdims=True)
        # Squares of very small or large displacements would leave the range of the numbers.
        unit = float(np.abs(target).max()) or 1.0
        found = np.zeros(self.shape)
        residual = target / unit
        direction = residual.copy()
        square = float(np.vdot(residual, residual))
        limit = tolerance**2 * square
        for _ in range(most):
            if square <= limit:
                return unit * found
            image = self._applied(direction)
            if periodic:
                image -= image.mean(axis=mean_axes, keepdims=True)
            length = square / float(np.vdot(direction, image))
            found += length * direction
            residual -= length * image
            old, square = square, float(np.vdot(residual, residual))
            direction = residual + (square / old) * direction
        if square <= limit:
            return unit * found
        raise NotConverged(f"inverse: the residual is {np.sqrt(square / limit) * tolerance:.3g}"
                           f" after {most} iterations, allowed {tolerance:g}", unit * found)

    def __repr__(self) -> str:
        kind = "tangential" if self._components == 2 else "normal"
        return (f"{kind} operator of {self.nx} x {self.ny} cells, {self.lx:g} m x {self.ly:g} m,"
                f" {self.boundary}, modulus {self.modulus:g} Pa")


def _checked(tolerance: float, max_iterations: int) -> int:
    """Check the options of an inverse, and return the largest number of iterations."""
    number("tolerance", tolerance, 0.0, 1.0, low_open=True, high_open=True)
    return whole_number("max_iterations", max_iterations)


class NormalOperator(_Operator):
    """Normal displacements of an elastic half-space from normal tractions, created by `normal`."""

    _components = 1

    def apply(self, pressure: ArrayLike) -> FloatArray:
        """Return the displacements that normal tractions cause.

        Parameters
        ----------
        pressure : array_like, shape (ny, nx)
            Normal tractions, Pa.

        Returns
        -------
        ndarray, shape (ny, nx)
            Normal displacements, m.

        Raises
        ------
        ValueError
            If the shape is wrong, or the values are not finite real numbers.
        """
        return self._applied(self._field("pressure", pressure))

    def inverse(self, displacement: ArrayLike, *, tolerance: float = 1e-12,
                max_iterations: int = 10000) -> FloatArray:
        """Return the normal tractions that cause given displacements.

        In a periodic cell the mean displacement is ignored, and the mean traction is zero. On a
        free patch the equations are solved by conjugate gradients.

        Parameters
        ----------
        displacement : array_like, shape (ny, nx)
            Normal displacements, m.
        tolerance : float
            Largest residual relative to the displacements, for a free patch. Above 0 and below 1.
        max_iterations : int
            Largest number of iterations, for a free patch.

        Returns
        -------
        ndarray, shape (ny, nx)
            Normal tractions, Pa.

        Raises
        ------
        ValueError
            If the shape is wrong, the values are not finite real numbers, or an option is not
            allowed.
        NotConverged
            If the tolerance is not reached. Its ``result`` are the tractions found so far.
        """
        field = self._field("displacement", displacement)
        if self.boundary != "periodic":
            return self._solved(field, tolerance, max_iterations)
        _checked(tolerance, max_iterations)
        symbol = self.symbol
        inverse = np.divide(1.0, symbol, out=np.zeros_like(symbol), where=symbol > 0.0)
        return np.fft.ifft2(inverse * np.fft.fft2(field)).real

    @property
    def symbol(self) -> FloatArray:
        """Real factors of the Fourier modes, m/Pa, in the order of ``numpy.fft.fft2``.

        In a periodic cell the shape is (ny, nx), and ``apply(p)`` is ``ifft2(symbol *
        fft2(p)).real``. On a free patch the shape is that of the grid padded with zeros, and the
        first ny x nx values of this product are the displacements.
        """
        return self._whole(1)


class TangentialOperator(_Operator):
    """Tangential displacements of an elastic half-space or block, created by `tangential`."""

    _components = 2

    def apply(self, traction: ArrayLike) -> FloatArray:
        """Return the displacements that tangential tractions cause.

        Parameters
        ----------
        traction : array_like, shape (2, ny, nx)
            Tangential tractions along x and y, Pa.

        Returns
        -------
        ndarray, shape (2, ny, nx)
            Tangential displacements, m.

        Raises
        ------
        ValueError
            If the shape is wrong, or the values are not finite real numbers.
        """
        return self._applied(self._field("traction", traction))

    def inverse(self, displacement: ArrayLike, *, tolerance: float = 1e-12,
                max_iterations: int = 10000) -> FloatArray:
        """Return the tangential tractions that cause given displacements, by conjugate gradients.

        In a periodic cell the mean displacement is ignored, and the mean traction is zero.

        Parameters
        ----------
        displacement : array_like, shape (2, ny, nx)
            Tangential displacements, m.
        tolerance : float
            Largest residual relative to the displacements. Above 0 and below 1.
        max_iterations : int
            Largest number of iterations.

        Returns
        -------
        ndarray, shape (2, ny, nx)
            Tangential tractions, Pa.

        Raises
        ------
        ValueError
            If the shape is wrong, the values are not finite real numbers, or an option is not
            allowed.
        NotConverged
            If the tolerance is not reached. Its ``result`` are the tractions found so far.
        """
        return self._solved(self._field("displacement", displacement), tolerance, max_iterations)

    @property
    def symbol(self) -> FloatArray:
        """Real factors of the Fourier modes, m/Pa, of shape (2, 2, ny, nx).

        Their order, and the size on a free patch, are those of `NormalOperator.symbol`.
        """
        xx, yy, xy = self._whole(1), self._whole(2), self._whole(3, sign=-1)
        return np.stack([np.stack([xx, xy]), np.stack([xy, yy])])


def normal(nx: int, ny: int, lx: float, ly: float | None = None, *, modulus: float,
           boundary: str = "periodic") -> NormalOperator:
    """Return the operator from normal tractions to normal displacements of a half-space.

    Parameters
    ----------
    nx, ny : int
        Number of cells.
    lx, ly : float
        Lengths of the grid, m; by default `ly` makes the cells square.
    modulus : float
        Contact modulus E* = 2 G/(1 - nu), Pa.
    boundary : str
        'periodic' or 'free'.

    Returns
    -------
    NormalOperator

    Raises
    ------
    ValueError
        If an argument is not allowed.
    MemoryError
        If there is not enough memory.

    Examples
    --------
    >>> import asperity, numpy as np
    >>> op = asperity.operators.normal(64, 64, 1.0, modulus=2.0)
    >>> p = np.cos(2 * np.pi * np.arange(64) / 64) * np.ones((64, 1))
    >>> np.allclose(op.apply(p), 2 / (2.0 * 2 * np.pi) * p)
    True
    >>> np.allclose(op.inverse(op.apply(p)), p)
    True
    """
    return NormalOperator(nx, ny, lx, ly, modulus, boundary, 0.0, 0.0)


def tangential(nx: int, ny: int, lx: float, ly: float | None = None, *, modulus: float,
               poisson: float = 0.5, thickness: float = 0.0, boundary: str = "periodic",
               ) -> TangentialOperator:
    """Return the operator from tangential tractions to tangential displacements of a half-space.

    Parameters
    ----------
    nx, ny : int
        Number of cells.
    lx, ly : float
        Lengths of the grid, m; by default `ly` makes the cells square.
    modulus : float
        Shear modulus G, Pa.
    poisson : float
        Poisson ratio.
    thickness : float
        Thickness of the block, m. In a periodic cell the mean traction T then causes the mean
        displacement thickness T/G. With 0 the mean displacement is zero. A free half-space has no
        thickness.
    boundary : str
        'periodic' or 'free'.

    Returns
    -------
    TangentialOperator

    Raises
    ------
    ValueError
        If an argument is not allowed.
    MemoryError
        If there is not enough memory.
    """
    thickness = number("thickness", thickness, 0.0)
    if thickness > 0.0 and boundary == "free":
        raise ValueError(f"thickness = {thickness:g}: must be 0 with boundary = 'free'")
    return TangentialOperator(nx, ny, lx, ly, modulus, boundary, poisson_ratio(poisson),
                              thickness)
