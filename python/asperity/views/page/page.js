// Puts charts and maps into the page, from the data that it carries.

const data = JSON.parse(document.getElementById("data").textContent);

/** The charts of the history, with the choice of what they are drawn against. */
function historyCharts() {
  const group = [];
  let axis = data.axes[0];
  const series = (chart) => chart.series.map((line) => ({...line, x: data.columns[axis.name],
    y: data.columns[line.column]}));
  const made = data.charts.map((chart) => [chart, new Chart(
    document.getElementById(`charts-${chart.section}`),
    {...chart, series: series(chart), xLabel: axis.label, xUnit: axis.unit, logX: axis.log}, group)]);
  const choice = document.getElementById("axis");
  if (data.axes.length > 1) {
    for (const each of data.axes) choice.append(html("option", {value: each.name}, each.label));
    choice.addEventListener("change", () => {
      axis = data.axes.find((each) => each.name === choice.value);
      for (const [chart, drawn] of made) {
        drawn.range = null;
        drawn.cursor = null;
        drawn.update(series(chart), {xLabel: axis.label, xUnit: axis.unit, logX: axis.log});
      }
      marks();
    });
    choice.parentElement.hidden = false;
  }
  const place = document.getElementById("columns-csv");
  if (place) {
    place.append(...saveButtons("all columns", [["csv", () => saveCsv("history",
      Object.entries(data.columns).map(([name, values]) => ({name, values})))]]));
  }
  let snapshot = null;
  const marks = () => {
    if (!snapshot) return;
    for (const [, drawn] of made) {
      drawn.mark = axis.name in snapshot ? snapshot[axis.name] : null;
      drawn.draw();
    }
  };
  return (chosen) => { snapshot = chosen; marks(); };
}

/** The largest of a number of all snapshots' fields of a name. */
function overAll(name, number) {
  return Math.max(...data.snapshots.filter((each) => name in each.fields)
    .map((each) => number(each.fields[name])));
}

/** A field of a snapshot; a road that rests is kept with the first one only. */
function fieldOf(snapshot, name) {
  return snapshot.fields[name]
    || (name === "road_height" ? data.snapshots[0].fields[name] : undefined);
}

/** Maps of an area contact. Returns what draws a snapshot. */
function areaMaps(parent, same) {
  const maps = {};
  const names = [...new Set(data.snapshots.flatMap((each) => Object.keys(each.fields)))];
  // Heights have no natural zero: their scale goes from the lowest to the highest.
  const heights = "road_height";
  for (const name of names) {
    const field = data.snapshots.find((each) => name in each.fields).fields[name];
    maps[name] = new FieldMap(parent, field.label, data.grid);
  }
  const title = data.friction ? "Stick and slip" : "Contact";
  if (data.snapshots.some((each) => each.contact)) maps.contact = new FieldMap(parent, title, data.grid);
  return (snapshot) => {
    for (const name of names) {
      const field = fieldOf(snapshot, name);
      maps[name].figure.hidden = !field;
      if (!field) continue;
      const values = unpack(field);
      const [first, last] = name === heights ? ["low", "high"] : ["bottom", "top"];
      let top = same() ? overAll(name, (each) => each[last]) : field[last];
      let low = same() ? -overAll(name, (each) => -each[first]) : field[first];
      const attracted = name === "pressure" && low < 0;
      if (attracted) {  // each sign has half of the colours, as in `colour_scales.py`
        const largest = Math.max(top, -low);
        const end = (size) => size >= largest / 2 ? largest : Math.max(size, largest / 10);
        [low, top] = [-end(-low), end(top)];
      }
      const middle = attracted ? 0 : (low + top) / 2;
      const part = (value) => value < middle ? 0.5 * (value - low) / (middle - low || 1)
        : 0.5 + 0.5 * (value - middle) / (top - middle || 1);
      const table = data.colours[name === "pressure" ? (attracted ? "both" : "pressure") : "gap"];
      const colours = [...Array(256).keys()].map((i) => colourAt(table, i / 255));
      const masked = name === "pressure" && !attracted;
      maps[name].show(
        (i) => masked && values[i] <= 0 ? OPEN
          : colours[Math.min(Math.max(Math.round(part(values[i]) * 255), 0), 255)],
        (i) => shown(values[i], field.units),
        colourBar(table, [low, middle, top], field.units, masked),
        null, values, field.units);
    }
    if (!maps.contact) return;
    maps.contact.figure.hidden = !snapshot.contact;
    if (!snapshot.contact) return;
    const states = unpackStates(snapshot.contact);
    const words = data.friction ? ["open", "stick", "slip"] : ["open", "contact", "contact"];
    const colours = data.friction ? [OPEN, STICK, SLIP] : [OPEN, STICK, STICK];
    const shares = data.friction ? snapshot.shares
      : [snapshot.shares[0], snapshot.shares[1] + snapshot.shares[2]];
    const key = html("div", {class: "key"});
    shares.forEach((share, i) => key.append(swatch(colours[i]),
      `${words[i]} ${digits(100 * share, 3)} %`));
    const bar = [key];
    if (snapshot.arrows) {
      const sizes = snapshot.arrows[2].map((along, i) => Math.hypot(along, snapshot.arrows[3][i]));
      const longest = Math.max(0, ...sizes);
      if (longest > 0) bar.push(html("div", {class: "key"},
        `Arrows: traction on the rubber, the longest ${shown(longest, "Pa")}.`));
    }
    maps.contact.show((i) => colours[states[i]], (i) => words[states[i]], bar,
      snapshot.arrows || null, states, "0 open, 1 stick, 2 slip");
  };
}

