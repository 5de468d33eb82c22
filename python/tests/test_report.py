"""The page about a result: its contents and its behaviour in a browser."""

import base64
import json
import os
import re
import shutil
import subprocess
import time
from html.parser import HTMLParser
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from browser import BROWSER, DRIVER, Browser
from conftest import PATIENCE, frictional_result, write_result

import asperity
from asperity.__main__ import main
from asperity.report import PAGE, SCRIPTS, report_page
from asperity.report_data import MOST_ROWS, blocks, kept_rows, packed, states
from asperity.results import standing

VOID = {"area", "base", "br", "col", "hr", "img", "input", "link", "meta", "source", "wbr"}


class Page(HTMLParser):
    """Checks that elements are closed in order, and collects the parts that the tests examine."""

    def __init__(self, text):
        super().__init__()
        self.stack, self.ids, self.faults, self.tags, self.links = [], [], [], [], []
        self.inside, self.text = None, {}
        self.feed(text)
        self.close()
        self.faults += [f"{tag} is not closed" for tag in self.stack]

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if len(given) != len(attributes):
            self.faults.append(f"{tag}: an attribute twice")
        self.tags.append((tag, given))
        if "id" in given:
            self.ids.append(given["id"])
        for name in ("src", "href", "data", "action", "poster", "srcset"):
            if name in given:
                self.links.append(given[name])
        if tag not in VOID:
            self.stack.append(tag)
            self.inside = given.get("id") or tag
            self.text.setdefault(self.inside, "")

    def handle_endtag(self, tag):
        if not self.stack or self.stack.pop() != tag:
            self.faults.append(f"</{tag}> at {self.getpos()}")
        self.inside = None

    def handle_data(self, data):
        if self.inside is not None:
            self.text[self.inside] += data

    @property
    def data(self):
        """Return the data that the page contains."""
        return json.loads(self.text["data"])


def unpack(field, shape):
    """Return the numbers of a packed field."""
    whole = np.frombuffer(base64.b64decode(field["data"]), "<u2").astype(float)
    return (field["low"] + whole * (field["high"] - field["low"]) / 65535).reshape(shape)


@pytest.fixture(scope="module")
def sliding(program, tmp_path_factory):
    """Return the result of a short run of a block with friction."""
    folder = tmp_path_factory.mktemp("report")
    case = subprocess.run([program, "template", "friction"], capture_output=True, text=True,
                          check=True).stdout
    for old, new in (("nx = 64", "nx = 48"), ("ny = 37", "ny = 28"), ("steps = 100", "steps = 5"),
                     ("coefficient = 0.3", "coefficient = 1.0"),
                     ("duration = 1.5e-3", "duration = 0.5e-3"),
                     ("snapshot_every = 32", "snapshot_every = 8"),
                     ("Rubber block", "Rubber <block> & {{title}}")):
        assert old in case
        case = case.replace(old, new)
    (folder / "case.nml").write_text(case)
    subprocess.run([program, "run", "case.nml", "--quiet", "--output", "slide.h5"], cwd=folder,
                   check=True)
    return folder / "slide.h5"


def check_page(text):
    """Check what must hold for every page, and return it parsed."""
    page = Page(text)
    assert page.faults == []
    assert len(set(page.ids)) == len(page.ids)
    assert text.startswith("<!DOCTYPE html>")
    # Nothing is loaded: all links lead to places in the page.
    assert all(link.startswith("#") and link[1:] in page.ids for link in page.links)
    assert not re.search(r"(?i)\burl\((?!#)|@import|fetch\(|XMLHttpRequest|\bimport\s*\(", text)
    hosts = set(re.findall(r"https?://([\w.]+)", text))
    assert hosts <= {"www.w3.org"}  # identifiers of SVG
    policy = [given["content"] for tag, given in page.tags
              if given.get("http-equiv") == "Content-Security-Policy"]
    assert policy and policy[0].startswith("default-src 'none'")
    assert all(given.get("for") in (None, *page.ids) for tag, given in page.tags)
    return page


