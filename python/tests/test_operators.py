"""The operators for method developers against closed forms, the solvers, and numpy's FFT."""

import subprocess
import sys

import numpy as np
import pytest
from conftest import PATIENCE

import asperity


def random(*shape):
    return np.random.default_rng(7).standard_normal(shape)


@pytest.mark.parametrize(("nx", "ny"), [(24, 18), (15, 9), (32, 1), (10, 11)])
def test_the_normal_symbol_is_that_of_a_half_space(nx, ny):
    lx, ly, modulus = 2e-3, 1.1e-3, 3e6
    op = asperity.operators.normal(nx, ny, lx, ly, modulus=modulus)
    qx = 2 * np.pi * np.fft.fftfreq(nx, lx / nx)
    qy = 2 * np.pi * np.fft.fftfreq(ny, ly / ny)
    q = np.hypot(qx[None, :], qy[:, None])
    exact = np.divide(2.0, modulus * q, out=np.zeros_like(q), where=q > 0)
    assert op.symbol.shape == (ny, nx)
    assert np.allclose(op.symbol, exact, rtol=1e-12, atol=1e-25)
    p = random(ny, nx)
    assert np.allclose(op.apply(p), np.fft.ifft2(op.symbol * np.fft.fft2(p)).real,
                       rtol=0, atol=1e-12 * np.abs(op.apply(p)).max())
    assert np.allclose(op.inverse(op.apply(p)), p - p.mean(), atol=1e-9)


def test_the_solver_of_a_contact_uses_this_operator():
    height = asperity.surface.self_affine(48, 40, lx=1e-3, ly=0.9e-3, wavelength_short=1e-4,
                                          rms_slope=0.2)
    for boundary in ("periodic", "free"):
        contact = asperity.solve_normal(height, 1e-3, 0.9e-3, 4e6, pressure=5e4,
                                        boundary=boundary)
        op = asperity.operators.normal(48, 40, 1e-3, 0.9e-3, modulus=4e6, boundary=boundary)
        difference = op.apply(contact.pressure) - height - contact.gap
        assert np.ptp(difference) < 1e-4 * np.ptp(height)


def test_free_space_is_reciprocal_and_has_an_inverse():
    op = asperity.operators.normal(14, 11, 1e-3, 0.7e-3, modulus=1e6, boundary="free")
    p, s = random(2, 11, 14)
    assert np.vdot(s, op.apply(p)) == pytest.approx(np.vdot(p, op.apply(s)), rel=1e-12)
    assert np.allclose(op.inverse(op.apply(p)), p, atol=1e-8)
    for unit in (1e-170, 1e200):                # their squares are 0 and infinite
        assert np.allclose(op.inverse(op.apply(unit * p)) / unit, p, atol=1e-8)
    my, mx = op.symbol.shape
    assert my >= 2 * 11 - 1 and mx >= 2 * 14 - 1
    padded = np.zeros((my, mx))
    padded[:11, :14] = p
    image = np.fft.ifft2(op.symbol * np.fft.fft2(padded)).real[:11, :14]
    assert np.allclose(image, op.apply(p), rtol=0, atol=1e-12 * np.abs(image).max())
    with pytest.raises(asperity.NotConverged) as caught:
        op.inverse(op.apply(p), max_iterations=2)
    assert caught.value.result.shape == (11, 14)


@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("poisson", [0.5, 0.2])
def test_the_tangential_operator(boundary, poisson):
    nx, ny = 12, 10
    op = asperity.operators.tangential(nx, ny, 1e-3, 0.8e-3, modulus=1e6, poisson=poisson,
                                       boundary=boundary)
    t, s = random(2, 2, ny, nx)
    u = op.apply(t)
    assert np.vdot(s, u) == pytest.approx(np.vdot(t, op.apply(s)), rel=1e-11)
    my, mx = op.symbol.shape[2:]
    padded = np.zeros((2, my, mx))
    padded[:, :ny, :nx] = t
    image = np.fft.ifft2(np.einsum("abij,bij->aij", op.symbol, np.fft.fft2(padded))).real
    assert np.allclose(image[:, :ny, :nx], u, rtol=0, atol=1e-12 * np.abs(u).max())
    back = op.inverse(u)
    if boundary == "periodic":
        t = t - t.mean(axis=(1, 2), keepdims=True)
    assert np.allclose(back, t, atol=1e-7)


