// Parts four and five: the scope, and the last cycle over the model's.
import { Chart } from "./chart.js";
import { Plane } from "./plane.js";
import { SCOPE_S, derivative } from "./rig.js";
import { byId, figure } from "./words.js";

const MM = 1000, DASH = [7, 5];

export class Scope {
  constructor() {
    const one = (place, lines) => new Chart(byId(place), {
      series: [{ colour: "measured", width: 1 }, { colour: "measured", width: 1 }], bands: [[2, 1]],
      x: { range: [-SCOPE_S, 0] }, lines,
      range: (low, high) => [Math.min(low, ...lines().map(line => line.at)), Math.max(high, ...lines().map(line => line.at))] });
    this.limits = {};
    const at = (...names) => () => names.map(name => this.limits[name]).filter(Number.isFinite).map(value => ({ at: value }));
    this.stroke = one("scope-stroke", at("low", "high"));
    this.table = one("scope-table", at("down", "up"));
  }

  draw(rig) {
    const limits = rig.rig;
    if (limits) this.limits = { low: MM * limits.stroke_min_m, high: MM * limits.stroke_max_m,
                                down: -limits.excitation_max_m_s2, up: limits.excitation_max_m_s2 };
    this.show(this.stroke, "stroke, mm", rig.scope.get("displacement"), rig.scopeTime, MM);
    this.show(this.table, "acceleration of the table, m/s²", rig.scope.get("excitation"), rig.scopeTime, 1);
  }

  show(chart, caption, kept, now, factor) {
    chart.say(kept ? caption : `${caption}: no samples`);
    if (!kept) return chart.draw([[], [], []]);
    chart.draw([kept.t.map(t => t - now), kept.min.map(v => factor * v), kept.max.map(v => factor * v)]);
  }
}

export class Cycle {
  constructor() {
    const x = { range: [0, 1] };
    this.stroke = new Chart(byId("cycle-stroke"), { x, series: [
      { colour: "measured", points: "only" }, { colour: "model", dash: DASH }, { colour: "soft", dash: [2, 3], width: 1 }] });
    this.force = new Chart(byId("cycle-force"), { x, lines: () => [{ at: 0, colour: "soft", dash: [1, 2] }],
      series: [{ colour: "limit" }] });
    this.phase = new Plane(byId("cycle-phase"), { x: "stroke, mm" });
  }

  draw(rig) {
    const wave = rig.wave;
    byId("cycle-which").textContent = wave
      ? `run ${wave.run_index + 1}, cycle ${wave.cycle}, ${figure(wave.frequency_hz, 5)} Hz, ${wave.accepted ? "accepted" : "left out"}`
      : "none in this campaign yet";
    // The first point again at the end: the cycle closes.
    const close = list => list?.length ? [...list, list[0]] : undefined;
    const stroke = close(wave?.stroke_m) ?? [], n = Math.max(1, stroke.length - 1);
    const tau = stroke.map((_, i) => i / n);
    const response = close(wave?.response_m), force = close(wave?.missing_force_m_s2), table = close(wave?.excitation_m_s2);
    this.stroke.say(`stroke, mm, over one period. Dots: measured.${response ? " Dashed: model." : " No estimate yet."}` +
      (table ? " Fine: shape of the table's acceleration." : ""));
    this.stroke.draw([tau, stroke.map(v => MM * v), response?.map(v => MM * v) ?? tau.map(() => null),
                      shape(table, stroke) ?? tau.map(() => null)]);
    this.force.say(force ? "what the model lacks: force per mass, m/s², over the same period" : "what the model lacks: not known yet");
    this.force.draw(force ? [tau, force] : [[], []]);
    this.drawPhase(wave, stroke, response);
  }

  drawPhase(wave, stroke, response) {
    this.phase.say("phase plane: rate of the stroke, m/s, over the stroke, mm. Solid: measured. Dashed: model.");
    const curve = (values, more) => ({ x: values.map(v => MM * v), closed: true, ...more,
                                       y: close2(derivative(values.slice(0, -1), wave.frequency_hz)) });
    this.phase.draw({ curves: [...stroke.length ? [curve(stroke, { colour: "measured" })] : [],
                               ...response ? [curve(response, { colour: "model", dash: DASH })] : []] });
  }
}

const close2 = list => [...list, list[0]];

// The table's acceleration, scaled into the range of the stroke: for its phase alone.
function shape(table, stroke) {
  if (!table || !stroke.length) return undefined;
  const low = Math.min(...stroke), high = Math.max(...stroke);
  const most = Math.max(...table.map(Math.abs)) || 1;
  return table.map(v => MM * ((low + high) / 2 + v / most * (high - low) / 2));
}