def test_page_holds_the_result(sliding):
    run = asperity.open(sliding)
    text = report_page(run)
    page = check_page(text)
    data = page.data
    # The title and the input appear unchanged: not cut, and not read as parts of the page.
    assert page.text["h1"] == "Rubber <block> & {{title}} on a wavy road"
    assert "title = 'Rubber <block> & {{title}} on a wavy road'" in page.text["pre"]
    for name in ("friction", "friction_viscous", "contact_area", "stick_area", "time",
                 "residual_normal", "iterations_tangential"):
        np.testing.assert_allclose(data["columns"][name], run.history[name], rtol=1e-9, atol=0)
    np.testing.assert_allclose(
        np.array(data["columns"]["friction_interface"]),
        run.history["friction"] - run.history["friction_viscous"], rtol=1e-9)
    drawn = {line["column"] for chart in data["charts"] for line in chart["series"]}
    assert drawn <= set(data["columns"])
    assert {len(values) for values in data["columns"].values()} == {run.history.rows}
    residuals = next(chart for chart in data["charts"] if chart["id"] == "residuals")
    assert residuals["levels"] == [{"value": 1e-6, "label": "tolerance"}]

    assert [each["step"] for each in data["snapshots"]] == list(run.snapshots.steps)
    grid = data["grid"]
    assert (grid["mx"], grid["my"], grid["block"]) == (48, 28, 1)
    for each, snapshot in zip(data["snapshots"], run.snapshots, strict=True):
        for name in ("pressure", "gap"):
            field = snapshot[name]
            error = np.abs(unpack(each["fields"][name], field.shape) - field).max()
            assert error <= np.ptp(field) / 65535 + 1e-300
        contact = np.frombuffer(base64.b64decode(each["contact"]), np.uint8)
        np.testing.assert_array_equal(contact.reshape(28, 48), snapshot.contact)
        x, y, along, across = map(np.array, each["arrows"])
        i, j = np.rint(x / run.grid.dx).astype(int), np.rint(y / run.grid.dy).astype(int)
        np.testing.assert_allclose(along, snapshot.traction_x[j, i], rtol=1e-9)
        np.testing.assert_allclose(across, snapshot.traction_y[j, i], rtol=1e-9)
        assert each["time"] == snapshot.time
    # The spectrum of the road has modes of one length and equal strength.
    spectrum = asperity.surface.psd(run.height, run.grid.lx, run.grid.ly)
    strongest = int(np.argmax(spectrum.psd))
    road = data["spectrum"]
    assert max(road["psd"]) == pytest.approx(spectrum.psd[strongest], rel=0.3)
    assert road["k"][int(np.argmax(road["psd"]))] == pytest.approx(
        spectrum.wavenumber[strongest], rel=0.1)
    assert data["modulus"]["storage"][-1] == pytest.approx(4e6, rel=1e-3)
    # The headings of the sections.
    for words in ("Friction and contact area", "Maps", "Case and material", "Convergence",
                  "Energies", "Spectra of road and rubber", "How it was made", "coulomb"):
        assert words in text
    assert "not finished" not in text


def test_scripts_are_whole_and_free_of_what_ends_them():
    for name in SCRIPTS:
        text = (PAGE / name).read_text()
        assert "</script" not in text.lower() and "{{" not in text
    assert set(re.findall(r"\{\{(\w+)\}\}", (PAGE / "report.html").read_text())) == {
        "version", "title", "subtitle", "style", "links", "notes", "tiles", "sections", "footer",
        "data", "script"}


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_scripts_are_javascript(tmp_path):
    whole = tmp_path / "whole.js"
    whole.write_text('"use strict";\n' + "\n".join((PAGE / name).read_text() for name in SCRIPTS))
    subprocess.run(["node", "--check", str(whole)], check=True)