def test_the_tangential_symbol_of_a_half_space():
    n, length, shear, poisson = 12, 1e-3, 1e6, 0.3
    op = asperity.operators.tangential(n, n, length, modulus=shear, poisson=poisson)
    q = 2 * np.pi * 2 / length  # waves along x with tractions along and across them
    assert op.symbol[0, 0, 0, 2] == pytest.approx((1 - poisson) / (shear * q), rel=1e-12)
    assert op.symbol[1, 1, 0, 2] == pytest.approx(1 / (shear * q), rel=1e-12)
    assert op.symbol[0, 1, 0, 2] == pytest.approx(0.0, abs=1e-25)
    # An oblique wave: xy = -poisson qx qy/(G q^3), odd in each wave number.
    q = 2 * np.pi * np.hypot(1, 2) / length
    assert op.symbol[0, 1, 2, 1] == pytest.approx(-poisson * 2 / 5 / (shear * q), rel=1e-12)
    assert op.symbol[0, 1, 2, -1] == pytest.approx(poisson * 2 / 5 / (shear * q), rel=1e-12)


def test_wrong_shapes_and_values():
    op = asperity.operators.normal(8, 4, 1.0, 1.0, modulus=1.0)
    with pytest.raises(ValueError, match=r"must be \(4, 8\)"):
        op.apply(np.zeros((8, 4)))
    for wrong in (np.nan, np.inf):
        field = np.zeros((4, 8))
        field[2, 5] = wrong
        with pytest.raises(ValueError, match=rf"^pressure\[2, 5\] = {wrong}: must be finite$"):
            op.apply(field)
        with pytest.raises(ValueError, match=r"^displacement\[2, 5\] = .*: must be finite$"):
            op.inverse(field)
    with pytest.raises(ValueError, match="must be real numbers"):
        op.apply(np.full((4, 8), 1j))
    with pytest.raises(ValueError, match="1 of 32 points masked"):
        op.apply(np.ma.masked_equal(np.arange(32.0).reshape(4, 8), 3.0))
    along = asperity.operators.tangential(8, 4, 1.0, modulus=1.0)
    field = np.zeros((2, 4, 8))
    field[1, 2, 5] = np.nan
    with pytest.raises(ValueError, match=r"^traction\[1, 2, 5\] = nan: must be finite$"):
        along.apply(field)
    with pytest.raises(ValueError, match=r"^displacement\[1, 2, 5\] = nan: must be finite$"):
        along.inverse(field)
    with pytest.raises(ValueError, match="boundary"):
        asperity.operators.normal(8, 4, 1.0, modulus=1.0, boundary="open")
    with pytest.raises(ValueError, match="modulus"):
        asperity.operators.normal(8, 4, 1.0, modulus=-1.0)
    with pytest.raises(ValueError, match="poisson"):
        asperity.operators.tangential(8, 4, 1.0, modulus=1.0, poisson=0.7)
    assert "8 x 4 cells" in repr(op)


def test_options_are_checked():
    for wrong in (-1.0, np.nan, np.inf, None, "a"):
        with pytest.raises(ValueError, match=r"^thickness = .*: must be a finite number >= 0$"):
            asperity.operators.tangential(8, 4, 1.0, modulus=1.0, thickness=wrong)
    with pytest.raises(ValueError, match=r"^thickness = 2: must be 0 with boundary = 'free'$"):
        asperity.operators.tangential(8, 4, 1.0, modulus=1.0, thickness=2.0, boundary="free")
    with pytest.raises(ValueError, match="nx = 2147483648: must be an integer from 1 to 214748364"):
        asperity.operators.normal(2**31, 4, 1.0, modulus=1.0)
    cases = [(asperity.operators.normal(8, 4, 1.0, modulus=1.0, boundary=boundary), (4, 8))
             for boundary in ("periodic", "free")]
    cases.append((asperity.operators.tangential(8, 4, 1.0, modulus=1.0), (2, 4, 8)))
    for op, shape in cases:
        for wrong in (0.0, -1.0, np.nan, 1.0):
            with pytest.raises(ValueError, match=r"^tolerance = .*: must be a finite number > 0"):
                op.inverse(np.ones(shape), tolerance=wrong)
        for wrong in (-3, 0, 2.5):
            with pytest.raises(ValueError, match=r"^max_iterations = .*: must be a positive int"):
                op.inverse(np.ones(shape), max_iterations=wrong)


COLLECTED = """
import gc, numpy as np, asperity
from asperity.base import library

class CollectingLock:
    def __init__(self, lock):
        self.lock, self.locked = lock, lock.locked
    def __enter__(self):
        self.lock.acquire()
        gc.collect()
    def __exit__(self, *error):
        self.lock.release()

gc.disable()
gc.freeze()                                 # makes the collections short
library._lock = CollectingLock(library._lock)
for _ in range(30):
    operator = asperity.operators.normal(8, 8, 1.0, modulus=1.0)
    operator.itself = operator              # only the garbage collector frees it
    del operator
    asperity.surface.statistics(np.zeros((8, 8)), 1.0)
"""


def test_the_garbage_collector_may_free_an_operator_during_a_call():
    """The call that is running must not wait for the one that frees the operator."""
    subprocess.run([sys.executable, "-c", COLLECTED], check=True, timeout=PATIENCE)
