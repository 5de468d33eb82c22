// Numbers with units, ticks, and line charts that zoom: SVG, by mouse, touch and keyboard.

const PREFIXES = {"-18": "a", "-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M",
  9: "G", 12: "T"};

/** The factor and prefixed unit in which values up to `largest` have up to three digits. */
function siScale(largest, unit) {
  if (!unit || unit === "1") return [1, ""];
  if (!(largest > 0) || !/^[A-Za-z]+(\/s)?$/.test(unit) || unit === "kg") return [1, unit];
  let power = 3 * Math.floor(Math.log10(largest * (1 + 1e-9)) / 3);
  power = Math.min(power, unit === "s" ? 0 : 12);
  if (power < -18) return [1, unit];
  return [Number(`1e${-power}`), PREFIXES[power] + unit];
}

/** A number in four digits. */
function digits(value, count = 4) {
  if (value === null || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(count - 1).replace(/\.?0+e/, "e")
    : String(Number(value.toPrecision(count)));
  return text.replace("e+", "e").replace("-", "−").replace("e-", "e−");
}

/** The value at a mark of a logarithmic axis, whose logarithm is given. */
function powerText(logarithm) {
  return Number.isInteger(logarithm) && Math.abs(logarithm) > 3
    ? `1e${logarithm}`.replace("-", "−") : digits(10 ** logarithm, 2);
}

/** A value with its prefixed unit. */
function shown(value, unit) {
  if (value === null || !Number.isFinite(value)) return "–";
  const [factor, name] = siScale(Math.abs(value), unit);
  return digits(value * factor) + (name ? " " + name : "");
}

/** The text of an axis, which begins with a small letter, as in the pictures of the package. */
function axisText(label, unit) {
  return label.charAt(0).toLowerCase() + label.slice(1) + (unit ? ` (${unit})` : "");
}

/** Round values between two ends, about `count` of them. */
function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const raw = (high - low) / Math.max(count, 1);
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = power * [1, 2, 5, 10].find((nice) => nice * power >= raw * (1 - 1e-9));
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) {
    found.push(Number((i * step).toPrecision(12)));
  }
  return found;
}

/**
 * Logarithms of round values between two logarithms: powers of ten, thinned to about `count`, or over less
 * than two decades 1, 2 and 5 times powers of ten. A single power would not tell the scale.
 */
function powers(low, high, count) {
  const found = [];
  const step = Math.max(1, Math.ceil((high - low) / Math.max(count, 1)));
  for (let i = Math.ceil(low - 1e-9); i <= high + 1e-9; i += step) found.push(i);
  if (found.length > 2) return found;
  const between = [];
  for (let i = Math.floor(low); i <= high; i++) {
    for (const factor of [1, 2, 5]) {
      const place = factor === 1 ? i : i + Math.log10(factor);
      if (place >= low - 1e-9 && place <= high + 1e-9) between.push(place);
    }
  }
  if (between.length > 1 && between.length <= Math.max(count, 2) + 2) return between;
  return found.length > 1 ? found : ticks(low, high, 3);
}

/** A new SVG element. */
function svg(name, attributes = {}, text = null) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  return element;
}

/** A new HTML element. */
function html(name, attributes = {}, text = null) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  return element;
}

/** The width inside an element's padding. */
function innerWidthOf(element) {
  const style = getComputedStyle(element);
  return element.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
}

let charts = 0;

/**
 * A line chart. `options`: title, label, unit, log, logX, zero (y starts at 0), series of {label,
 * colour, dash, marks, x, y, low, high, flags} (between low and high a line has a ribbon; points with
 * a text in flags have a ring, or a cross at the lower edge if they have no y), levels of
 * {value, label}, bands of {from, to, state}, xLabel, xUnit, and pick, which is called with the x
 * that was clicked and the number of the nearest line. `group`: charts that zoom along x together.
 */