def test_an_unfinished_run_says_so(tmp_path):
    path = frictional_result(tmp_path / "going.h5", finished=0)
    with h5py.File(path, "a") as file:
        file.attrs["expected_rows"] = np.int32(40)
        file.attrs["warnings"] = "&grid: nx = 24: coarse"
    text = report_page(asperity.open(path))
    page = check_page(text)
    rows = asperity.open(path).history.rows
    assert f"{rows} of 40 rows" in text
    assert "<li>&amp;grid: nx = 24: coarse</li>" in text
    assert len(page.data["columns"]["friction"]) == rows


def test_a_killed_run_and_one_without_rows(tmp_path):
    path = frictional_result(tmp_path / "killed.h5", finished=0)
    with h5py.File(path, "a") as file:
        # The columns have different lengths; the page shows the rows that all of them have.
        for number, column in enumerate(file["history"].values()):
            column.resize((4 + number % 2,))
    assert len(check_page(report_page(asperity.open(path))).data["columns"]["time"]) == 4
    with h5py.File(path, "a") as file:
        for column in file["history"].values():
            column.resize((0,))
        del file["snapshots"]
    text = report_page(asperity.open(path))
    assert check_page(text).data["charts"] == []
    assert "The history has no rows yet" in text
    assert "holds no snapshots" in text


def test_the_page_says_whether_a_run_seems_dead(tmp_path, monkeypatch):
    path = frictional_result(tmp_path / "killed.h5", finished=0)
    text = report_page(asperity.open(path))
    assert "Write the page again to update it. If the run was killed" in text
    # The clock stands still: a busy machine may take seconds for a page.
    monkeypatch.setattr(standing, "time", SimpleNamespace(time=lambda: 2e9))
    os.utime(path, (2e9 - 60.0,) * 2)
    text = report_page(asperity.open(path))
    check_page(text)
    assert ("The file was last written 1 min 0 s before, and a row takes up to 0.25 s: the run"
            " was perhaps killed." in text)
    with h5py.File(path, "a") as file:
        file.attrs["outcome"] = "stopped after step 5"
    text = report_page(asperity.open(path))
    assert "Outcome: stopped after step 5;" in text and "perhaps killed" not in text


def test_values_that_are_not_finite_are_reported(tmp_path):
    """The page names damaged values and is complete without them."""
    path = frictional_result(tmp_path / "holes.h5")
    with h5py.File(path, "a") as file:
        for name in ("friction", "seconds", "residual_normal"):
            file["history"][name][-1] = np.nan
        file["snapshots/000005/pressure"][3, 4] = np.nan
        file["snapshots/000005/gap"][:] = np.inf
    text = report_page(asperity.open(path))
    fields = check_page(text).data["snapshots"][-1]["fields"]
    assert "friction is not finite in 1 of 6 rows" in text
    assert "pressure of the last snapshot is not finite in 1 cell<" in text
    assert "gap of the last snapshot is not finite in 384 cells" in text
    exact = asperity.open(path).snapshots[-1].pressure
    assert fields["pressure"]["exact"] == [np.nanmin(exact), np.nanmax(exact)]
    assert fields["gap"]["high"] == 0.0


def test_residuals_above_the_tolerance_are_reported(frictional):
    with h5py.File(frictional, "a") as file:
        file.attrs["settings"] = "&solver\n  tolerance = 2.5e-7\n/\n"
    text = report_page(asperity.open(frictional))
    assert ("the normal residual of 6 of 6 rows is above the tolerance of 2.5e-07; the largest is"
            " 3e-07" in text)
    assert "tangential residual of" not in text


def test_line_contact_has_profiles(tmp_path):
    path = frictional_result(tmp_path / "line.h5", ny=1)
    run = asperity.open(path)
    text = report_page(run)
    data = check_page(text).data
    assert "<h2>Profiles</h2>" in text
    field = data["snapshots"][-1]["fields"]["traction_x"]
    np.testing.assert_allclose(unpack(field, (1, 24)), run.snapshots[-1].traction_x,
                               atol=(field["high"] - field["low"]) / 65535)
    assert data["spectrum_units"] == "m³"


