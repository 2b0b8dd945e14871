// A plane of two quantities: closed curves and points. uPlot wants one of them to grow.
import { colour } from "./chart.js";
import { element } from "./words.js";

const MARGIN = { left: 58, right: 10, top: 8, bottom: 34 };
const planes = new Set();

// Round steps of about a sixth of the span.
function ticks(low, high) {
  const raw = (high - low) / 6, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find(factor => factor * power >= raw) * power;
  const out = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; ++k) out.push(+(k * step).toPrecision(10));
  return out;
}

export class Plane {
  constructor(place, { x, y }) {
    this.place = place;
    this.labels = { x, y };
    this.caption = element("div", { class: "caption" });
    this.canvas = element("canvas");
    place.replaceChildren(this.caption, this.canvas);
    this.content = { curves: [], points: [], box: undefined };
    planes.add(this);
    new ResizeObserver(() => this.paint()).observe(place);
  }

  // curves: [{ x, y, colour, dash }]; points: [{ x, y, colour, filled, label }]; box: [[x0, x1], [y0, y1]].
  draw(content) {
    this.content = { curves: [], points: [], ...content };
    this.paint();
  }
  say(caption) {
    if (this.caption.textContent !== caption) this.caption.textContent = caption;
  }

  span(axis) {
    if (this.content.box) return this.content.box[axis === "x" ? 0 : 1];
    const all = [...this.content.curves.flatMap(curve => curve[axis]), ...this.content.points.map(point => point[axis])];
    let low = Math.min(...all), high = Math.max(...all);
    if (!Number.isFinite(low)) [low, high] = [0, 1];
    const room = 0.06 * (high - low) || 0.5;
    return [low - room, high + room];
  }

  paint() {
    const width = Math.max(120, this.place.clientWidth);
    const height = Math.max(80, this.place.clientHeight - this.caption.offsetHeight);
    const scale = devicePixelRatio || 1;
    this.canvas.width = width * scale;
    this.canvas.height = height * scale;
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    const context = this.canvas.getContext("2d");
    context.scale(scale, scale);
    const [x0, x1] = this.span("x"), [y0, y1] = this.span("y");
    const px = x => MARGIN.left + (x - x0) / (x1 - x0) * (width - MARGIN.left - MARGIN.right);
    const py = y => height - MARGIN.bottom - (y - y0) / (y1 - y0) * (height - MARGIN.top - MARGIN.bottom);
    this.paintAxes(context, { px, py, x0, x1, y0, y1, width, height });
    for (const curve of this.content.curves) {
      context.strokeStyle = colour(curve.colour);
      context.lineWidth = 2;
      context.setLineDash(curve.dash ?? []);
      context.beginPath();
      curve.x.forEach((x, i) => context[i ? "lineTo" : "moveTo"](px(x), py(curve.y[i])));
      if (curve.closed) context.closePath();
      context.stroke();
    }
    context.setLineDash([]);
    for (const point of this.content.points) this.paintPoint(context, point, px(point.x), py(point.y));
  }

  paintAxes(context, { px, py, x0, x1, y0, y1, width, height }) {
    context.font = "11px DejaVu Sans, sans-serif";
    context.strokeStyle = colour("line");
    context.fillStyle = colour("soft");
    context.lineWidth = 1;
    context.textAlign = "center";
    for (const tick of ticks(x0, x1)) {
      context.beginPath();
      context.moveTo(px(tick), py(y0));
      context.lineTo(px(tick), py(y1));
      context.stroke();
      context.fillText(String(tick), px(tick), height - MARGIN.bottom + 14);
    }
    context.textAlign = "right";
    for (const tick of ticks(y0, y1)) {
      context.beginPath();
      context.moveTo(px(x0), py(tick));
      context.lineTo(px(x1), py(tick));
      context.stroke();
      context.fillText(String(tick), MARGIN.left - 6, py(tick) + 4);
    }
    context.fillText(this.labels.x, width - MARGIN.right, height - 4);
  }

  paintPoint(context, point, x, y) {
    context.strokeStyle = context.fillStyle = colour(point.colour);
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, point.large ? 9 : 5, 0, 2 * Math.PI);
    if (point.filled) context.fill();
    else context.stroke();
    if (!point.label) return;
    context.fillStyle = colour("ink");
    context.textAlign = "left";
    context.fillText(point.label, x + 11, y - 5);
  }
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => planes.forEach(plane => plane.paint()));
