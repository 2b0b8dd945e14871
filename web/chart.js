// One time-like plot, by uPlot. Follows the size of its place and the colours of the page.
import { element } from "./words.js";

const charts = new Set();

const DARK = matchMedia("(prefers-color-scheme: dark)");
let colours = new Map();  // asked of the page once: each question may cost it a layout
export function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return colours.get(name);
}
DARK.addEventListener("change", () => { colours = new Map(); });

// series: [{ colour, dash, width, points, fill }]; bands: pairs of series to fill between.
// whole: the horizontal quantity counts. range(low, high): the vertical range for the data's.
// lines(): horizontal lines [{ at, dash }].
export class Chart {
  constructor(place, { caption = "", series, bands = [], range, lines = () => [], x = {}, log = false, whole = false }) {
    this.place = place;
    this.how = { series, bands, range, lines, x, log, whole };
    this.caption = element("div", { class: "caption" }, caption);
    this.canvas = element("div", { class: "canvas" });
    place.replaceChildren(this.caption, this.canvas);
    charts.add(this);
    // The browser says the size when it has laid the page out. A longer caption may take another line.
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(place);
    this.observer.observe(this.caption);
  }

  fit() {
    const width = Math.max(120, this.place.clientWidth);
    const height = Math.max(60, this.place.clientHeight - this.caption.offsetHeight);
    if (width === this.size?.width && height === this.size?.height) return;
    this.size = { width, height };
    this.plot ? this.plot.setSize(this.size) : this.build();
  }

  // Once, as soon as there are a size and data.
  build() {
    if (!this.size || !this.data) return;
    this.plot?.destroy();
    const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line") },
                   font: "11px DejaVu Sans, sans-serif" };
    const how = this.how;
    const decades = (_, splits) => splits.map(at => Number.isInteger(+Math.log10(at).toFixed(6)) ? at : null);
    const vertical = how.log ? { filter: decades, grid: { ...axis.grid, filter: decades }, ticks: { ...axis.ticks, filter: decades } } : {};
    this.plot = new uPlot({
      ...this.size,
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, points: { show: false } },
      scales: { x: { time: false, ...how.x }, y: { distr: how.log ? 3 : 1, range: (_, low, high) => this.range(low, high) } },
      axes: [{ ...axis, size: 26, ...how.whole ? { incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000] } : {} },
             { ...axis, ...vertical, size: 58, space: 28, values: (_, ticks) => ticks.map(t => t === null ? "" : String(+t.toPrecision(6))) }],
      series: [{}, ...how.series.map(one => ({
        stroke: colour(one.colour), dash: one.dash, width: one.width ?? 2, points: { show: Boolean(one.points), size: 5,
          fill: one.hollow ? colour("card") : colour(one.colour) },
        paths: one.points === "only" ? () => null : undefined, spanGaps: false }))],
      bands: how.bands.map(pair => ({ series: pair, fill: colour("fill") })),
      hooks: { draw: [plot => this.drawLines(plot)] },
    }, this.data, this.canvas);
  }

  range(low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high)) [low, high] = this.how.log ? [0.1, 10] : [0, 1];
    if (this.how.range) [low, high] = this.how.range(low, high);
    if (this.how.log) return [low, high];
    const room = 0.08 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [low - room, high + room];
  }

  drawLines(plot) {
    const context = plot.ctx, { left, top, width, height } = plot.bbox;
    for (const line of this.how.lines()) {
      const y = plot.valToPos(line.at, "y", true);
      if (!(y >= top && y <= top + height)) continue;
      context.save();
      context.strokeStyle = colour(line.colour ?? "limit");
      context.lineWidth = 1.5 * devicePixelRatio;
      context.setLineDash((line.dash ?? [2, 4]).map(length => length * devicePixelRatio));
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(left + width, y);
      context.stroke();
      context.restore();
    }
  }

  draw(data) {
    this.data = data;
    this.plot ? this.plot.setData(data) : this.build();
  }
  say(caption) {
    if (this.caption.textContent !== caption) this.caption.textContent = caption;
  }
  remove() {
    charts.delete(this);
    this.observer.disconnect();
    this.plot?.destroy();
  }
}

DARK.addEventListener("change", () => charts.forEach(chart => chart.build()));