def test_large_grids_are_downsampled_and_it_says_so(tmp_path):
    path = write_result(tmp_path / "large.h5", nx=600, ny=301)
    run = asperity.open(path)
    text = report_page(run)
    data = check_page(text).data
    grid = data["grid"]
    assert (grid["block"], grid["mx"], grid["my"]) == (3, 200, 101)
    assert "means over blocks of 3 × 3 cells" in text and "200 × 101 of 600 × 301 cells" in text
    field = data["snapshots"][-1]["fields"]["pressure"]
    shown = unpack(field, (101, 200))
    exact = run.snapshots[-1].pressure
    assert shown[50, 10] == pytest.approx(exact[150:153, 30:33].mean(), abs=field["high"] / 6e4)
    assert shown[100, 10] == pytest.approx(exact[300:, 30:33].mean(), abs=field["high"] / 6e4)
    assert len(text) < 2e6


def test_blocks_and_states():
    field = np.arange(15.0).reshape(3, 5)
    np.testing.assert_allclose(blocks(field, 2), [[3, 5, 6.5], [10.5, 12.5, 14]])
    contact = np.array([[0, 0, 1, 1, 2], [0, 2, 2, 2, 2]], dtype=np.int8)
    np.testing.assert_array_equal(states(contact, 2), [[0, 2, 2]])  # the higher of equals
    flat = packed(np.full((2, 2), 3.0))
    np.testing.assert_array_equal(unpack(flat, (2, 2)), 3.0)


def test_many_rows_keep_their_peaks(tmp_path):
    rows = 3 * MOST_ROWS
    path = write_result(tmp_path / "long.h5", rows=rows, moving=True)
    with h5py.File(path, "a") as file:
        file["history/friction"][4321] = 7.0
    run = asperity.open(path)
    kept = kept_rows(run)
    assert len(kept) <= MOST_ROWS + 2
    assert {0, 4321, rows - 1} <= set(kept)
    text = report_page(run)
    data = check_page(text).data
    assert max(data["columns"]["friction"]) == 7.0
    assert f"{len(kept)} of {rows} rows are drawn" in text


def test_command(result, tmp_path, capsys):
    assert main(["report", str(result), "-o", str(tmp_path / "page.html")]) == 0
    assert "page.html" in capsys.readouterr().out
    check_page((tmp_path / "page.html").read_text())
    assert asperity.open(result).report() == result.with_suffix(".html")
    assert main(["report", str(tmp_path / "none.h5")]) == 3
    assert main(["report", str(result), "-o", str(result)]) == 2
    assert "would overwrite a result" in capsys.readouterr().err
    case = tmp_path / "case.nml"
    case.write_text("&grid /")
    assert main(["report", str(result), "-o", str(case)]) == 2
    assert "case.nml: the name of a page must end in .html" in capsys.readouterr().err
    assert case.read_text() == "&grid /"
    assert asperity.open(result).finished
    other = tmp_path / "other.html"
    other.write_text("<!DOCTYPE html><title>asperity</title><p>my thesis")
    assert main(["report", str(result), "-o", str(other)]) == 2
    assert "other.html: exists and is not a page of Asperity" in capsys.readouterr().err
    assert other.read_text().endswith("my thesis")
    assert main(["report", str(result), "-o", str(tmp_path / "page.html")]) == 0  # once more


needs_browser = pytest.mark.skipif(DRIVER is None or BROWSER is None,
                                   reason="chromium and chromedriver are not installed")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Return a headless browser."""
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


def wait_for(browser, script, *arguments):
    """Wait until the script returns something true, and return it."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        found = browser.run(script, *arguments)
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError(f"never true: {script}")


READY = "return document.documentElement.dataset.ready === 'yes'"
# Elements that reach beyond the right edge of the page, or out of their own box.
CUT = """
return [...document.querySelectorAll('main *, header *')].filter((e) => {
  if (e.closest('pre, .wide, nav')) return false;
  const box = e.getBoundingClientRect();
  return box.width > 0 && (box.right > innerWidth + 1 || box.left < -1);
}).map((e) => e.tagName + '.' + e.getAttribute('class'))"""
# Texts of a chart or map that overlap.
OVERLAPS = """
const found = [];
for (const root of document.querySelectorAll('figure svg')) {
  const texts = [...root.querySelectorAll(':scope > text')];
  const boxes = texts.map((t) => [t, t.getBoundingClientRect()]);
  boxes.forEach(([a, p], i) => boxes.slice(i + 1).forEach(([b, q]) => {
    const x = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const y = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (x > 1 && y > 3) found.push(`${a.textContent} / ${b.textContent}`);
  }));
}
return found;"""


