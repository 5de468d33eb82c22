"""Pictures are written and show what they should."""

import errno
import io
import resource
import subprocess
import sys
from contextlib import contextmanager, redirect_stderr, redirect_stdout

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import frictional_result, write_result
from matplotlib.colors import to_rgba
from matplotlib.legend import Legend
from matplotlib.patches import Rectangle
from matplotlib.quiver import Quiver, QuiverKey

import asperity
from asperity.__main__ import main
from asperity.plot import plot_history, si_scale
from asperity.views.colour_scales import field_style
from asperity.views.plot_road import plot_road
from asperity.views.style import NO_CONTACT, SLIP, STICK


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def is_picture(path):
    """Return whether a file is a PNG of more than one colour."""
    return path.read_bytes().startswith(b"\x89PNG") and np.ptp(plt.imread(path)[..., :3]) > 0.5


@pytest.mark.parametrize(("value", "units", "expected"), [
    (1.0, "m", (1.0, "m")),
    (999.0, "Pa", (1.0, "Pa")),
    (1000.0, "Pa", (1e-3, "kPa")),
    (2e-6, "m", (1e6, "µm")),
    (-4e-9, "J", (1e9, "nJ")),
    (0.0, "m", (1.0, "m")),
    (3e-16, "J", (1e18, "aJ")),
    (4e-19, "J", (1.0, "J")),
    (0.02, "m/s", (1e3, "mm/s")),
    (9000.0, "s", (1.0, "s")),
    (5e3, "kg/m3", (1.0, "kg/m3")),
    (np.nan, "m", (1.0, "m")),
    (0.1, "1", (1.0, "")),
])
def test_si_prefixes(value, units, expected):
    factor, unit = si_scale(value, units)
    assert (pytest.approx(expected[0]), expected[1]) == (factor, unit)


def test_map(result):
    axes = asperity.open(result).snapshots[-1].plot("pressure")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (mm)", "y (mm)")
    bar = next(other for other in axes.figure.axes if other is not axes)
    assert bar.get_ylabel() == "pressure (kPa)"
    image = axes.images[0]
    # The pressure is in kPa; cells without contact are masked and not coloured as zero.
    assert image.get_array().max() == pytest.approx(200.0)
    assert image.get_array().mask.any()
    np.testing.assert_allclose(image.get_extent(), [-0.05, 2.35, -0.05, 1.55], atol=1e-12)
    assert "step 5" in axes.get_title()


def test_the_scale_of_both_signs_shows_each_of_them(result):
    """White is zero, and each sign has half of the colours for its own values."""
    with h5py.File(result, "a") as file:
        pressure = file["snapshots/000005/pressure"]
        values = pressure[()]
        pressure[...] = np.where(values > 0.0, values, -0.15 * values.max())
    snapshot = asperity.open(result).snapshots[-1]
    axes = snapshot.plot("pressure")
    norm, peak = axes.images[0].norm, 1e-3 * values.max()
    assert (norm.vmin, norm.vmax) == pytest.approx((-0.15 * peak, peak))
    assert np.asarray(norm([norm.vmin, 0.0, norm.vmax])) == pytest.approx([0.0, 0.5, 1.0])
    (bar,) = (other for other in axes.figure.axes if other is not axes)
    ticks = bar.get_yticks()
    for part in (ticks[ticks < 0.0], ticks[ticks > 0.0]):  # both halves of the bar have numbers
        assert len(part) and abs(part).max() <= max(-norm.vmin, norm.vmax)
    image = snapshot.plot("traction_x").images[0]
    assert image.norm.vmin == pytest.approx(-image.norm.vmax)  # both signs have the same size


