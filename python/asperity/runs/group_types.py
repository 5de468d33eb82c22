"""The groups of an input and their variables, for type checkers and editors.

Written by `tools/make_types.py` from the program's table of the input; nothing here is used when a
program runs. A variable is read as the first of its two types and set as the second; None takes it
out of the input again.
"""

# ruff: noqa: D102, E501

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypedDict, TypeVar, overload

from numpy.typing import NDArray

from .groups import Group, Groups
from .sampled_law import Law

if TYPE_CHECKING:
    from typing_extensions import Unpack

Found = TypeVar("Found", covariant=True)
Given = TypeVar("Given", contravariant=True)
Path = str | PathLike[str]
Reals = Sequence[float] | NDArray[Any] | float


class Variable(Generic[Found, Given]):
    """A variable: how it is read and set."""

    def __get__(self, group: object, kind: type | None = None) -> Found:
        """Return the value, or the default."""
        raise NotImplementedError

    def __set__(self, group: object, value: Given) -> None:
        """Set the value."""


class HasHeights(Protocol):
    """A topography of SurfaceTopography."""

    def heights(self) -> Any: ...


class CaseGroup(Group):
    """A group ``&case``."""

    title: Variable[str, str | None]


class GridGroup(Group):
    """A group ``&grid``."""

    nx: Variable[int, int | None]
    ny: Variable[int, int | None]
    lx: Variable[float, float | None]
    ly: Variable[float | None, float | None]
    boundary: Variable[Literal['periodic', 'free'], Literal['periodic', 'free'] | None]


class SurfaceValues(TypedDict, total=False):
    """Values of ``&surface``."""

    shape: Literal['flat', 'sphere', 'paraboloid', 'cylinder', 'sine', 'hexagonal_wave', 'self_affine', 'file'] | None
    radius: float | None
    amplitude: float | None
    wavelength: float | None
    hurst: float | None
    wavelength_long: float | None
    wavelength_rolloff: float | None
    wavelength_short: float | None
    rms_height: float | None
    rms_slope: float | None
    seed: int | None
    generator: Literal['random_phase', 'filtered_noise'] | None
    file: Path | None
    dataset: str | None
    scale: float | None
    centre_x: float | None
    centre_y: float | None


class SurfaceGroup(Group):
    """A group ``&surface``."""

    shape: Variable[Literal['flat', 'sphere', 'paraboloid', 'cylinder', 'sine', 'hexagonal_wave', 'self_affine', 'file'], Literal['flat', 'sphere', 'paraboloid', 'cylinder', 'sine', 'hexagonal_wave', 'self_affine', 'file'] | None]
    radius: Variable[float, float | None]
    amplitude: Variable[float, float | None]
    wavelength: Variable[float, float | None]
    hurst: Variable[float, float | None]
    wavelength_long: Variable[float | None, float | None]
    wavelength_rolloff: Variable[float | None, float | None]
    wavelength_short: Variable[float | None, float | None]
    rms_height: Variable[float | None, float | None]
    rms_slope: Variable[float | None, float | None]
    seed: Variable[int, int | None]
    generator: Variable[Literal['random_phase', 'filtered_noise'], Literal['random_phase', 'filtered_noise'] | None]
    file: Variable[str, Path | None]
    dataset: Variable[str, str | None]
    scale: Variable[float, float | None]
    centre_x: Variable[float | None, float | None]
    centre_y: Variable[float | None, float | None]


class SurfaceGroups(Groups):
    """The groups ``&surface``."""

    if TYPE_CHECKING:
        @overload  # type: ignore[override]
        def __getitem__(self, index: int) -> SurfaceGroup: ...
        @overload
        def __getitem__(self, index: slice) -> list[SurfaceGroup]: ...
        def __getitem__(self, index: int | slice) -> Any: ...
        def __iter__(self) -> Iterator[SurfaceGroup]: ...
        def append(  # type: ignore[override]
            self, values: Mapping[str, Any] | None = None,
            **more: Unpack[SurfaceValues]) -> None: ...


class MaterialGroup(Group):
    """A group ``&material``."""

    poisson: Variable[float, float | None]
    shear_modulus: Variable[float, float | None]
    prony_g: Variable[list[float] | None, Reals | None]
    prony_tau: Variable[list[float] | None, Reals | None]
    zener_g0: Variable[list[float] | None, Reals | None]
    zener_g1: Variable[list[float] | None, Reals | None]
    zener_eta: Variable[list[float] | None, Reals | None]
    thickness: Variable[float, float | None]
    density: Variable[float, float | None]
    temperature: Variable[float | None, float | None]
    reference_temperature: Variable[float, float | None]
    wlf_c1: Variable[float, float | None]
    wlf_c2: Variable[float, float | None]


class AdhesionGroup(Group):
    """A group ``&adhesion``."""

    potential: Variable[Literal['none', 'exponential', 'gauss', 'maugis_dugdale'], Literal['none', 'exponential', 'gauss', 'maugis_dugdale'] | None]
    energy: Variable[float, float | None]
    range: Variable[float, float | None]
    start: Variable[Literal['non_adhesive', 'full_contact'], Literal['non_adhesive', 'full_contact'] | None]


class FrictionGroup(Group):
    """A group ``&friction``."""

    law: Variable[Literal['none', 'coulomb', 'constant_shear', 'coulomb_orowan', 'table'], Literal['none', 'coulomb', 'constant_shear', 'coulomb_orowan', 'table'] | Law | None]
    coefficient: Variable[float, float | None]
    shear_strength: Variable[float, float | None]
    table_pressure: Variable[list[float], Reals | None]
    table_strength: Variable[list[float], Reals | None]
    slope_effect: Variable[bool, bool | None]