class Chart {
  constructor(parent, options, group = null) {
    this.options = options;
    this.id = `chart${charts++}`;
    this.range = null;
    this.cursor = null;
    this.mark = null;
    this.hidden = new Set();
    this.group = group;
    if (group) group.push(this);
    this.figure = html("figure", {class: "chart"});
    const head = html("figcaption");
    head.append(html("strong", {}, options.title));
    const buttons = html("span", {class: "buttons"});
    for (const [sign, name, act] of [["+", "Zoom in", () => this.zoom(0.5)],
      ["−", "Zoom out", () => this.zoom(2)], ["↺", "Show all", () => this.setRange(null)]]) {
      const button = html("button", {type: "button", "aria-label": `${name}: ${options.title}`,
        title: name}, sign);
      button.addEventListener("click", act);
      buttons.append(button);
    }
    buttons.append(...saveButtons(options.title, [["csv", () => this.saveCsv()],
      ["png", () => this.savePng()]]));
    head.append(buttons);
    this.legend = html("div", {class: "legend"});
    this.svg = svg("svg", {role: "img", tabindex: "0", "aria-label":
      `${options.title}. Arrow keys read values, plus and minus zoom, 0 shows all.`});
    this.readout = html("div", {class: "readout", "aria-live": "polite"}, "\u00a0");
    this.figure.append(head, this.legend, this.svg, this.readout);
    parent.append(this.figure);
    this.makeLegend();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.figure);
    this.draw();
  }

  /** Save the values of all lines in SI units; lines of one x share its column. */
  saveCsv() {
    const {series, xLabel, xUnit, unit, label, title} = this.options;
    const columns = [];
    let last = null;
    for (const line of series) {
      if (line.x !== last && String(line.x) !== String(last)) {
        columns.push({name: withUnit(xLabel, xUnit), values: line.x});
      }
      last = line.x;
      columns.push({name: withUnit(line.label || label, unit), values: line.y});
      if (line.low) {
        columns.push({name: withUnit(`${line.label} low`, unit), values: line.low},
          {name: withUnit(`${line.label} high`, unit), values: line.high});
      }
      if (line.flags && line.flags.some(Boolean)) {
        columns.push({name: `${line.label} warnings`, values: line.flags});
      }
    }
    saveCsv(title, columns);
  }

  /** Save the chart as it is seen, with its title and legend. */
  savePng() {
    const width = Number(this.svg.getAttribute("width"));
    const height = Number(this.svg.getAttribute("height"));
    this.cursor = null;
    this.drawCursor();
    const style = getComputedStyle(document.documentElement);
    const {series, title} = this.options;
    const keys = series.length < 2 ? [] : series.filter((_, number) => !this.hidden.has(number))
      .map((line) => ({text: line.label, colour: style.getPropertyValue(`--c${line.colour}`).trim(),
        dash: line.dash}));
    return savePng(title, width, height, keys, async (pen) => {
      pen.drawImage(await imageOf(this.svg), 0, 0, width, height);
    });
  }

  makeLegend() {
    this.legend.replaceChildren();
    const series = this.options.series;
    series.forEach((line, number) => {
      const entry = html("button", {type: "button", "aria-pressed": "true",
        title: "Show or hide"});
      const sample = svg("svg", {width: 26, height: 10, "aria-hidden": "true"});
      sample.append(line.marks
        ? svg("rect", {x: 10, y: 2, width: 6, height: 6, class: `fill${line.colour}`})
        : svg("line", {x1: 0, x2: 26, y1: 5, y2: 5, class: `line stroke${line.colour}`,
          "stroke-dasharray": line.dash || "none"}));
      entry.append(sample, document.createTextNode(line.label));
      entry.addEventListener("click", () => {
        if (this.hidden.has(number)) this.hidden.delete(number); else this.hidden.add(number);
        entry.setAttribute("aria-pressed", String(!this.hidden.has(number)));
        this.draw();
      });
      this.legend.append(entry);
    });
    this.legend.hidden = series.length < 2;
  }

  /** Other values of the same lines. */
  update(series, more = {}) {
    const labels = (lines) => lines.map((line) => line.label).join();
    const same = labels(series) === labels(this.options.series);
    Object.assign(this.options, {series}, more);
    if (!same) { this.hidden.clear(); this.makeLegend(); }
    this.draw();
  }

  toX(value) { return this.options.logX ? Math.log10(value) : value; }
  toY(value) { return this.options.log ? Math.log10(value) : value; }

  /** The ends of all x. */
  whole() {
    let low = Infinity, high = -Infinity;
    for (const line of this.options.series) {
      for (const value of line.x) {
        if (value === null) continue;
        const x = this.toX(value);
        if (!Number.isFinite(x)) continue;
        if (x < low) low = x;
        if (x > high) high = x;
      }
    }
    if (!(low <= high)) return [0, 1];
    if (low === high) return [low - (Math.abs(low) || 1) / 2, high + (Math.abs(high) || 1) / 2];
    return [low, high];
  }

  setRange(range, shared = true) {
    const [low, high] = this.whole();
    if (range) {
      let [from, to] = range;
      const least = (high - low) * 1e-5;
      if (to - from < least) { const mid = (from + to) / 2; from = mid - least / 2; to = mid + least / 2; }
      if (to - from >= (high - low) * 0.999) range = null;
      else {
        if (from < low) { to += low - from; from = low; }
        if (to > high) { from -= to - high; to = high; }
        range = [Math.max(from, low), Math.min(to, high)];
      }
    }
    this.range = range;
    this.draw();
    if (shared && this.group) {
      for (const other of this.group) if (other !== this) other.setRange(range, false);
    }
  }

  zoom(factor, about = null) {
    const [low, high] = this.range || this.whole();
    const middle = about === null ? (low + high) / 2 : about;
    this.setRange([middle - (middle - low) * factor, middle + (high - middle) * factor]);
  }

  draw() {
    const width = Math.max(innerWidthOf(this.figure), 220);
    const height = width < 420 ? 210 : 240;
    const [x0, x1] = this.range || this.whole();
    const {options} = this;
    const visible = options.series.filter((_, number) => !this.hidden.has(number));
    // The ends of y over what is seen.
    let low = Infinity, high = -Infinity;
    for (const line of visible) {
      for (let i = 0; i < line.x.length; i++) {
        if (line.y[i] === null || line.x[i] === null) continue;
        const x = this.toX(line.x[i]), y = this.toY(line.y[i]);
        if (x < x0 || x > x1 || !Number.isFinite(y)) continue;
        for (const value of [y, ...this.ribbonAt(line, i)]) {
          if (value < low && value > -Infinity) low = value;
          if (value > high) high = value;
        }
      }
    }
    for (const level of options.levels || []) {
      const y = this.toY(level.value);
      if (y < low) low = y;
      if (y > high) high = y;
    }
    if (!(low <= high)) { low = 0; high = 1; }
    if (options.zero || (!options.log && low > 0 && low < 0.4 * high)) low = Math.min(low, 0);
    if (low === high) { const pad = options.log ? 0.5 : Math.abs(low) * 0.1 || 0.5; low -= pad; high += pad; }
    const pad = (high - low) * 0.06;
    const y0 = low === 0 && !options.log ? 0 : low - pad, y1 = high + pad;
    const [fy, unitY] = options.log ? [1, options.unit === "1" ? "" : options.unit]
      : siScale(Math.max(Math.abs(y0), Math.abs(y1)), options.unit);
    const [fx, unitX] = options.logX ? [1, options.xUnit === "1" ? "" : options.xUnit]
      : siScale(Math.max(...this.whole().map(Math.abs)), options.xUnit);
    const marksY = options.log ? powers(y0, y1, 5) : ticks(y0 * fy, y1 * fy, 5).map((v) => v / fy);
    const textY = marksY.map((y) => options.log ? powerText(y) : digits(y * fy));
    const left = 26 + 7 * Math.max(2, ...textY.map((text) => text.length));
    const box = {left, right: width - 10, top: 8, bottom: height - 38};
    this.box = box;
    const px = (x) => box.left + (x - x0) / (x1 - x0) * (box.right - box.left);
    const py = (y) => box.bottom - (y - y0) / (y1 - y0) * (box.bottom - box.top);
    Object.assign(this, {px, py, x0, x1, y0, fx, unitX});

    const root = this.svg;
    root.setAttribute("width", width);
    root.setAttribute("height", height);
    root.setAttribute("viewBox", `0 0 ${width} ${height}`);
    root.replaceChildren();
    const clip = svg("clipPath", {id: `${this.id}clip`});
    clip.append(svg("rect", {x: box.left, y: box.top, width: Math.max(box.right - box.left, 1),
      height: box.bottom - box.top}));
    const inside = svg("g", {"clip-path": `url(#${this.id}clip)`});
    root.append(clip);
    for (const band of options.bands || []) {
      const a = px(Math.max(band.from, x0)), b = px(Math.min(band.to, x1));
      if (b > a) root.append(svg("rect", {x: a, y: box.top, width: b - a,
        height: box.bottom - box.top, class: `band state${band.state}`}));
    }
    marksY.forEach((y, i) => {
      root.append(svg("line", {x1: box.left, x2: box.right, y1: py(y), y2: py(y), class: "grid"}));
      root.append(svg("text", {x: box.left - 6, y: py(y) + 4, "text-anchor": "end"}, textY[i]));
    });
    const marksX = options.logX ? powers(x0, x1, Math.floor(width / 75))
      : ticks(x0 * fx, x1 * fx, Math.floor(width / 90)).map((v) => v / fx);
    for (const x of marksX) {
      root.append(svg("line", {x1: px(x), x2: px(x), y1: box.top, y2: box.bottom, class: "grid"}));
      const text = options.logX ? powerText(x) : digits(x * fx, 6);
      root.append(svg("text", {x: Math.min(Math.max(px(x), box.left + 4), box.right - 8),
        y: box.bottom + 15, "text-anchor": "middle"}, text));
    }
    root.append(svg("rect", {x: box.left, y: box.top, width: Math.max(box.right - box.left, 1),
      height: box.bottom - box.top, class: "frame"}));
    root.append(svg("text", {x: (box.left + box.right) / 2, y: height - 6, "text-anchor": "middle",
      class: "axis"}, axisText(options.xLabel, unitX)));
    root.append(svg("text", {x: 0, y: 0, "text-anchor": "middle", class: "axis", transform:
      `translate(12 ${(box.top + box.bottom) / 2}) rotate(-90)`},
    axisText(options.label, unitY)));
    root.append(inside);
    for (const level of options.levels || []) {
      const y = py(this.toY(level.value));
      inside.append(svg("line", {x1: box.left, x2: box.right, y1: y, y2: y, class: "level"}));
      inside.append(svg("text", {x: box.right - 4, y: y < box.top + 16 ? y + 13 : y - 4,
        "text-anchor": "end"},
        `${level.label} ${digits(level.value)}`));
    }
    if (this.mark !== null && Number.isFinite(this.mark)) {
      const x = px(this.toX(this.mark));
      inside.append(svg("line", {x1: x, x2: x, y1: box.top, y2: box.bottom, class: "mark"}));
    }
    for (const line of visible) this.drawLine(inside, line);
    for (const line of visible) this.drawFlags(root, line);
    this.pointer = svg("g");
    root.append(this.pointer);
    this.selection = svg("rect", {class: "selection", y: box.top, width: 0,
      height: box.bottom - box.top});
    root.append(this.selection);
    this.drawCursor();
  }

  /** The ends of a line's ribbon at a point. On a logarithmic axis a low end of 0 or less is at minus infinity. */
  ribbonAt(line, i) {
    if (!line.low || line.low[i] === null || line.high[i] === null) return [];
    const low = this.options.log && line.low[i] <= 0 ? -Infinity : this.toY(line.low[i]);
    const high = this.toY(line.high[i]);
    return Number.isFinite(high) ? [low, high] : [];
  }

  /** The ribbon of a line, piece by piece. */
  drawRibbon(inside, line) {
    let piece = [];
    const close = () => {
      if (piece.length > 1) {
        const ends = [...piece.map(([x, low]) => [x, low]),
          ...piece.reverse().map(([x, , high]) => [x, high])];
        inside.append(svg("path", {class: `ribbon fill${line.colour}`, d: ends.map(([x, y], n) =>
          `${n ? "L" : "M"}${x.toFixed(1)} ${this.py(y).toFixed(1)}`).join("") + "Z"}));
      }
      piece = [];
    };
    for (let i = 0; i < line.x.length; i++) {
      const ends = line.x[i] === null ? [] : this.ribbonAt(line, i);
      // A low end at minus infinity is drawn at the lower edge.
      if (ends.length) piece.push([this.px(this.toX(line.x[i])), Math.max(ends[0], this.y0), ends[1]]);
      else close();
    }
    close();
  }

  drawLine(inside, line) {
    if (line.low) this.drawRibbon(inside, line);
    const points = [];
    let path = "", open = false;
    for (let i = 0; i < line.x.length; i++) {
      const x = line.x[i] === null ? NaN : this.px(this.toX(line.x[i]));
      const y = line.y[i] === null ? NaN : this.py(this.toY(line.y[i]));
      if (!Number.isFinite(x) || !Number.isFinite(y)) {
        open = line.marks ? false : (line.y[i] === null ? false : open);
        continue;
      }
      path += `${open ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
      open = true;
      if (x >= this.box.left - 1 && x <= this.box.right + 1) points.push([x, y]);
    }
    if (!line.marks) {
      inside.append(svg("path", {d: path, class: `line stroke${line.colour}`,
        "stroke-dasharray": line.dash || "none"}));
    }
    if (line.marks || points.length <= 40) {
      for (const [x, y] of points) {
        inside.append(line.marks
          ? svg("rect", {x: x - 3, y: y - 3, width: 6, height: 6, class: `fill${line.colour}`})
          : svg("circle", {cx: x, cy: y, r: 2.6, class: `fill${line.colour}`}));
      }
    }
  }

  /** Mark the points of a line about which there is something to know. */
  drawFlags(root, line) {
    if (!line.flags) return;
    const {left, right, top, bottom} = this.box;
    line.flags.forEach((text, i) => {
      const x = line.x[i] === null ? NaN : this.px(this.toX(line.x[i]));
      if (!text || !(x >= left - 1 && x <= right + 1)) return;
      const y = line.y[i] === null ? NaN : this.py(this.toY(line.y[i]));
      if (y < top - 1 || y > bottom + 1) return;
      const low = bottom - 7;
      const sign = Number.isFinite(y) ? svg("circle", {cx: x, cy: y, r: 6, class: "flag"})
        : svg("path", {class: "flag", d: `M${x - 5} ${low - 5}l10 10m0 -10l-10 10`});
      sign.append(svg("title", {}, text));
      root.append(sign);
    });
  }

  /** Read the values next to an x. */
  read(x) {
    let best = null, near = Infinity;
    for (const line of this.options.series) {
      for (let i = 0; i < line.x.length; i++) {
        if (line.x[i] === null || (line.y[i] === null && !(line.flags && line.flags[i]))) continue;
        const distance = Math.abs(this.toX(line.x[i]) - x);
        if (distance < near) { near = distance; best = line.x[i]; }
      }
    }
    this.cursor = best;
    this.drawCursor();
  }

  drawCursor() {
    if (!this.pointer) return;
    this.pointer.replaceChildren();
    if (this.cursor === null) { this.readout.textContent = this.hint(); return; }
    const {options, cursor} = this;
    const x = this.px(this.toX(cursor));
    const told = [`${options.xLabel} ${options.logX
      ? digits(cursor) + (options.xUnit === "1" ? "" : " " + options.xUnit)
      : shown(cursor, options.xUnit)}`];
    if (x >= this.box.left - 1 && x <= this.box.right + 1) {
      this.pointer.append(svg("line", {x1: x, x2: x, y1: this.box.top, y2: this.box.bottom,
        class: "cursor"}));
    }
    options.series.forEach((line, number) => {
      if (this.hidden.has(number)) return;
      // Of two rows at one place, before and after a jump, the later one.
      const i = line.x.lastIndexOf(cursor);
      const value = i < 0 ? null : line.y[i];
      const flag = i < 0 || !line.flags ? null : line.flags[i];
      if (value === null && !flag) return;
      told.push(`${line.label} ${options.log ? digits(value) + (options.unit === "1" || value === null
        ? "" : " " + options.unit) : shown(value, options.unit)}${flag ? " " + flag : ""}`);
      if (value === null) return;
      const y = this.py(this.toY(value));
      if (Number.isFinite(y) && y >= this.box.top && y <= this.box.bottom && x >= this.box.left - 1) {
        this.pointer.append(svg("circle", {cx: x, cy: y, r: 4, class: `fill${line.colour} dot`}));
      }
    });
    this.readout.textContent = told.join(" · ");
  }

  /** Tell which point was chosen: the x of the cursor, and the line nearest to a height. */
  pick(clientY = null) {
    if (!this.options.pick || this.cursor === null) return;
    let best = null, near = Infinity;
    const top = this.svg.getBoundingClientRect().top;
    this.options.series.forEach((line, number) => {
      const i = line.x.lastIndexOf(this.cursor);
      if (i < 0 || line.y[i] === null || this.hidden.has(number)) return;
      const away = clientY === null ? number
        : Math.abs(this.py(this.toY(line.y[i])) + top - clientY);
      if (away < near) { near = away; best = number; }
    });
    if (best !== null) this.options.pick(this.cursor, best);
  }

  hint() { return this.range ? "Double click or 0: show all." : "\u00a0"; }

  /** Step the cursor along the points. */
  step(by) {
    const all = new Set();
    for (const line of this.options.series) {
      line.x.forEach((x, i) => { if (x !== null && line.y[i] !== null) all.add(x); });
    }
    const points = [...all].sort((a, b) => a - b);
    if (!points.length) return;
    let at = this.cursor === null ? (by > 0 ? -1 : points.length) : points.indexOf(this.cursor);
    at = Math.min(Math.max(at + by, 0), points.length - 1);
    this.cursor = points[at];
    const x = this.toX(this.cursor);
    if (this.range && (x < this.x0 || x > this.x1)) {
      const half = (this.x1 - this.x0) / 2;
      this.setRange([x - half, x + half]);
    }
    this.drawCursor();
  }

  listen() {
    const root = this.svg;
    const pointers = new Map();
    let start = null;
    const at = (event) => {
      const place = root.getBoundingClientRect();
      return event.clientX - place.left;
    };
    const value = (position) => this.x0 + (position - this.box.left)
      / (this.box.right - this.box.left) * (this.x1 - this.x0);
    root.addEventListener("pointerdown", (event) => {
      if (event.button > 0) return;
      pointers.set(event.pointerId, at(event));
      try { root.setPointerCapture(event.pointerId); } catch { /* not an active pointer */ }
      if (pointers.size === 1) {
        start = {position: at(event), range: [this.x0, this.x1],
          pan: event.pointerType === "touch" || event.shiftKey};
        this.read(value(at(event)));
      } else if (pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        start = {pinch: Math.max(Math.abs(a - b), 10), middle: value((a + b) / 2),
          range: [this.x0, this.x1]};
      }
    });
    root.addEventListener("pointermove", (event) => {
      if (pointers.has(event.pointerId)) pointers.set(event.pointerId, at(event));
      if (start && start.pinch && pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        const factor = start.pinch / Math.max(Math.abs(a - b), 10);
        const [low, high] = start.range;
        this.setRange([start.middle - (start.middle - low) * factor,
          start.middle + (high - start.middle) * factor]);
        return;
      }
      if (start && !start.pinch && pointers.size === 1) {
        const moved = at(event) - start.position;
        if (start.pan && this.range) {
          const by = -moved / (this.box.right - this.box.left) * (start.range[1] - start.range[0]);
          this.setRange([start.range[0] + by, start.range[1] + by]);
        } else if (!start.pan && Math.abs(moved) > 4) {
          this.selection.setAttribute("x", Math.min(start.position, at(event)));
          this.selection.setAttribute("width", Math.abs(moved));
        }
      }
      if (!start || start.pan) this.read(value(at(event)));
    });
    const end = (event) => {
      if (!pointers.delete(event.pointerId)) return;
      this.selection.setAttribute("width", 0);
      if (start && !start.pinch && !start.pan && event.type === "pointerup"
          && Math.abs(at(event) - start.position) > 6) {
        const ends = [value(start.position), value(at(event))].sort((a, b) => a - b);
        this.setRange(ends);
      }
      if (event.type === "pointerup" && start && !start.pinch
          && Math.abs(at(event) - start.position) <= 6) this.pick(event.clientY);
      if (!pointers.size) start = null;
    };
    root.addEventListener("pointerup", end);
    root.addEventListener("pointercancel", end);
    root.addEventListener("pointerleave", (event) => {
      if (event.pointerType === "mouse" && !start) { this.cursor = null; this.drawCursor(); }
    });
    root.addEventListener("dblclick", () => this.setRange(null));
    root.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;  // the page scrolls
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, value(at(event)));
    }, {passive: false});
    root.addEventListener("keydown", (event) => {
      const acts = {ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
        Home: () => this.step(-1e9), End: () => this.step(1e9),
        "+": () => this.zoom(0.5, this.cursor === null ? null : this.toX(this.cursor)),
        "=": () => this.zoom(0.5, this.cursor === null ? null : this.toX(this.cursor)),
        "-": () => this.zoom(2), 0: () => this.setRange(null), Enter: () => this.pick()};
      const act = acts[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act();
    });
  }
}