def legend_of(axes):
    """Return the texts of the legend."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_contact_map_names_its_states(frictional):
    snapshot = asperity.open(frictional).snapshots[-1]
    axes = snapshot.plot("contact")
    shares = [100 * np.mean(snapshot.contact == state) for state in range(3)]
    names = [f"{name} {share:.3g} %"
             for name, share in zip(("open", "stick", "slip"), shares, strict=True)]
    assert legend_of(axes) == names
    image = axes.images[0]
    colours = image.cmap(image.norm([0, 1, 2]))
    np.testing.assert_allclose(
        colours, [to_rgba(colour) for colour in (NO_CONTACT, STICK, SLIP)])
    assert axes.get_title().startswith("Stick and slip, step 5")


def test_traction_arrows_stand_in_contact(frictional):
    snapshot = asperity.open(frictional).snapshots[-1]
    axes = snapshot.plot("contact")
    (arrows,) = (item for item in axes.collections if isinstance(item, Quiver))
    i = np.rint(arrows.X / 0.1).astype(int)  # cells of 0.1 mm
    j = np.rint(arrows.Y / 0.1).astype(int)
    assert len(i) > 20
    assert np.all(snapshot.contact[j, i] > 0)
    np.testing.assert_allclose(arrows.U, snapshot.traction_x[j, i])
    np.testing.assert_allclose(arrows.V, snapshot.traction_y[j, i])
    # The key shows a round length, at most that of the longest arrow, with its unit.
    (key,) = (item for item in axes.get_children() if isinstance(item, QuiverKey))
    assert f"{key.U:g}"[0] in "125"
    assert 0.4 * np.hypot(arrows.U, arrows.V).max() < key.U
    assert np.hypot(arrows.U, arrows.V).max() >= key.U
    assert key.text.get_text() == "traction 50 kPa"
    # The longest arrow may be somewhat longer than the squares into which the map is divided.
    longest = np.hypot(arrows.U, arrows.V).max() / arrows.scale
    assert longest == pytest.approx(1.5 * 2.4 / 22)
    assert not any(isinstance(item, Quiver)
                   for item in snapshot.plot("contact", arrows=False).collections)
    assert any(isinstance(item, Quiver)
               for item in snapshot.plot("pressure", arrows=True).collections)


def test_without_friction_there_is_contact_and_no_arrow(tmp_path):
    path = write_result(tmp_path / "elastic.h5")
    with h5py.File(path, "a") as file:
        file.attrs["settings"] = "&friction\n  law = 'none'\n/\n"
    axes = asperity.open(path).snapshots[-1].plot("contact")
    names = legend_of(axes)
    assert [name.split()[0] for name in names] == ["open", "contact"]
    assert sum(float(name.split()[1]) for name in names) == pytest.approx(100.0, abs=0.2)
    assert not any(isinstance(item, Quiver) for item in axes.collections)


def test_line_contact_shades_stick_and_slip(tmp_path):
    path = frictional_result(tmp_path / "line.h5", ny=1)
    snapshot = asperity.open(path).snapshots[-1]
    axes = snapshot.plot("contact")
    spans = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert len(spans) == 1 + np.count_nonzero(np.diff(snapshot.contact[0]))
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    assert set(lines) == {"Pressure", "Traction along x", "Traction along y"}
    np.testing.assert_allclose(lines["Pressure"], snapshot.pressure[0] / 1e3)
    # The legend of the lines lies between data and title.
    axes.figure.canvas.draw()
    (legend,) = (item for item in axes.artists if isinstance(item, Legend))
    box = legend.get_window_extent()
    assert box.y0 >= axes.get_window_extent().y1 - 1.0
    assert box.y1 <= axes.title.get_window_extent().y0 + 1.0


def test_friction_is_split_into_its_causes(frictional):
    run = asperity.open(frictional)
    axes = run.plot("friction")
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(lines["whole"], run.history["friction"])
    np.testing.assert_allclose(lines["pressure on slopes"], run.history["friction_viscous"])
    np.testing.assert_allclose(lines["pressure on slopes"] + lines["interface"], lines["whole"])
    assert legend_of(axes)[:3] == ["whole", "pressure on slopes", "interface"]


def test_attraction_outside_the_contact(tmp_path):
    # One wave along x that has moved by a known distance; uniform attraction in open cells.
    path = frictional_result(tmp_path / "adhesive.h5", nx=64, ny=4)
    with h5py.File(path, "a") as file:
        file.attrs["settings"] = "&adhesion\n  potential = 'gauss'\n/\n"
        lx = file["grid"].attrs["lx"]
        x = file["grid/x"][()]
        file["surface/height"][...] = 1e-6 * np.cos(2 * np.pi * x / lx)
        way = file["history/road_x"][-1]
        pressure = np.where(x < lx / 4, -1e3, 3e3) * np.ones((4, 1))
        group = file["snapshots/000005"]
        group["pressure"][...] = pressure
        group["contact"][...] = (pressure > 0).astype(np.int8)
    run = asperity.open(path)
    axes = run.plot("friction")
    (line,) = (line for line in axes.lines if line.get_label().startswith("attraction"))
    k = 2 * np.pi / lx
    dx = lx / 64
    slope = -1e-6 * np.sin(k * (x - way)) * np.sin(k * dx) / dx  # the factor of central differences
    expected = 1e3 * np.mean(slope * (x < lx / 4)) / pressure.mean()
    assert line.get_ydata()[-1] == pytest.approx(expected, rel=5e-3)
    assert line.get_xdata()[-1] == pytest.approx(5.0)  # ms


def test_stick_area_and_sliding_speed(frictional):
    run = asperity.open(frictional)
    lines = {line.get_label(): line.get_ydata() for line in run.plot("contact_area").lines}
    np.testing.assert_allclose(lines["sticking"], run.history["stick_area"])
    lines = {line.get_label(): line.get_ydata() for line in run.plot("sliding_speed").lines}
    # The road moves by 20 um in each millisecond.
    np.testing.assert_allclose(lines["road against the block's top"][1:], 20.0)
    np.testing.assert_allclose(lines["mean of the interface"],
                               1e3 * run.history["sliding_speed"])


def test_energy_picture_shows_the_error_of_the_balance(frictional):
    axes = asperity.open(frictional).plot("energy")
    lines = {line.get_label(): line.get_ydata() for line in axes.lines if len(line.get_ydata())}
    assert set(lines) == {"work put in", "stored", "lost in the rubber", "lost by friction"}
    total = lines["stored"] + lines["lost in the rubber"] + lines["lost by friction"]
    np.testing.assert_allclose(lines["work put in"][:-1], total[:-1], rtol=1e-12)
    # The sample's last row has an error of a thousandth of the largest term.
    assert "balance closes to 0.001" in [text.get_text() for text in axes.get_legend().get_texts()]
    assert axes.get_ylabel() == "energy (nJ)"


def test_overview_of_friction(frictional):
    figure = asperity.open(frictional).plot()
    titles = [axes.get_title() for axes in figure.axes]
    labels = [axes.get_ylabel() for axes in figure.axes]
    for name in ("friction coefficient", "contact area fraction", "sliding speed (mm/s)"):
        assert name in labels
    assert "Pressure" in titles and "Stick and slip" in titles
    assert figure.get_size_inches()[0] == pytest.approx(7.2)
    with pytest.raises(ValueError, match="need the name of a column"):
        asperity.open(frictional).plot(x="step")


def test_overview_of_friction_without_maps_shows_its_history(frictional):
    """Snapshots need not store pressure and contact: `snapshot_fields = 'gap'`."""
    with h5py.File(frictional, "a") as file:
        for snapshot in file["snapshots"].values():
            for name in {"pressure", "contact"} & set(snapshot):
                del snapshot[name]
    figure = asperity.open(frictional).plot()
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "friction coefficient", "contact area fraction", "sliding speed (mm/s)"]


def test_nothing_overlaps_on_the_contact_map(frictional):
    axes = asperity.open(frictional).snapshots[-1].plot("contact")
    figure = axes.figure
    figure.canvas.draw()
    (key,) = (item for item in axes.get_children() if isinstance(item, QuiverKey))
    boxes = [item.get_window_extent() for item in
             (axes.title, axes.xaxis.label, axes.get_legend(), key.text)]
    for number, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[number + 1:])
        assert figure.bbox.fully_containsx(box.x0) and figure.bbox.fully_containsx(box.x1)
        assert figure.bbox.fully_containsy(box.y0) and figure.bbox.fully_containsy(box.y1)


def test_run_of_one_row_shows_a_section(tmp_path):
    path = write_result(tmp_path / "one.h5", rows=2)
    with h5py.File(path, "a") as file:
        file.attrs["input"] = "&surface shape = 'sphere' /\n"
        for column in file["history"].values():
            column.resize((1,))
    run = asperity.open(path)
    panel = run.plot().axes[2]
    assert panel.get_title().startswith("Section at y = ")
    pressure = run.snapshots[-1].pressure
    np.testing.assert_allclose(panel.lines[0].get_ydata(), pressure[0] / 1e3)
    assert pressure[0].max() == pressure.max()


def test_run_without_snapshots_shows_its_history(frictional):
    with h5py.File(frictional, "a") as file:
        del file["snapshots"]
    run = asperity.open(frictional)
    assert run.plot().axes[0].get_ylabel() == "friction coefficient"
    assert len(run.plot().axes) == 3


def test_line_contact_is_a_profile(tmp_path):
    run = asperity.open(write_result(tmp_path / "line.h5", ny=1))
    axes = run.snapshots[-1].plot("gap")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (mm)", "gap (µm)")
    assert len(axes.lines[0].get_xdata()) == 24
    assert len(run.overview().axes) == 3


def test_history(result):
    run = asperity.open(result)
    axes = run.plot("contact_area")
    assert axes.get_xlabel() == "pressure (kPa)"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), run.history["pressure"] / 1e3)
    assert run.plot("pressure", x="step").get_ylabel() == "pressure (kPa)"
    with pytest.raises(KeyError, match="did you mean 'contact_area'"):
        run.plot("contact_are")


def test_history_of_a_run_in_time(tmp_path):
    run = asperity.open(write_result(tmp_path / "time.h5", moving=True))
    assert run.plot("friction").get_xlabel() == "time (ms)"
    assert "friction" in run.overview().axes[2].get_title()


def test_overview_shows_persson_for_elastic_rough_contact(result):
    figure = asperity.open(result).overview()
    area = next(axes for axes in figure.axes if axes.get_legend())
    lines = {line.get_label(): line for line in area.lines}
    assert set(lines) == {"Persson (2001)", "this run"}
    # A product of cosines of amplitude a has the mean square slope a^2 (kx^2 + ky^2)/4.
    kx, ky = 2 * np.pi / 2.4e-3, 2 * np.pi / 1.6e-3
    slope = 2e-6 * np.sqrt((kx**2 + ky**2) / 4)
    line = lines["Persson (2001)"]
    initial = line.get_ydata()[1] / (line.get_xdata()[1] * 1e3)
    assert initial == pytest.approx(np.sqrt(8 / np.pi) / (4e6 * slope), rel=1e-3)


def test_command(result, capsys):
    assert main(["plot", str(result)]) == 0
    assert is_picture(result.with_suffix(".png"))
    picture = result.parent / "field.png"
    assert main(["plot", str(result), "--field", "gap", "--step", "0", "-o", str(picture)]) == 0
    assert is_picture(picture)
    assert str(picture) in capsys.readouterr().out
    assert main(["plot", str(result), "--history", "pressure", "--x", "step"]) == 0
    capsys.readouterr()
    assert main(["plot", str(result), "-o", str(result.parent)]) == 3
    assert "is a folder: name a picture in it" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "status", "message"), [
    (["--field", "presure"], 2, "did you mean 'pressure'"),
    (["--field", "gap", "--step", "3"], 2, "there are those of 0, 5"),
    (["-o", "/nowhere/at/all.png"], 3, "all.png"),
    (["-o", "picture.xyz"], 2, "picture.xyz: the ending must be .png"),
    (["-o", "picture"], 2, "picture: the ending must be .png"),
    (["--show"], 2, "--show: no window can be opened: there is no display"),
    (["--show", "--field", "gap"], 2, "--show: no window can be opened"),
])
def test_command_errors(result, capsys, words, status, message):
    assert main(["plot", str(result), *words]) == status
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(("words", "message"), [
    (["plot", "a.h5", "--fild", "gap"],
     "unrecognized arguments: --fild gap; did you mean --field?"),
    (["friction", "a.h5", "--material", "r.nml", "--presures=1e5"], "did you mean --pressures?"),
    (["friction", "a.h5", "--material", "r.nml", "--bad", "3"], "unrecognized arguments: --bad 3"),
])
def test_unknown_options_get_the_usage_of_their_verb(capsys, words, message):
    with pytest.raises(SystemExit) as error:
        main(words)
    assert error.value.code == 2
    printed = capsys.readouterr().err
    assert f"asperity {words[0]} [-h]" in printed
    assert message in printed


def test_command_from_the_shell(result, tmp_path):
    def call(*words):
        return subprocess.run([sys.executable, "-m", "asperity", *words], capture_output=True,
                              text=True, cwd=tmp_path, check=False)

    assert "plot" in call("--help").stdout
    assert call("plot", "--help").returncode == 0
    assert call().returncode == 2
    missing = call("plot", "none.h5")
    assert missing.returncode == 3
    assert "none.h5: no such file" in missing.stderr
    assert "Traceback" not in missing.stderr


def test_a_jump_of_speed_is_drawn_over_the_travel(tmp_path):
    path = write_result(tmp_path / "jump.h5", moving=True)
    with h5py.File(path, "a") as file:
        history = file["history"]
        rows = len(history["time"])
        del history["phase"], history["time"]
        for name, values, units in (
                ("phase", [1, 2, 2, 3, 3, 3], "1"), ("time", [0, 1, 2, 2.01, 2.02, 2.03], "s"),
                ("road_x", [0, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4], "m"), ("road_y", np.zeros(6), "m")):
            history[name] = np.asarray(values)[:rows]
            history[name].attrs.update(units=units, long_name=name)
    panel = asperity.open(path).overview().axes[2]
    assert panel.get_xlabel() == "travel of the road (µm)"
    assert panel.lines[0].get_xdata()[-1] == pytest.approx(500.0)


def test_titles_are_not_read_as_formulas(result, tmp_path):
    with h5py.File(result, "a") as file:
        file.attrs["title"] = "5 $ and $_ more"
    run = asperity.open(result)
    run.plot().savefig(tmp_path / "overview.png")
    run.plot("contact_area").figure.savefig(tmp_path / "area.png")
    assert is_picture(tmp_path / "overview.png")


@pytest.fixture(scope="module")
def pull_off(tmp_path_factory):
    """A sphere in free mode that is pulled off by a prescribed approach."""
    case = tmp_path_factory.mktemp("free") / "sphere.nml"
    case.write_text("""
        &grid nx = 32, ny = 32, lx = 30e-6, boundary = 'free' /
        &surface shape = 'sphere', radius = 50e-6 /
        &material shear_modulus = 1e6, poisson = 0.5 /
        &adhesion potential = 'exponential', energy = 0.05, range = 200e-9 /
        &phase displacement = 4e-7 /
        &phase displacement = -2e-7, steps = 6, ramp = 'linear' /
        """)
    return asperity.run(case)


def test_the_overview_of_a_pull_off_in_static_phases(tmp_path):
    (tmp_path / "sphere.nml").write_text("""
        &grid nx = 16, ny = 16, lx = 30e-6, boundary = 'free' /
        &surface shape = 'sphere', radius = 50e-6 /
        &material shear_modulus = 1e6 /
        &phase force = 1e-6 /
        &phase displacement = 4e-7 /
        &phase displacement = 2e-7 /
        """)
    run = asperity.run(tmp_path / "sphere.nml")
    assert run.overview().axes[2].get_title() == "Force against approach"


def test_the_load_of_a_free_contact_is_a_force(pull_off):
    """The size of the grid is arbitrary in free mode, and so is the mean pressure."""
    force = pull_off.history["pressure"] * 30e-6**2
    axes = pull_off.plot("force", x="displacement")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("approach (nm)", "normal force (µN)")
    np.testing.assert_allclose(axes.lines[0].get_ydata(), force * 1e6)
    assert pull_off.plot("contact_area").get_xlabel() == "normal force (µN)"
    panel = pull_off.overview().axes[2]
    assert panel.get_title() == "Force against approach"
    np.testing.assert_allclose(panel.lines[0].get_ydata(), force * 1e6)
    assert f"force {force[-1]:.6g} N" in repr(pull_off)
    with pytest.raises(KeyError, match="did you mean 'force'"):
        pull_off.plot("contact_area", x="forc")


def test_a_small_contact_of_a_free_map_is_enlarged(tmp_path):
    path = frictional_result(tmp_path / "sphere.h5", nx=64, ny=48, ly=1.8e-3, boundary="free")
    with h5py.File(path, "a") as file:
        contact = np.zeros((48, 64), np.int8)
        contact[20:24, 30:38] = 2
        file["snapshots/000005/contact"][...] = contact
    snapshot = asperity.open(path).snapshots[-1]
    axes = snapshot.plot("contact")
    # Cells of 37.5e-3 mm: half as wide again as the contact of eight.
    np.testing.assert_allclose(axes.get_xlim(), np.array([33.5 - 6, 33.5 + 6]) * 37.5e-3)
    np.testing.assert_allclose(axes.get_ylim(), np.array([21.5 - 6, 21.5 + 6]) * 37.5e-3)
    assert len(axes.figure.axes) == 1
    (arrows,) = (item for item in axes.collections if isinstance(item, Quiver))
    assert arrows.N == 32  # each of its cells
    with h5py.File(path, "a") as file:
        file["snapshots/000005/contact"][...] = 1
    axes = snapshot.plot("contact")
    np.testing.assert_allclose(axes.get_xlim(), [-0.5 * 37.5e-3, 63.5 * 37.5e-3])


def test_key_of_the_arrows_is_above_a_flat_map(tmp_path):
    path = frictional_result(tmp_path / "flat.h5", nx=96, ny=6, ly=0.15e-3)
    axes = asperity.open(path).snapshots[-1].plot("contact")
    axes.figure.canvas.draw()
    (key,) = (item for item in axes.get_children() if isinstance(item, QuiverKey))
    assert key.text.get_window_extent().y0 > axes.get_window_extent().y1


def test_data_of_one_sign_have_a_scale_of_one_sign(frictional):
    snapshot = asperity.open(frictional).snapshots[-1]
    for sign in (1.0, -1.0):
        factor, _, style = field_style(
            sign * np.linspace(0.0, 2e5, 12).reshape(3, 4), "traction_x", "Pa")
        norm = style["norm"]
        assert sorted((norm.vmin, norm.vmax), key=abs) == [0.0, sign * 2e5 * factor]
        assert "viridis" in style["cmap"]
    _, _, style = field_style(np.array([[-1.0, 2.0]]), "traction_x", "Pa")
    assert (style["norm"].vmin, style["norm"].vmax) == (-2.0, 2.0) and style["cmap"] == "RdBu_r"
    _, _, style = field_style(np.array([[-3.0, 0.0]]), "pressure", "Pa")
    assert style["cmap"].name == "Blues_r", "a tension is blue without pressures beside it, too"
    assert snapshot.plot("pressure").images


@pytest.mark.parametrize(("nx", "ny"), [(1024, 4), (4, 1024)])
@pytest.mark.parametrize("name", ["pressure", "contact"])
def test_labels_of_very_oblong_maps_do_not_overlap(tmp_path, nx, ny, name):
    path = frictional_result(tmp_path / "oblong.h5", nx=nx, ny=ny, lx=nx * 1e-5, ly=ny * 1e-5)
    axes = asperity.open(path).snapshots[-1].plot(name)
    axes.figure.canvas.draw()
    assert "stretched 32 times" in axes.get_xlabel()
    box = axes.get_window_extent()
    assert box.width / box.height == pytest.approx(8.0 if nx > ny else 1 / 8, rel=1e-3)
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        labels = [tick.label1 for tick in axis.get_major_ticks()
                  if limits[0] <= tick.get_loc() <= limits[1]]
        boxes = [label.get_window_extent() for label in labels] + [axis.label.get_window_extent()]
        if name == "contact" and axis is axes.xaxis:
            boxes.append(axes.get_legend().get_window_extent())
        assert len(labels) >= 2
        assert not any(one.overlaps(other) for number, one in enumerate(boxes)
                       for other in boxes[number + 1:])


def test_narrow_maps_of_the_overview_have_upright_labels_and_bars(tmp_path):
    """Labels in a row would overlap below a narrow map, and a bar below it would be far away."""
    path = tmp_path / "narrow.h5"
    write_result(path, nx=16, ny=128, lx=1e-3, ly=8e-3)
    figure = asperity.open(path).overview()
    figure.canvas.draw()
    for panel in figure.axes[:2]:
        assert all(label.get_rotation() == 90.0 for label in panel.get_xticklabels())
        (bar,) = (axes for axes in figure.axes if axes.get_ylabel().startswith(
            panel.get_title().lower()))
        assert bar.get_window_extent().height > 4.0 * bar.get_window_extent().width


def test_arrows_on_a_stretched_map_have_the_directions_of_the_tractions(tmp_path):
    path = frictional_result(tmp_path / "oblong.h5", nx=1024, ny=4, lx=1024e-5, ly=4e-5)
    axes = asperity.open(path).snapshots[-1].plot("contact")
    axes.figure.canvas.draw()
    (arrows,) = (item for item in axes.collections if isinstance(item, Quiver))
    assert arrows.angles == "uv"
    # The scale is that of a map on which x and y have the same scale.
    assert arrows.scale_units == "x"


def test_the_label_of_a_bar_is_whole_on_a_flat_map(tmp_path):
    path = tmp_path / "flat.h5"
    write_result(path, nx=48, ny=24, lx=2e-3, ly=1e-3)
    for name in ("pressure", "displacement_z"):
        snapshot = asperity.open(path).snapshots[-1]
        if name not in snapshot:
            continue
        figure = snapshot.plot(name).figure
        figure.canvas.draw()
        bar = figure.axes[1]
        label = bar.xaxis.label if bar.get_xlabel() else bar.yaxis.label
        box, frame = label.get_window_extent(), figure.bbox
        assert label.get_text() and frame.x0 <= box.x0 and box.x1 <= frame.x1
        assert frame.y0 <= box.y0 and box.y1 <= frame.y1


def test_a_constant_column_is_a_level_line(frictional):
    steady = asperity.open(frictional)
    steady.history._values["pressure"] = 4e5 * (1 + 1e-10 * np.arange(steady.history.rows))
    axes = plot_history(steady, "pressure")
    low, high = axes.get_ylim()
    assert low == 0.0 and high == pytest.approx(500.0, rel=1e-3)


def test_the_legend_lies_off_the_data(frictional):
    axes = asperity.open(frictional).plot("friction")
    axes.figure.canvas.draw()
    assert axes.get_legend().get_window_extent().y0 >= axes.get_window_extent().y1 - 1.0
    title = axes.title.get_window_extent()
    assert not axes.title.get_text() or title.y0 >= axes.get_legend().get_window_extent().y1 - 1.0


@contextmanager
def small_disk(size=40):
    """Let no file become larger than some bytes, so that writing fails half-way."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_the_gap_of_full_contact_is_drawn_as_zero(tmp_path):
    """The colours used to show the round-off of the gap, and the bar of a zero gap ended at 1 m."""
    case = asperity.Case(grid={"nx": 16, "ny": 16, "lx": 1e-3},
                         surface={"shape": "sine", "wavelength": 1e-3, "amplitude": 1e-6},
                         material={"shear_modulus": 1e6}, phase={"pressure": 1e6},
                         output={"file": str(tmp_path / "full.h5")})
    snapshot = asperity.run(case).snapshots[-1]
    axes = snapshot.plot("gap")
    assert not axes.images[0].get_array().any()
    bar = axes.images[0].colorbar
    assert [tick.get_text() for tick in bar.ax.get_yticklabels() + bar.ax.get_xticklabels()
            if tick.get_text()] == ["0"]


