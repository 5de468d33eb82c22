"""The program with the transforms of MKL gives the results of the program with FFTW."""

import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

PROGRAM = Path(__file__).resolve().parents[2] / ".venv" / "bin" / "asperity-mkl"

pytestmark = pytest.mark.skipif(
    not PROGRAM.exists(), reason="the program with MKL is not built: run tools/build_mkl.sh")

ROAD = """&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.3, wavelength_long = 1e-3,
  wavelength_short = 1e-4, seed = 5 /
"""
RUBBER = "&material shear_modulus = 1e6, prony_g = 4e6, prony_tau = 1e-3 /\n"
CASES = {
    "normal": "&grid nx = 1024, ny = 540, lx = 1e-3 /\n" + ROAD.replace("1e-4", "2e-5")
              + "&material shear_modulus = 1e6 /\n&phase pressure = 2e4 /\n",
    "mixed": "&grid nx = 540, ny = 512, lx = 1e-3 /\n" + ROAD
             + "&material shear_modulus = 1e6 /\n&phase pressure = 2e5 /\n"
             + "&solver precision = 'mixed' /\n",
    "free": "&grid nx = 90, ny = 75, lx = 1e-3, boundary = 'free' /\n"
            "&surface shape = 'sphere', radius = 2e-3 /\n"
            "&material shear_modulus = 1e6 /\n&phase force = 0.02 /\n",
    "sliding": "&grid nx = 96, ny = 80, lx = 1e-3 /\n" + ROAD + RUBBER
               + "&friction law = 'coulomb', coefficient = 0.6 /\n&phase pressure = 2e5 /\n"
               "&phase velocity_x = 0.1, velocity_y = 0.03, duration = 1e-3, steps = 8 /\n",
    "steady": "&grid nx = 96, ny = 80, lx = 1e-3 /\n" + ROAD + RUBBER
              + "&phase pressure = 2e5, velocity_x = 0.1, steady = .true. /\n",
}


@pytest.mark.parametrize("name", CASES)
def test_same_result_as_with_fftw(name, program, tmp_path):
    case = tmp_path / "case.nml"
    case.write_text(CASES[name] + "&output file = 'case.h5' /\n")
    found = []
    for one in (program, PROGRAM):
        result = tmp_path / f"{Path(one).name}.h5"
        subprocess.run([one, "run", case, "--quiet", "--output", result], check=True,
                       capture_output=True)
        with h5py.File(result) as file:
            history = file["history"]
            found.append({key: history[key][()] for key in
                          ("contact_area", "displacement", "friction", "force")})
    for key, expected in found[0].items():
        # Both solve to 1e-6, so a few cells at the edges may differ in their state.
        np.testing.assert_allclose(found[1][key], expected, rtol=1e-4 if key == "contact_area" else
                                   1e-5, atol=1e-9, err_msg=key)


def test_fftw_is_not_used():
    version = subprocess.run([PROGRAM, "--version"], check=True, capture_output=True, text=True)
    assert "FFTW: none, but Intel" in version.stdout
    libraries = subprocess.run(["ldd", PROGRAM], check=True, capture_output=True, text=True).stdout
    assert "libmkl_core" in libraries
    assert "libfftw" not in libraries