@needs_browser
@pytest.mark.parametrize("kind", ["sliding", "line", "elastic", "empty"])
def test_page_in_a_browser_fits_every_width(browser, tmp_path, kind, sliding):
    path = {"sliding": lambda: sliding,
            "line": lambda: frictional_result(tmp_path / "line.h5", ny=1),
            "elastic": lambda: write_result(tmp_path / "elastic.h5"),
            "empty": lambda: write_result(tmp_path / "empty.h5", finished=0)}[kind]()
    if kind == "empty":
        with h5py.File(path, "a") as file:
            del file["snapshots"]
    page = asperity.open(path).report(tmp_path / "page.html")
    for width, dark, touch in ((1280, False, False), (390, True, True)):
        browser.window(width, 900, dark, touch)
        browser.open(page)
        wait_for(browser, READY)
        time.sleep(0.1)
        assert browser.console() == []
        assert browser.run("return document.documentElement.scrollWidth") <= width
        assert browser.run(CUT) == []
        assert browser.run(OVERLAPS) == []
        paper = browser.run("return getComputedStyle(document.body).backgroundColor")
        assert (paper == "rgb(255, 255, 255)") == (not dark)
        lines = browser.run("return document.querySelectorAll('figure.chart path.line').length")
        assert lines >= (4 if kind in ("sliding", "line") else 2)


@needs_browser
def test_the_links_of_the_page_lie_beside_the_button(browser, tmp_path, sliding):
    page = asperity.open(sliding).report(tmp_path / "page.html")
    for width in (390, 700, 1280):
        browser.window(width, 900)
        browser.open(page)
        wait_for(browser, READY)
        # Links that do not fit are scrolled, and are not covered.
        left, right = browser.run(
            "return [document.getElementById('theme').getBoundingClientRect().left,"
            " document.querySelector('.links').getBoundingClientRect().right]")
        assert right <= left
        (seen,) = browser.run(
            "const link = document.querySelectorAll('nav a'), last = link[link.length - 1];"
            "last.scrollIntoView({inline: 'end', block: 'nearest'});"
            "const box = last.getBoundingClientRect();"
            "const y = (box.top + box.bottom) / 2;"
            "return [document.elementFromPoint(box.right - 3, y) === last]")
        assert seen


def test_round_off_is_not_shown_as_a_gap(tmp_path):
    case = asperity.Case(grid={"nx": 64, "ny": 1, "lx": 1e-3}, material={"shear_modulus": 1e6},
                         surface={"shape": "sine", "amplitude": 1e-6, "wavelength": 1e-3},
                         phase=[{"pressure": 1e3}, {"pressure": 1e6}])
    run = asperity.run(case, output=tmp_path / "full.h5", quiet=True)
    assert run.history["contact_area"][-1] == 1.0
    run.history["mean_gap"][-1] = -6.7e-16  # the approach is 1 um
    assert "<dt>Mean gap</dt><dd>0 m</dd>" in report_page(run)
    run.history["mean_gap"][-1] = 6.7e-14
    assert "<dt>Mean gap</dt><dd>67 fm</dd>" in report_page(run)


