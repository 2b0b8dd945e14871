// A plane of two quantities: closed curves, and points with names. uPlot wants one of them to grow.
import { colour } from "./chart.js";
import { element } from "./words.js";

const MARGIN = { left: 58, right: 10, top: 8, bottom: 34 };
const LABEL_HEIGHT = 12, AWAY = 9;  // px
const planes = new Set();

const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;

// The boxes of the labels of points [{ x, y, width }] in px, in their order: about its point where it covers no point and
// no label before it, and is nearest to its own; undefined where there is no such place.
export function placesOfLabels(points, marks, frame) {
  const taken = marks.map(({ x, y, size = 5 }) => ({ left: x - size, right: x + size, top: y - size, bottom: y + size }));
  const away = (box, { x, y }) => Math.hypot((box.left + box.right) / 2 - x, (box.top + box.bottom) / 2 - y);
  return points.map(point => {
    const { x, y, width } = point;
    const at = (left, top) => ({ left, right: left + width, top, bottom: top + LABEL_HEIGHT });
    const above = y - AWAY - LABEL_HEIGHT, below = y + AWAY, right = x + AWAY, left = x - AWAY - width;
    const box = [at(right, above), at(left, above), at(x - width / 2, above), at(x - width / 2, below), at(right, below),
                 at(left, below), at(right, y - 6), at(left, y - 6)]
      .find(one => one.left >= frame.left && one.right <= frame.right && one.top >= frame.top && one.bottom <= frame.bottom &&
                   taken.every(other => apart(one, other)) &&
                   marks.every(other => away(one, other) >= away(one, point)));
    if (box) taken.push(box);
    return box;
  });
}

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
    const observer = new ResizeObserver(() => this.fit());
    observer.observe(place);
    observer.observe(this.caption);
  }

  // curves: [{ x, y, colour, dash }]; points: [{ x, y, colour, filled, large, diamond, label }]; box: [[x0, x1], [y0, y1]].
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

  fit() {
    this.width = Math.max(120, this.place.clientWidth);
    this.height = Math.max(80, this.place.clientHeight - this.caption.offsetHeight);
    this.paint();
  }

  paint() {
    const { width, height } = this;
    if (!width) return;  // the browser has not laid the page out
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
    this.paintLabels(context, px, py, { left: MARGIN.left, right: width, top: 0, bottom: height - MARGIN.bottom });
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
    if (point.diamond) [[0, -7], [7, 0], [0, 7], [-7, 0]].forEach(([right, down]) => context.lineTo(x + right, y + down));
    else context.arc(x, y, point.large ? 9 : 5, 0, 2 * Math.PI);
    context.closePath();
    if (point.filled) context.fill();
    else context.stroke();
  }

  // A name that would cover another one is left out.
  paintLabels(context, px, py, frame) {
    const named = this.content.points.filter(point => point.label);
    const at = point => ({ x: px(point.x), y: py(point.y), size: point.large ? 9 : 5,
                           width: context.measureText(point.label ?? "").width });
    context.fillStyle = colour("ink");
    context.textAlign = "left";
    placesOfLabels(named.map(at), this.content.points.map(at), frame).forEach((box, i) => {
      if (box) context.fillText(named[i].label, box.left, box.bottom - 2);
    });
  }
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => planes.forEach(plane => plane.paint()));