class PhaseValues(TypedDict, total=False):
    """Values of ``&phase``."""

    name: str | None
    duration: float | None
    steps: int | None
    dt: float | None
    control: Literal['pressure', 'force', 'displacement'] | None
    pressure: float | None
    force: float | None
    displacement: float | None
    ramp: Literal['step', 'linear'] | None
    relaxed: bool | None
    steady: bool | None
    velocity_x: float | None
    velocity_y: float | None
    traction_x: float | None
    traction_y: float | None
    force_x: float | None
    force_y: float | None


class PhaseGroup(Group):
    """A group ``&phase``."""

    name: Variable[str | None, str | None]
    duration: Variable[float, float | None]
    steps: Variable[int | None, int | None]
    dt: Variable[float | None, float | None]
    control: Variable[Literal['pressure', 'force', 'displacement'] | None, Literal['pressure', 'force', 'displacement'] | None]
    pressure: Variable[float | None, float | None]
    force: Variable[float | None, float | None]
    displacement: Variable[float | None, float | None]
    ramp: Variable[Literal['step', 'linear'], Literal['step', 'linear'] | None]
    relaxed: Variable[bool, bool | None]
    steady: Variable[bool, bool | None]
    velocity_x: Variable[float, float | None]
    velocity_y: Variable[float, float | None]
    traction_x: Variable[float | None, float | None]
    traction_y: Variable[float | None, float | None]
    force_x: Variable[float | None, float | None]
    force_y: Variable[float | None, float | None]


class PhaseGroups(Groups):
    """The groups ``&phase``."""

    if TYPE_CHECKING:
        @overload  # type: ignore[override]
        def __getitem__(self, index: int) -> PhaseGroup: ...
        @overload
        def __getitem__(self, index: slice) -> list[PhaseGroup]: ...
        def __getitem__(self, index: int | slice) -> Any: ...
        def __iter__(self) -> Iterator[PhaseGroup]: ...
        def append(  # type: ignore[override]
            self, values: Mapping[str, Any] | None = None,
            **more: Unpack[PhaseValues]) -> None: ...


class SolverGroup(Group):
    """A group ``&solver``."""

    tolerance: Variable[float, float | None]
    max_iterations: Variable[int, int | None]
    method: Variable[Literal['fast', 'thesis'], Literal['fast', 'thesis'] | None]
    time_scheme: Variable[Literal['exponential2', 'exponential', 'backward_euler'], Literal['exponential2', 'exponential', 'backward_euler'] | None]
    passes: Variable[int, int | None]
    coupling_tolerance: Variable[float, float | None]
    slip_law: Variable[Literal['physical', 'thesis'], Literal['physical', 'thesis'] | None]
    interpolation: Variable[Literal['cubic', 'linear'], Literal['cubic', 'linear'] | None]
    precision: Variable[Literal['double', 'mixed'], Literal['double', 'mixed'] | None]
    threads: Variable[int, int | None]


class OutputGroup(Group):
    """A group ``&output``."""

    file: Variable[str | None, Path | None]
    snapshot_every: Variable[int, int | None]
    snapshot_times: Variable[list[float] | None, Reals | None]
    snapshot_fields: Variable[list[Literal['pressure', 'gap', 'displacement_z', 'contact', 'road_height', 'traction_x', 'traction_y', 'displacement_x', 'displacement_y', 'slip_x', 'slip_y']] | None, Sequence[Literal['pressure', 'gap', 'displacement_z', 'contact', 'road_height', 'traction_x', 'traction_y', 'displacement_x', 'displacement_y', 'slip_x', 'slip_y']] | Literal['pressure', 'gap', 'displacement_z', 'contact', 'road_height', 'traction_x', 'traction_y', 'displacement_x', 'displacement_y', 'slip_x', 'slip_y'] | None]
    checkpoint_every: Variable[int, int | None]
    checkpoint_minutes: Variable[float, float | None]
    compression: Variable[int, int | None]


class CaseGroups:
    """The groups of a case."""

    title: Variable[str, str]
    case: Variable[CaseGroup, Mapping[str, Any] | None]
    grid: Variable[GridGroup, Mapping[str, Any] | None]
    surface: Variable[SurfaceGroups, Iterable[Mapping[str, Any]] | Mapping[str, Any] | NDArray[Any] | HasHeights | None]
    material: Variable[MaterialGroup, Mapping[str, Any] | None]
    adhesion: Variable[AdhesionGroup, Mapping[str, Any] | None]
    friction: Variable[FrictionGroup, Mapping[str, Any] | None]
    phase: Variable[PhaseGroups, Iterable[Mapping[str, Any]] | Mapping[str, Any] | None]
    solver: Variable[SolverGroup, Mapping[str, Any] | None]
    output: Variable[OutputGroup, Mapping[str, Any] | None]

    if TYPE_CHECKING:
        def __init__(self, title: str | None = None, *,
                 case: Mapping[str, Any] | None = None,
                 grid: Mapping[str, Any] | None = None,
                 surface: Iterable[Mapping[str, Any]] | Mapping[str, Any] | NDArray[Any] | HasHeights | None = None,
                 material: Mapping[str, Any] | None = None,
                 adhesion: Mapping[str, Any] | None = None,
                 friction: Mapping[str, Any] | None = None,
                 phase: Iterable[Mapping[str, Any]] | Mapping[str, Any] | None = None,
                 solver: Mapping[str, Any] | None = None,
                 output: Mapping[str, Any] | None = None) -> None: ...
