"""Programs of other people that use the Fortran library, built as they would build them.

One is an fpm project whose manifest names nothing but the library. The other is compiled by hand,
with the files that ``meson install`` installs and the flags that pkg-config prints.
"""

import os
import shutil
import subprocess

import pytest
from conftest import ROOT

# A sphere on an elastic half-space under a given load: by Hertz the approach is a^2/R.
PROGRAM = """\
program consumer
   use asperity, only : case_type, dp, error_type, new_simulation, parse_case, simulation_type
   implicit none
   type(case_type) :: case
   type(simulation_type) :: simulation
   type(error_type), allocatable :: error
   real(dp), parameter :: modulus = 2.0_dp*1e6_dp/(1.0_dp - 0.5_dp)

   call parse_case("&grid nx=64, ny=64, lx=2e-3, boundary='free' /"// &
      "&surface shape='paraboloid', radius=0.02 / &material shear_modulus=1e6 /"// &
      "&phase force=0.1 / &solver threads=2 /", 'consumer', case, error)
   if (.not. allocated(error)) call new_simulation(simulation, case, error)
   if (.not. allocated(error)) call simulation%advance(error)
   if (allocated(error)) error stop error%message
   print '(2es16.8)', simulation%state%row%displacement, &
      (0.75_dp*0.1_dp*0.02_dp/modulus)**(2.0_dp/3.0_dp)/0.02_dp
end program consumer
"""


def done(command, cwd, **surroundings):
    """Return what a command prints; if it fails, show its messages."""
    result = subprocess.run([str(word) for word in command], cwd=cwd, capture_output=True,
                            text=True, env=os.environ | surroundings)
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-3000:]
    return result.stdout


def check_answer(text):
    found, hertz = map(float, text.split()[-2:])
    assert found == pytest.approx(hertz, rel=2e-3)


def test_an_fpm_project_that_names_nothing_but_the_library(tmp_path):
    if not shutil.which("fpm"):
        pytest.skip("fpm is not installed")
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "main.f90").write_text(PROGRAM)
    # fpm takes the paths of dependencies as relative to the manifest.
    path = os.path.relpath(ROOT, tmp_path.resolve())
    (tmp_path / "fpm.toml").write_text(
        f'name = "consumer"\n[dependencies]\nasperity = {{ path = "{path}" }}\n')
    check_answer(done(["fpm", "run", "--profile", "debug"], tmp_path))


def test_a_program_compiled_with_what_meson_installs(tmp_path):
    build, prefix = tmp_path / "build", tmp_path / "prefix"
    done(["meson", "setup", build, f"--prefix={prefix}", "--libdir=lib", "-Dapp=false",
          "-Dbuildtype=plain"], ROOT)
    done(["meson", "install", "-C", build], ROOT)
    (tmp_path / "consumer.f90").write_text(PROGRAM)
    asked = {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    flags = done(["pkg-config", "--cflags", "--libs", "asperity"], tmp_path, **asked).split()
    assert f"-I{prefix}/include/asperity" in flags
    version = done(["pkg-config", "--modversion", "asperity"], tmp_path, **asked)
    assert version.strip() == (ROOT / "VERSION").read_text().strip()
    shutil.rmtree(build)
    done(["gfortran", "consumer.f90", "-o", "consumer", *flags], tmp_path)
    check_answer(done([tmp_path / "consumer"], tmp_path))
