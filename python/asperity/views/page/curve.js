// The page of friction curves: what they are drawn against, which they are, and one chosen point.

const data = JSON.parse(document.getElementById("data").textContent);
const AXES = ["pressure", "temperature", "speed"];
const LABELS = {pressure: ["Pressure", "Pa"], temperature: ["Temperature", "°C"],
  speed: ["Speed", "m/s"], reduced: ["Reduced speed a_T v", "m/s"]};

/** The value of a variable at a point {pressure, temperature, speed} of indices. */
function valueAt(name, at) {
  return data.values[name][at.pressure][at.temperature][at.speed];
}

/** The numbers of the warnings about a point, as "[1] [3]"; empty if there are none. */
function marksAt(at) {
  return data.marks[`${at.pressure},${at.temperature},${at.speed}`] || "";
}

/** The words for a point without one of its axes. */
function words(at, without) {
  return AXES.filter((name) => name !== without && data.axes[name].length > 1)
    .map((name) => `${shown(data.axes[name][at[name]], LABELS[name][1])}`).join(", ");
}

/** What the curves are drawn against: 'reduced' is a master curve over a_T v. */
let against = "speed";
/** The indices of the chosen point. */
let chosen = {pressure: 0, temperature: 0, speed: Math.floor(data.axes.speed.length / 2)};
/** Whether each axis that is not drawn against shows all its values or the chosen one only. */
const all = {pressure: true, temperature: true, speed: false};

/** The axis along x: that of 'reduced' is the speed. */
function axisX() { return against === "reduced" ? "speed" : against; }

/** The points of each curve, as lists of points. */
function curves() {
  const along = axisX();
  const others = AXES.filter((name) => name !== along);
  const values = others.map((name) => all[name] ? data.axes[name].map((_, i) => i) : [chosen[name]]);
  const found = [];
  for (const a of values[0]) {
    for (const b of values[1]) {
      found.push(data.axes[along].map((_, i) => ({[others[0]]: a, [others[1]]: b, [along]: i})));
    }
  }
  return found;
}

/** The x of a point. */
function xOf(at) {
  if (against !== "reduced") return data.axes[against][at[against]];
  return data.a_t[at.temperature] * data.axes.speed[at.speed];
}

/** The colours of the style sheet for any number of curves; it has others for each larger number. */
const PALETTE = 7;

/** A line of a chart for each curve. */
function lines(name, more = {}) {
  const many = curves();
  return many.map((points, number) => ({
    label: [more.label, words(points[0], axisX())].filter(Boolean).join(" ") || data.names[name],
    colour: many.length > PALETTE ? `${many.length}-${number}` : number, dash: more.dash || "", x: points.map(xOf),
    y: points.map((at) => valueAt(name, at)),
    low: more.band ? points.map((at) => valueAt(`${name}_low`, at)) : null,
    high: more.band ? points.map((at) => valueAt(`${name}_high`, at)) : null,
    flags: more.band ? points.map(marksAt) : null}));
}

/** The choices above the charts. */
function choices(changed) {
  const place = document.getElementById("choices");
  const choice = (label, id, entries, act) => {
    const frame = html("label", {}, `${label} `);
    const select = html("select", {id});
    for (const [value, text] of entries) select.append(html("option", {value}, text));
    select.addEventListener("change", () => { act(select.value); changed(); });
    frame.append(select);
    place.append(frame);
    return select;
  };
  const axes = AXES.filter((name) => data.axes[name].length > 1 && !data.axes[name].includes(null));
  const entries = axes.map((name) => [name, LABELS[name][0].toLowerCase()]);
  if (data.axes.temperature.length > 1) entries.push(["reduced", "a_T v (master curve)"]);
  if (!axes.includes(against) && axes.length) against = axes[0];
  if (entries.length) {
    choice("Draw against", "against", entries, (value) => { against = value; }).value = against;
  }
  for (const name of AXES) {
    if (data.axes[name].length < 2) continue;
    const values = data.axes[name].map((value, i) => [String(i), shown(value, LABELS[name][1])]);
    choice(LABELS[name][0], `choose-${name}`, [["all", "all"], ...values], (value) => {
      all[name] = value === "all";
      if (value !== "all") chosen = {...chosen, [name]: Number(value)};
    }).value = all[name] ? "all" : String(chosen[name]);
  }
}

