// Maps of fields in a canvas, with axes, colour bar, arrows and values under the pointer.

/** The 16-bit integers of a packed field, back in its unit. */
function unpack(field) {
  const bytes = Uint8Array.from(atob(field.data), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  const values = new Float64Array(bytes.length / 2);
  const step = (field.high - field.low) / 65535;
  for (let i = 0; i < values.length; i++) values[i] = field.low + view.getUint16(2 * i, true) * step;
  return values;
}

/** The states of contact of a snapshot. */
function unpackStates(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** A colour of a table of '#rrggbb', at 0 to 1. */
function colourAt(table, part) {
  const place = Math.min(Math.max(part, 0), 1) * (table.length - 1);
  const i = Math.min(Math.floor(place), table.length - 2);
  const rest = place - i;
  return [1, 3, 5].map((from) => {
    const a = parseInt(table[i].slice(from, from + 2), 16);
    const b = parseInt(table[i + 1].slice(from, from + 2), 16);
    return Math.round(a + (b - a) * rest);
  });
}

const OPEN = [222, 222, 222], STICK = [0, 114, 178], SLIP = [230, 159, 0];

/** A map of `grid`; `show` fills it. */
class FieldMap {
  constructor(parent, title, grid) {
    this.grid = grid;
    this.title = title;
    this.figure = html("figure", {class: "map"});
    const head = html("figcaption");
    head.append(html("strong", {}, title));
    const buttons = html("span", {class: "buttons"});
    buttons.append(...saveButtons(title, [["csv", () => this.saveCsv()],
      ["png", () => this.savePng()]]));
    head.append(buttons);
    this.figure.append(head);
    this.frame = html("div", {class: "mapframe"});
    this.canvas = html("canvas", {width: grid.mx, height: grid.my, role: "img", tabindex: "0",
      "aria-label": `Map: ${title}. Arrow keys read values.`});
    this.over = svg("svg", {"aria-hidden": "true"});
    this.frame.append(this.canvas, this.over);
    this.bar = html("div", {class: "bar"});
    this.readout = html("div", {class: "readout", "aria-live": "polite"}, "\u00a0");
    this.figure.append(this.frame, this.bar, this.readout);
    parent.append(this.figure);
    this.cell = null;
    const context = (event) => {
      const place = this.canvas.getBoundingClientRect();
      this.cell = [Math.floor((event.clientX - place.left) / place.width * grid.mx),
        Math.floor((place.bottom - event.clientY) / place.height * grid.my)];
      this.tell();
    };
    this.canvas.addEventListener("pointermove", context);
    this.canvas.addEventListener("pointerdown", context);
    this.canvas.addEventListener("pointerleave", () => { this.cell = null; this.tell(); });
    this.canvas.addEventListener("keydown", (event) => {
      const move = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
      if (!move) return;
      event.preventDefault();
      const [i, j] = this.cell || [grid.mx >> 1, grid.my >> 1];
      this.cell = [i + move[0], j + move[1]];
      this.tell();
    });
    new ResizeObserver(() => this.place()).observe(this.figure);
  }

  /**
   * Draw values. `paint(i)` gives the colour of a cell, `word(i)` its value in words; `arrows` are
   * x, y and tractions; `bar` the elements of the colour bar; `values` the numbers in `unit` that are
   * saved.
   */
  show(paint, word, bar, arrows, values, unit) {
    const {mx, my} = this.grid;
    const context = this.canvas.getContext("2d");
    const picture = context.createImageData(mx, my);
    for (let j = 0; j < my; j++) {
      for (let i = 0; i < mx; i++) {
        const [red, green, blue] = paint(j * mx + i);
        const at = 4 * ((my - 1 - j) * mx + i);
        picture.data[at] = red;
        picture.data[at + 1] = green;
        picture.data[at + 2] = blue;
        picture.data[at + 3] = 255;
      }
    }
    context.putImageData(picture, 0, 0);
    this.word = word;
    this.arrows = arrows;
    this.values = values;
    this.unit = unit;
    this.bar.replaceChildren(...bar);
    this.place();
    this.tell();
  }

  /** Where the middle of a cell, or of a block of cells, lies. */
  middle(k, n, length) {
    const {block} = this.grid;
    return (Math.min((k + 1) * block, n) + k * block - 1) / 2 * length / n;
  }

  /** Save x, y and value of each cell of the page, in SI units. */
  saveCsv() {
    const {mx, my, nx, ny, lx, ly} = this.grid;
    const count = [...Array(mx * my).keys()];
    const number = (value) => Number(value.toPrecision(10));
    saveCsv(this.title, [
      {name: "x (m)", values: count.map((k) => number(this.middle(k % mx, nx, lx)))},
      {name: "y (m)", values: count.map((k) => number(this.middle(Math.floor(k / mx), ny, ly)))},
      {name: withUnit(this.title, this.unit), values: count.map((k) => number(this.values[k]))}]);
  }

  /** Save the map as it is seen, with its title and colour bar. */
  savePng() {
    const width = Number(this.over.getAttribute("width"));
    const height = Number(this.over.getAttribute("height"));
    const scale = this.bar.querySelector(".scale");
    const texts = [...this.bar.querySelectorAll(".numbers span")].map((each) => each.textContent);
    const words = [...this.bar.querySelectorAll(".key")].flatMap((each) =>
      [...each.childNodes].map((node) => node.textContent).filter(Boolean)).join(",  ");
    const below = (scale ? 40 : 0) + (words && !scale ? 24 : 0);
    return savePng(this.title, Math.max(width, 240), height + below, [], async (pen) => {
      const {left, top, width: wide, height: tall} = this.canvas.style;
      pen.imageSmoothingEnabled = false;
      pen.drawImage(this.canvas, ...[left, top, wide, tall].map(parseFloat));
      pen.drawImage(await imageOf(this.over), 0, 0, width, height);
      const style = getComputedStyle(document.body);
      pen.fillStyle = style.color;
      pen.font = `12px ${style.fontFamily}`;
      if (!scale) {
        pen.fillText(words, 8, height + 14, width - 16);
        return;
      }
      const fade = pen.createLinearGradient(46, 0, width - 8, 0);
      const colours = scale.dataset.colours.split(",");
      colours.forEach((colour, i) => fade.addColorStop(i / (colours.length - 1), colour));
      pen.fillStyle = fade;
      pen.fillRect(46, height + 4, width - 54, 12);
      pen.fillStyle = style.color;
      texts.forEach((text, i) => {
        pen.textAlign = ["left", "center", "right"][i];
        pen.fillText(text, [46, (width + 38) / 2, width - 8][i], height + 31);
      });
    });
  }

  /** Fit the map into the page; axes and arrows are drawn anew. */
  place() {
    const {lx, ly, mx, my, nx, ny, block} = this.grid;
    const left = 46, bottom = 34, top = 4, right = 8;
    const whole = Math.max(innerWidthOf(this.figure), 200);
    // The last block of a side may be cut.
    const seenX = lx * mx * block / nx, seenY = ly * my * block / ny;
    let width = whole - left - right;
    let height = width * seenY / seenX;
    const most = 420;
    if (height > most) { width *= most / height; height = most; }
    height = Math.max(height, 24);
    this.frame.style.width = `${width + left + right}px`;
    this.frame.style.height = `${height + top + bottom}px`;
    Object.assign(this.canvas.style, {left: `${left}px`, top: `${top}px`, width: `${width}px`,
      height: `${height}px`});
    const root = this.over;
    root.setAttribute("width", width + left + right);
    root.setAttribute("height", height + top + bottom);
    root.replaceChildren();
    const [factor, unit] = siScale(Math.max(lx, ly), "m");
    // x = 0 is the centre of the first cell.
    const px = (x) => left + (x + lx / nx / 2) / seenX * width;
    const py = (y) => top + height - (y + ly / ny / 2) / seenY * height;
    root.append(svg("rect", {x: left, y: top, width, height, class: "frame"}));
    for (const x of ticks(0, lx * factor * (1 - 0.5 / nx), Math.max(2, Math.floor(width / 70)))) {
      root.append(svg("line", {x1: px(x / factor), x2: px(x / factor), y1: top + height,
        y2: top + height + 4, class: "tick"}));
      root.append(svg("text", {x: px(x / factor), y: top + height + 16, "text-anchor": "middle"},
        digits(x)));
    }
    for (const y of ticks(0, ly * factor * (1 - 0.5 / ny), Math.max(2, Math.floor(height / 50)))) {
      root.append(svg("line", {x1: left - 4, x2: left, y1: py(y / factor), y2: py(y / factor),
        class: "tick"}));
      root.append(svg("text", {x: left - 7, y: py(y / factor) + 4, "text-anchor": "end"}, digits(y)));
    }
    root.append(svg("text", {x: left + width / 2, y: top + height + 31, "text-anchor": "middle",
      class: "axis"}, `x (${unit})`));
    // Beside a flat map there is no room for it; the unit is that of x.
    if (height >= 48) {
      root.append(svg("text", {x: 0, y: 0, "text-anchor": "middle", class: "axis",
        transform: `translate(11 ${top + height / 2}) rotate(-90)`}, `y (${unit})`));
    }
    if (this.arrows) this.drawArrows(px, py, Math.max(width, height));
  }

  drawArrows(px, py, side) {
    const [xs, ys, along, across] = this.arrows;
    let largest = 0;
    for (let i = 0; i < xs.length; i++) largest = Math.max(largest, Math.hypot(along[i], across[i]));
    if (!(largest > 0)) return;
    const longest = Math.max(1.6 * side / 22, 12);
    let path = "", heads = "";
    for (let i = 0; i < xs.length; i++) {
      const dx = along[i] / largest * longest, dy = -across[i] / largest * longest;
      const size = Math.hypot(dx, dy);
      if (size < 1.5) continue;
      const x = px(xs[i]), y = py(ys[i]), head = Math.min(4.5, 0.6 * size);
      const ux = dx / size, uy = dy / size;
      path += `M${x.toFixed(1)} ${y.toFixed(1)}l${dx.toFixed(1)} ${dy.toFixed(1)}`;
      heads += `M${(x + dx).toFixed(1)} ${(y + dy).toFixed(1)}`
        + `l${(-head * ux - head * uy / 2).toFixed(1)} ${(-head * uy + head * ux / 2).toFixed(1)}`
        + `l${(head * uy).toFixed(1)} ${(-head * ux).toFixed(1)}z`;
    }
    this.over.append(svg("path", {d: path + heads, class: "arrowedge"}),
      svg("path", {d: path, class: "arrow"}), svg("path", {d: heads, class: "arrowhead"}));
  }

  tell() {
    const {mx, my, lx, ly, nx, ny} = this.grid;
    if (!this.cell || !this.word) { this.readout.textContent = "\u00a0"; return; }
    const i = this.cell[0] = Math.min(Math.max(this.cell[0], 0), mx - 1);
    const j = this.cell[1] = Math.min(Math.max(this.cell[1], 0), my - 1);
    this.readout.textContent = `x ${shown(this.middle(i, nx, lx), "m")}, y `
      + `${shown(this.middle(j, ny, ly), "m")}: ${this.word(j * mx + i)}`;
  }
}

/** The elements of a colour bar. */
function colourBar(table, [low, middle, high], unit, open) {
  if (!(high > low)) return [html("div", {class: "key"}, `${shown(low, unit)} everywhere`)];
  const [factor, name] = siScale(Math.max(Math.abs(low), Math.abs(high)), unit);
  const scale = html("div", {class: "scale"});
  scale.style.background = `linear-gradient(to right, ${table.join(",")})`;
  scale.dataset.colours = table.join(",");
  const numbers = html("div", {class: "numbers"});
  for (const value of [low, middle, high]) {
    // The middle of heights of both signs is zero but for round-off and for peaks that miss the cells.
    const round = Math.abs(value) < 5e-4 * (high - low) ? 0 : value;
    numbers.append(html("span", {}, digits(round * factor, 3)));
  }
  numbers.lastChild.textContent += name ? ` ${name}` : "";
  const parts = [scale, numbers];
  if (open) {
    const key = html("div", {class: "key"});
    key.append(swatch(OPEN), "no contact");
    parts.push(key);
  }
  return parts;
}

/** A square of a colour. */
function swatch(colour) {
  const square = html("span", {class: "swatch"});
  square.style.background = `rgb(${colour.join(",")})`;
  return square;
}
