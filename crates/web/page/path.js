// A path as lines over the picture, and as a table.

const COLORS = { segment: "#59bfff", "to-light": "#ffd940", occluded: "#e64033" };
const ENDS = {
  miss: "it has left the scene", "max-depth": "it has as many segments as it may have", absorbed: "the surface scatters nothing",
  "no-direction": "the sampled direction lies below the surface", roulette: "Russian roulette",
};

/** The most vertices of a path of an explanation. */
export const longest = ({ sample }) => Math.max(1, ...sample.paths.map((path) => path.vertices.length));

/**
 * Draws the lines up to a number of vertices over the picture.
 *
 * @param {HTMLCanvasElement} canvas Has the picture's size.
 */
export function draw(canvas, explanation, vertices) {
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  if (!explanation) return;
  context.lineCap = "round";
  const [x, y] = explanation.sample.pixel;
  for (const { kind, vertex, throughput, pieces } of explanation.lines) {
    if (vertex >= vertices) continue;
    context.strokeStyle = COLORS[kind];
    context.globalAlpha = Math.max(0.3, Math.min(1, Math.sqrt(throughput)));
    context.setLineDash(kind === "segment" ? [] : [6, 4]);
    context.lineWidth = Math.max(1.5, canvas.width / 400);
    context.beginPath();
    for (const [ax, ay, bx, by] of pieces) {
      context.moveTo(ax, ay);
      context.lineTo(bx, by);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
  context.setLineDash([]);
  context.strokeStyle = "#fff";
  context.strokeRect(x - 3, y - 3, 7, 7);
}

const number = (value) => value === null ? "∞" : Math.abs(value) >= 1e4 || (value !== 0 && Math.abs(value) < 1e-3)
  ? value.toExponential(2) : Number(value.toPrecision(4)).toString();
const color = (rgb) => rgb.map(number).join(", ");

/** Fills `place` with what the paths of an explanation did, up to a number of vertices. */
export function tell(place, explanation, vertices) {
  if (!explanation) return place.replaceChildren();
  const { sample, instances, materials } = explanation;
  const table = document.createElement("table");
  const head = (text, kind) => {
    const cell = table.insertRow().appendChild(document.createElement("th"));
    cell.colSpan = 2;
    if (kind) {
      const swatch = cell.appendChild(document.createElement("span"));
      swatch.className = "swatch";
      swatch.style.background = COLORS[kind];
    }
    cell.append(text);
  };
  const row = (name, value) => {
    const line = table.insertRow();
    line.insertCell().textContent = name;
    line.insertCell().textContent = value;
  };
  row("pixel", sample.pixel.join(", "));
  row("radiance of the sample", color(sample.radiance));
  row("rays", sample.rays);
  sample.paths.forEach((path, index) => {
    if (sample.paths.length > 1) head(`Path ${index + 1} of ${sample.paths.length}`);
    path.vertices.slice(0, vertices).forEach((vertex) => tellVertex(vertex, { head, row, instances, materials }));
    if (vertices >= path.vertices.length) row("the end", ENDS[path.end] ?? path.end);
  });
  place.replaceChildren(table);
}

function tellVertex(vertex, { head, row, instances, materials }) {
  const surface = vertex.place.surface;
  const name = surface ? instances[surface.instance] || "a surface" : "what is infinitely far away";
  head(`${vertex.depth}: ${name}`, "segment");
  if (surface && materials[surface.material]) row("material", materials[surface.material]);
  if (vertex.distance !== null) row("distance, m", number(vertex.distance));
  row("throughput", color(vertex.throughput));
  vertex.found.forEach((found) => tellAll("light found", found, row));
  if (vertex.light_sample) tellAll("light sample", vertex.light_sample, row);
  if (vertex.scattering) tellAll("scattering", vertex.scattering, row);
}

/** A row for each field of a record: the fields are those of `alhazen explain --json`. */
function tellAll(what, record, row) {
  for (const [field, value] of Object.entries(record)) {
    const name = `${what}: ${field.replaceAll("_", " ")}`;
    if (Array.isArray(value) && value.every((v) => v === null || typeof v === "number")) row(name, color(value));
    else if (typeof value === "number") row(name, number(value));
    else if (typeof value === "string" || typeof value === "boolean") row(name, String(value));
    else if (value && typeof value === "object") tellAll(name, value, row);
  }
}