@pytest.mark.parametrize("name", ["a.png", "a.gif", "a.html", "a.vti", "a.nml", "fit.nml",
                                  "fit.csv"])
def test_a_full_disk_leaves_the_file_of_before(tmp_path, name):
    """A file that could not be written whole does not exist, or is that of before."""
    run = asperity.open(frictional_result(tmp_path / "road.h5"))
    omega = np.logspace(0, 4, 30)
    modulus = asperity.material.Prony(1e6, [2e6, 3e6], [1e-3, 1e-2]).complex_modulus(omega)
    (tmp_path / "dma.csv").write_text("f (rad/s),G' (Pa),G'' (Pa),T (C)\n" + "".join(
        f"{f},{m.real},{m.imag},{t}\n" for t, factor in ((20, 1.0), (30, 5.0))
        for f, m in zip(omega * factor, modulus, strict=True)))
    case = asperity.Case(title="Long " * 30, grid=dict(nx=8, ny=8, lx=1.0))
    target = tmp_path / name
    command = {"a.png": ["plot", run.path, "-o"], "a.html": ["report", run.path, "-o"],
               "a.gif": ["plot", run.path, "--film", "pressure", "-o"],
               "fit.nml": ["fit", tmp_path / "dma.csv", "-o"],
               "fit.csv": ["fit", tmp_path / "dma.csv", "--shifts"]}.get(name)

    def write():
        if command is None:
            return case.write(target) if name == "a.nml" else run.snapshots[-1].to_vtk(target)
        assert main([*map(str, command), str(target)]) == 0

    files = {path.name for path in tmp_path.iterdir()}
    for kept in (None, b""):
        if kept is not None:
            write()
            kept = target.read_bytes()
            assert len(kept) > 40
        errors = io.StringIO()
        with small_disk(), redirect_stderr(errors), redirect_stdout(io.StringIO()):
            if command is None:
                with pytest.raises(OSError, match=f"{name}: cannot be written: File too large"):
                    write()
            else:
                assert main([*map(str, command), str(target)]) == 3
                assert f"{name}: cannot be written: File too large\n" in errors.getvalue()
        assert {path.name for path in tmp_path.iterdir()} == files | ({name} if kept else set())
        assert not kept or target.read_bytes() == kept