@needs_browser
def test_values_and_pictures_are_saved(browser, tmp_path, sliding):
    run = asperity.open(sliding)
    page = run.report(tmp_path / "page.html")
    browser.window(1280, 900)
    browser.open(page)
    wait_for(browser, READY)
    texts, pictures = browser.saved()
    assert browser.console() == []
    assert len(pictures) == len(texts) - 1 >= 10  # the history has values only
    assert all(data.startswith(b"\x89PNG") and len(data) > 3000 for data in pictures)
    assert len(set(pictures)) == len(pictures)

    def table(head):
        (text,) = [text for text in texts if text.startswith(head)]
        return np.genfromtxt(text.splitlines(), delimiter=",", names=True, deletechars="")

    history = table("step,phase,time")
    np.testing.assert_allclose(history["friction"], run.history["friction"], rtol=1e-9)
    chart = table("Time (s),whole")
    np.testing.assert_allclose(chart["whole"], run.history["friction"], rtol=1e-9)
    snapshot = run.snapshots[-1]
    for head, name, error in (("x (m),y (m),Pressure", "pressure", 1e-4),
                              ("x (m),y (m),Height of the road", "road_height", 1e-4)):
        values = table(head)
        field = snapshot[name]
        np.testing.assert_allclose(values["x_(m)"].reshape(field.shape)[3], run.grid.x, rtol=1e-9)
        np.testing.assert_allclose(values["y_(m)"].reshape(field.shape)[:, 3], run.grid.y,
                                   rtol=1e-9)
        seen = values[values.dtype.names[2]].reshape(field.shape)
        np.testing.assert_allclose(seen, field, atol=error * np.ptp(field))


@needs_browser
def test_zoom_slider_and_switch_work(browser, tmp_path, sliding):
    run = asperity.open(sliding)
    page = run.report(tmp_path / "page.html")
    browser.window(1280, 900)
    browser.open(page)
    wait_for(browser, READY)
    ticks = ("return [...document.querySelectorAll('#charts-time figure')].map((f) =>"
             " [...f.querySelectorAll('svg[role=img] > text')].map((t) => t.textContent).join())")
    before = browser.run(ticks)
    place = "return (({x, y, width, height}) => [x, y, width, height])(document.querySelector({})"\
            ".getBoundingClientRect())"
    browser.run("document.querySelector('#charts-time figure').scrollIntoView({block: 'center'})")
    x, y, width, height = browser.run(
        place.replace("{})", "'#charts-time figure svg[role=img]')"))
    browser.drag((x + 0.5 * width, y + 0.5 * height), (x + 0.75 * width, y + 0.5 * height))
    zoomed = wait_for(browser, f"const t = (() => {{ {ticks} }})();"
                               " return t[0] !== arguments[0] && t", before[0])
    # All charts zoom together, and a double click shows everything again.
    assert all(one != two for one, two in zip(before, zoomed, strict=True))
    browser.run("document.querySelector('#charts-time svg[role=img]').dispatchEvent("
                "new MouseEvent('dblclick', {bubbles: true}))")
    assert browser.run(ticks) == before
    # The same by keyboard: zoom in, show everything, read the last value.
    browser.run("document.querySelector('#charts-time svg[role=img]').focus()")
    browser.press("+")
    assert browser.run(ticks)[0] != before[0]
    browser.press("0")
    assert browser.run(ticks) == before
    browser.press("\ue010")  # End
    readout = browser.run("return document.querySelector('#charts-time .readout').textContent")
    assert f"whole {run.history['friction'][-1]:.4g}" in readout
    assert "Time 1.5 ms" in readout
    # The value next to the mouse is that of the nearest row.
    browser.drag((x + 0.4 * width, y + 20), (x + 0.4 * width + 2, y + 20))
    readout = browser.run("return document.querySelector('#charts-time .readout').textContent")
    shown = float(re.search(r"whole ([\d.e−]+)", readout)[1].replace("−", "-"))
    assert np.abs(run.history["friction"] - shown).min() < 1e-3 * max(shown, 1e-3)

    # The slider by keyboard shows other maps with other captions.
    maps = ("return [...document.querySelectorAll('canvas')].map((c) => {"
            " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            " let s = 0; for (let i = 0; i < d.length; i++) s = (31 * s + d[i]) % 1000003;"
            " return s; })")
    last = browser.run(maps)
    assert len(last) == 4  # the road, and the three maps of the slider
    caption = "return document.getElementById('step-shown').textContent"
    assert browser.run(caption).startswith(f"step {run.snapshots.steps[-1]},")
    browser.run("document.getElementById('step').focus()")
    browser.press("\ue011")  # Home
    assert browser.run(caption).startswith(f"step {run.snapshots.steps[0]},")
    assert browser.run(maps)[0] != last[0]
    browser.press("\ue014")  # right
    assert browser.run(caption).startswith(f"step {run.snapshots.steps[1]},")
    # Zero is written as such, although the peaks of the road miss the cells.
    numbers = browser.run("return [...document.querySelectorAll('.map .numbers')].map("
                          "(n) => n.children[1].textContent)")
    assert "0" in numbers and not [text for text in numbers if "e" in text]
    # The map's values by keyboard: the cell to the right of the centre.
    browser.run("document.querySelector('canvas').focus()")
    browser.press("\ue014")
    word = browser.run("return document.querySelector('.map .readout').textContent")
    pressure = run.snapshots[1].pressure
    shown = float(re.search(r": ([\d.]+) kPa", word)[1])
    assert shown == pytest.approx(pressure[14, 25] / 1e3, rel=2e-3)

    # The switch selects light or dark, whatever the system's setting is.
    papers = []
    for _ in range(3):
        browser.run("document.getElementById('theme').click()")
        papers.append(browser.run("return getComputedStyle(document.body).backgroundColor"))
    assert papers == ["rgb(255, 255, 255)", "rgb(20, 24, 28)", "rgb(255, 255, 255)"]
    # The test reads the canvases; the page itself does not.
    assert [text for text in browser.console() if "getImageData" not in text] == []