/** The chosen point in words. */
function told(at) {
  return AXES.filter((name) => data.axes[name][at[name]] !== null)
    .map((name) => `${LABELS[name][0].toLowerCase()} ${shown(data.axes[name][at[name]], LABELS[name][1])}`)
    .join(", ");
}

/** The bars of the losses of the chosen point: shares by octave and by arm. */
function lossCharts() {
  const parent = document.getElementById("losses");
  if (!parent) return () => {};
  const made = {};
  return () => {
    for (const [name, x, title, label, unit] of [
      ["loss_octave", data.octave, "Loss by octave of the wavelength", "Longest wave", "m"],
      ["loss_arm", data.relaxation, "Loss by arm of the Prony series", "Relaxation time", "s"]]) {
      if (!data.losses[name]) continue;
      const values = data.losses[name][chosen.pressure][chosen.temperature][chosen.speed];
      const series = [{label: title, colour: name === "loss_arm" ? 1 : 0, dash: "", x, y: values}];
      if (made[name]) { made[name].update(series); continue; }
      made[name] = new Chart(parent, {title, label: "Loss", unit: "W/m²", logX: true, zero: true,
        xLabel: label, xUnit: unit, series});
    }
  };
}

/** The map of the chosen point, if the page holds it. */
function pointMap() {
  const parent = document.getElementById("map");
  if (!parent) return () => {};
  const map = new FieldMap(parent, "Pressure on the first patch", data.grid);
  return () => {
    const field = data.maps[`${chosen.pressure},${chosen.temperature},${chosen.speed}`];
    map.figure.hidden = !field;
    if (!field) return;
    const values = unpack(field);
    const top = field.top || 1;
    map.show((i) => values[i] > 0 ? colourAt(data.colours.pressure, values[i] / top) : OPEN,
      (i) => values[i] > 0 ? shown(values[i], "Pa") : "no contact",
      colourBar(data.colours.pressure, [0, top / 2, top], "Pa", true), null, values, "Pa");
  };
}

themeSwitch();
const losses = lossCharts();
const map = pointMap();
const parent = document.getElementById("curves");
const made = [];
const label = document.getElementById("point");
const remarks = document.getElementById("point-warnings");

function choose(x, number) {
  const many = curves();
  const points = many[number % many.length];
  const nearest = points.reduce((best, at) =>
    Math.abs(xOf(at) - x) < Math.abs(xOf(best) - x) ? at : best);
  chosen = {...nearest};
  for (const name of AXES) {
    const select = document.getElementById(`choose-${name}`);
    if (select && !all[name]) select.value = String(chosen[name]);
  }
  show();
}

const CHARTS = [
  {name: "friction", title: "Friction", label: "Friction coefficient", unit: "1", band: true,
    theory: data.values.friction_loss ? null : "friction_persson", zero: true},
  {name: "friction_loss", title: "Friction by loss in the rubber", label: "Friction coefficient",
    unit: "1", band: true, theory: "friction_persson", zero: true},
  {name: "friction_viscous", title: "Friction by pressure on the slopes",
    label: "Friction coefficient", unit: "1", band: true, zero: true},
  {name: "friction_interface", title: "Friction by traction in the interface",
    label: "Friction coefficient", unit: "1", band: true, zero: true},
  {name: "contact_area", title: "Contact area", label: "Fraction", unit: "1", band: true, log: true,
    theory: "area_persson"},
  {name: "mean_gap", title: "Mean gap", label: "Gap", unit: "m", band: true},
];

function seriesOf(chart) {
  const series = lines(chart.name, {band: chart.band});
  if (chart.theory) series.push(...lines(chart.theory, {label: "Persson", dash: "6 3"}));
  return series;
}

function axisOptions() {
  const name = against;
  return {xLabel: LABELS[name][0], xUnit: LABELS[name][1], logX: axisX() !== "temperature"};
}

function show() {
  const x = xOf(chosen);
  for (const [chart, drawn] of made) {
    drawn.mark = x;
    drawn.range = null;
    drawn.update(seriesOf(chart), axisOptions());
  }
  label.textContent = told(chosen);
  const marks = marksAt(chosen);
  remarks.textContent = marks ? `Warnings ${marks} concern this point.` : "";
  losses();
  map();
}

choices(show);
for (const chart of CHARTS) {
  if (!data.values[chart.name]) continue;
  made.push([chart, new Chart(parent, {...chart, ...axisOptions(), series: seriesOf(chart),
    pick: choose})]);
}
show();