def test_a_full_disk_is_reported_with_the_name_of_the_picture(tmp_path, monkeypatch, capsys):
    from matplotlib.figure import Figure

    def full(figure, path, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    frictional_result(tmp_path / "road.h5")
    monkeypatch.setattr(Figure, "savefig", full)
    assert main(["plot", str(tmp_path / "road.h5")]) == 3
    printed = f"asperity: {tmp_path / 'road.png'}: cannot be written: No space left on device\n"
    assert capsys.readouterr().err == printed


def test_a_height_map_is_drawn_with_a_profile(tmp_path, capsys):
    """`plot` refused height maps, which a user wants to see after an import."""
    height = asperity.surface.self_affine(32, 24, lx=4e-4, wavelength_short=1e-4, rms_slope=0.2)
    asperity.surface.save(tmp_path / "road.h5", height, 4e-4, 3e-4)
    assert main(["plot", str(tmp_path / "road.h5")]) == 0
    assert (tmp_path / "road.png").stat().st_size > 10_000
    figure = plot_road(tmp_path / "road.h5")
    heights, profile = figure.axes[:2]
    drawn = heights.images[0].get_array()
    assert np.allclose(drawn, height * 1e6)
    assert np.allclose(profile.lines[0].get_ydata(), height[12] * 1e6)
    assert "rms slope 0.2" in figure.get_suptitle()
    with pytest.raises(SystemExit):
        main(["plot", str(tmp_path / "road.h5"), "--field", "pressure"])
    assert "is a height map" in capsys.readouterr().err