/** Profiles of a line contact. Returns what draws a snapshot. */
function lineProfiles(parent) {
  const {nx, lx, mx, block} = data.grid;
  const x = [...Array(mx).keys()].map((i) => (Math.min((i + 1) * block, nx) + i * block - 1) / 2 * lx / nx);
  const group = [];
  const make = (title, label, unit) => new Chart(parent, {title, label, unit, series: [],
    xLabel: "x", xUnit: "m"}, group);
  const has = (name) => data.snapshots.some((each) => name in each.fields);
  const pressure = has("pressure") ? make("Pressure and traction", "Traction", "Pa") : null;
  const gap = has("gap") ? make("Gap", "Gap", "m") : null;
  const road = has("road_height") ? make("Road and rubber", "Height", "m") : null;
  const key = html("div", {class: "key"});
  parent.append(key);
  return (snapshot) => {
    const line = (name, colour, dash) => fieldOf(snapshot, name) ? [{
      label: fieldOf(snapshot, name).label.toLowerCase(), colour, dash, x,
      y: [...unpack(fieldOf(snapshot, name))]}] : [];
    const bands = [];
    if (snapshot.contact) {
      const states = unpackStates(snapshot.contact);
      const half = lx / nx * block / 2;
      for (let i = 0; i < mx; i++) {
        const state = data.friction || !states[i] ? states[i] : 1;
        const last = bands[bands.length - 1];
        if (last && last.state === state) last.to = x[i] + half;
        else bands.push({from: x[i] - half, to: x[i] + half, state});
      }
      const words = data.friction ? ["open", "stick", "slip"] : ["open", "contact"];
      const shares = data.friction ? snapshot.shares
        : [snapshot.shares[0], snapshot.shares[1] + snapshot.shares[2]];
      key.replaceChildren();
      words.forEach((word, i) => key.append(swatch([OPEN, STICK, SLIP][i]),
        `${word} ${digits(100 * shares[i], 3)} %`));
    }
    if (pressure) pressure.update([...line("pressure", 6, ""), ...line("traction_x", 1, "6 3"),
      ...line("traction_y", 3, "2 3")], {bands});
    if (gap) gap.update(line("gap", 0, ""), {bands});
    if (road) {
      const lines = line("road_height", 6, "");
      // The rubber's surface lies above the road by the gap.
      if (lines.length && "gap" in snapshot.fields) {
        const open = unpack(snapshot.fields.gap);
        lines[0].label = "road";
        lines.push({label: "rubber", colour: 1, dash: "6 3", x, y: lines[0].y.map((y, i) => y + open[i])});
      }
      road.update(lines, {bands});
    }
  };
}

/** Spectra of the road and of the rubber. Returns what draws a snapshot. */
function spectra() {
  const parent = document.getElementById("charts-spectrum");
  const line = (label, found, colour, dash) => found ? [{label, colour, dash, x: found.k,
    y: found.psd}] : [];
  const lines = (snapshot) => [...line("road", data.spectrum, 6, ""),
    ...line("rubber", snapshot && snapshot.spectrum, 1, "6 3")];
  const first = data.snapshots.find((each) => each.spectrum) || null;
  if (!lines(first).length) return () => {};
  const chart = new Chart(parent, {title: "Power spectral density", label: "Density",
    unit: data.spectrum_units, log: true, logX: true, series: lines(first), levels: [],
    xLabel: "Wave number", xUnit: "rad/m"});
  return (snapshot) => chart.update(lines(snapshot));
}

/** Storage and loss modulus of the rubber. */
function modulus() {
  if (!data.modulus) return;
  const {omega, storage, loss} = data.modulus;
  new Chart(document.getElementById("charts-material"), {title: "Shear modulus of the rubber",
    label: "Modulus", unit: "Pa", log: true, logX: true, levels: [], xLabel: "Angular frequency",
    xUnit: "rad/s", series: [{label: "storage", colour: 0, dash: "", x: omega, y: storage},
      {label: "loss", colour: 1, dash: "6 3", x: omega, y: loss}]});
}

/** The slider over the snapshots. */
function snapshots(show) {
  const slider = document.getElementById("step");
  if (!slider) return;
  const label = document.getElementById("step-shown");
  slider.max = data.snapshots.length - 1;
  slider.value = slider.max;
  const set = () => {
    const snapshot = data.snapshots[Number(slider.value)];
    const words = [`step ${snapshot.step}`];
    // Rows of static or steady states have no time.
    if (snapshot.time) words.push(`t = ${shown(snapshot.time, "s")}`);
    else if (snapshot.speed) words.push(`sliding speed ${shown(snapshot.speed, "m/s")}`);
    if (snapshot.pressure !== undefined && snapshot.pressure !== null) {
      words.push(`pressure ${shown(snapshot.pressure, "Pa")}`);
    }
    if (snapshot.friction) words.push(`friction ${digits(snapshot.friction)}`);
    label.textContent = words.join(", ");
    slider.setAttribute("aria-valuetext", label.textContent);
    for (const act of show) act(snapshot);
  };
  slider.addEventListener("input", set);
  for (const [name, by] of [["step-back", -1], ["step-on", 1]]) {
    document.getElementById(name).addEventListener("click", () => {
      slider.value = Number(slider.value) + by;
      set();
    });
  }
  document.getElementById("same")?.addEventListener("change", set);
  set();
}

themeSwitch();
const show = [];
if (data.charts.length) show.push(historyCharts());
const place = document.getElementById("maps-place");
if (place) {
  const same = () => document.getElementById("same")?.checked ?? false;
  show.push(data.grid.ny === 1 ? lineProfiles(place) : areaMaps(place, same));
}
show.push(spectra());
modulus();
snapshots(show);
document.documentElement.dataset.ready = "yes";
