// Charts and maps as files: values as .csv, pictures as .png.

/** Offer a file of the page to be saved. */
function offer(name, blob) {
  const link = html("a", {download: name, href: URL.createObjectURL(blob)});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

/** Columns {name, values} as text: a line of names, then values in full precision. */
function csvText(columns) {
  const cell = (text) => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  const lines = [columns.map((column) => cell(column.name)).join(",")];
  const rows = Math.max(0, ...columns.map((column) => column.values.length));
  for (let i = 0; i < rows; i++) {
    lines.push(columns.map(({values}) => values[i] ?? "").join(","));
  }
  return lines.join("\n") + "\n";
}

function saveCsv(name, columns) {
  offer(fileName(name, "csv"), new Blob([csvText(columns)], {type: "text/csv"}));
}

/** A name without blanks and signs that file systems do not like, after the page's. */
function fileName(title, ending) {
  const plain = (text) => text.normalize("NFKD").replace(/[^\w.-]+/g, "_").replace(/^_+|_+$/g, "");
  return `${plain(document.title).slice(0, 60)}-${plain(title)}.${ending}`.replace(/^-/, "");
}

/** A name with its unit in parentheses; pure numbers have none. */
function withUnit(name, unit) {
  return unit && unit !== "1" ? `${name} (${unit})` : name;
}

const DRAWN = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "opacity",
  "font-size", "font-family", "font-weight"];

/** A picture of an SVG element: what style sheets say of its parts is written into a copy. */
async function imageOf(root) {
  const copy = root.cloneNode(true);
  const parts = copy.querySelectorAll("*");
  root.querySelectorAll("*").forEach((part, i) => {
    const style = getComputedStyle(part);
    for (const name of DRAWN) parts[i].style.setProperty(name, style.getPropertyValue(name));
  });
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  const text = new XMLSerializer().serializeToString(copy);
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  await image.decode();
  return image;
}

const SHARP = 3;  // dots of a saved picture for each of the screen's

/** Save a picture: a title, `keys` of {text, colour, dash}, and what `paint` draws below them. */
async function savePng(title, width, height, keys, paint) {
  const canvas = html("canvas");
  const pen = canvas.getContext("2d");
  const style = getComputedStyle(document.body);
  const font = (size, weight = "") => { pen.font = `${weight} ${size}px ${style.fontFamily}`; };
  // The legend in as many lines as it takes.
  font(12);
  const places = [];
  let x = 8, y = 44;
  for (const key of keys) {
    const wide = 38 + pen.measureText(key.text).width;
    if (x > 8 && x + wide > width) { x = 8; y += 17; }
    places.push([x, y]);
    x += wide + 8;
  }
  const head = keys.length ? y + 8 : 30;
  canvas.width = SHARP * width;
  canvas.height = SHARP * (head + height);
  pen.scale(SHARP, SHARP);
  pen.fillStyle = style.backgroundColor;
  pen.fillRect(0, 0, width, head + height);
  pen.fillStyle = style.color;
  font(15, "bold");
  pen.fillText(title, 8, 21, width - 16);
  font(12);
  keys.forEach((key, i) => {
    const [left, base] = places[i];
    pen.strokeStyle = pen.fillStyle = key.colour;
    pen.lineWidth = 2;
    pen.setLineDash((key.dash || "").split(/[ ,]+/).filter(Boolean).map(Number));
    pen.beginPath();
    pen.moveTo(left, base - 4);
    pen.lineTo(left + 26, base - 4);
    pen.stroke();
    pen.fillStyle = style.color;
    pen.fillText(key.text, left + 32, base);
  });
  pen.setLineDash([]);
  pen.translate(0, head);
  await paint(pen);
  canvas.toBlob((blob) => offer(fileName(title, "png"), blob), "image/png");
}

/** The buttons that save: pairs of a name and what it does. */
function saveButtons(title, acts) {
  return acts.map(([name, act]) => {
    const button = html("button", {type: "button", class: "save", "aria-label":
      `Save as ${name}: ${title}`, title: `Save as ${name}`}, name);
    button.addEventListener("click", act);
    return button;
  });
}