@needs_browser
def test_each_sign_of_the_pressure_has_half_of_the_colours(browser, tmp_path, result):
    """Tensions and pressures of different size are both seen, and white stays zero."""
    with h5py.File(result, "a") as file:
        for group in file["snapshots"].values():
            pressure = group["pressure"][()]
            group["pressure"][...] = np.where(pressure > 0.0, pressure, -0.15 * pressure.max())
    browser.window(900, 800)
    browser.open(asperity.open(result).report(tmp_path / "page.html"))
    wait_for(browser, READY)
    numbers, weakest = browser.run(
        "const map = document.querySelector('.map'), canvas = map.querySelector('canvas');"
        " const cells = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);"
        " let blue = 255; for (let i = 0; i < cells.data.length; i += 4)"
        "   if (cells.data[i] < cells.data[i + 2]) blue = Math.min(blue, cells.data[i]);"
        " return [[...map.querySelectorAll('.numbers span')].map((s) => s.textContent), blue]")
    assert numbers == ["−30", "0", "200 kPa"]
    assert weakest == 5  # the tension has the darkest blue of the scale


@needs_browser
def test_pinch_zooms_on_a_phone(browser, tmp_path, sliding):
    page = asperity.open(sliding).report(tmp_path / "page.html")
    browser.window(390, 800, touch=True)
    browser.open(page)
    wait_for(browser, READY)
    browser.run("document.querySelector('#charts-time figure').scrollIntoView({block: 'center'})")
    x, y, width, height = browser.run(
        "return (({x, y, width, height}) => [x, y, width, height])(document.querySelector("
        "'#charts-time svg[role=img]').getBoundingClientRect())")
    ticks = ("return [...document.querySelectorAll('#charts-time figure:first-child svg[role=img]"
             " > text')].map((t) => t.textContent).join()")
    before = browser.run(ticks)
    middle, row = x + 0.6 * width, round(y + height / 2)

    def finger(name, side):
        return {"type": "pointer", "id": name, "parameters": {"pointerType": "touch"}, "actions": [
            {"type": "pointerMove", "duration": 0, "x": round(middle + side * 15), "y": row},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "duration": 80, "x": round(middle + side * 75), "y": row},
            {"type": "pointerUp", "button": 0}]}

    browser.actions(finger("one", -1), finger("two", 1))
    assert browser.run(ticks) != before
    assert browser.console() == []
