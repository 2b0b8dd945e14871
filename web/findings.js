// Parts six, seven and nine: estimate, gate, sensors, files.
import { Chart } from "./chart.js";
import { byId, bytes, dayAndTime, element, facts, figure, measured, table, unitText } from "./words.js";

const GATE_CYCLES = 60, LEAST_CHANGE = 0.1;

export class Convergence {
  constructor() { this.charts = new Map(); }

  draw(rig) {
    const estimate = rig.estimate;
    byId("estimate-which").textContent = estimate
      ? `${estimate.model}, from ${estimate.cycles_used} cycles; runs: ${estimate.runs_used}; 95 % bands` : "none in this campaign yet";
    this.drawGap(estimate);
    const free = (estimate?.parameters ?? []).filter(one => !one.fixed);
    const names = new Set(free.map(one => one.name));
    for (const [name, chart] of this.charts) {
      if (names.has(name)) continue;
      chart.remove();
      chart.place.remove();
      this.charts.delete(name);
    }
    for (const one of free) this.drawParameter(rig, one);
    byId("warnings").replaceChildren(...(estimate?.warnings ?? []).map(text => element("li", {}, text)));
  }

  drawGap(estimate) {
    const place = byId("gap");
    place.className = "gap";
    if (!(estimate?.noise_floor > 0)) return place.replaceChildren(estimate ? "Gap between model and cycles: too few cycles to tell it from noise." : "");
    place.classList.add(estimate.intervals_hold ? "good" : "bad");
    place.replaceChildren("Gap between model and cycles: ", element("b", {}, figure(estimate.gap / estimate.noise_floor, 3)),
      ` times what noise explains. ${estimate.intervals_hold ? "✔ Noise explains it." :
        "✖ Noise does not explain it: the model lacks something, and the intervals do not hold."}`);
  }

  drawParameter(rig, one) {
    if (!this.charts.has(one.name)) {
      const place = element("div", { class: "plot" });
      byId("parameters").append(place);
      this.charts.set(one.name, new Chart(place, { bands: [[3, 2]], whole: true,
        series: [{ colour: "measured" }, { colour: "measured", width: 1, dash: [3, 3] }, { colour: "measured", width: 1, dash: [3, 3] }],
        range: () => this.range(one.name) }));
    }
    const chart = this.charts.get(one.name);
    const history = rig.estimates.map(estimate => [estimate.cycles_used, estimate.parameters.find(p => p.name === one.name)])
      .filter(([, parameter]) => parameter);
    chart.history = history;
    const remark = one.determined ? (one.at_bound ? " at its bound" : "") : " not determined";
    const value = rig.estimate.intervals_hold ? measured(one.value, one.standard_error) : figure(one.value);
    chart.say(`${`${one.name} = ${value} ${unitText(one.unit)}`.trimEnd()}${remark}${rig.estimate.intervals_hold ? "" : "; its band does not hold"}`);
    chart.draw([history.map(([cycles]) => cycles), history.map(([, p]) => p.value),
                history.map(([, p]) => p.interval?.[0] ?? null), history.map(([, p]) => p.interval?.[1] ?? null)]);
  }

  // That of the newer half: the first intervals are far wider.
  range(name) {
    const history = this.charts.get(name)?.history ?? [];
    const newer = history.slice(Math.floor(history.length / 2)).map(([, p]) => p);
    const all = newer.flatMap(p => [p.value, ...p.interval ?? []]);
    return all.length ? [Math.min(...all), Math.max(...all)] : [0, 1];
  }
}

export class Gate {
  constructor() {
    this.chart = new Chart(byId("gate-plot"), { log: true, whole: true, lines: () => this.allowed ? [{ at: this.allowed }] : [],
      series: [{ colour: "good", points: "only" }, { colour: "bad", points: "only", hollow: true }],
      range: (low, high) => [Math.min(0.3, low), Math.max(high, 3 * (this.allowed ?? 3))] });
  }

  draw(rig) {
    const plan = rig.rig?.plan;
    this.allowed = plan && plan.campaign === (rig.state?.campaign ?? plan.campaign) ? plan.settle_tolerance : undefined;
    const last = rig.cycles.slice(-GATE_CYCLES);
    const x = last.map((_, i) => i + 1 - last.length);
    const of = accepted => last.map(c => c.accepted === accepted && c.change !== undefined ? Math.max(LEAST_CHANGE, c.change) : null);
    const uncompared = last.some(c => !c.accepted && !(c.change > 0));
    this.chart.say(`filled: accepted; hollow: left out${this.allowed ? `; dotted: ${figure(this.allowed)} is allowed` : ""}` +
      (uncompared ? `; hollow at ${LEAST_CHANGE}: left out for another reason` : ""));
    this.chart.draw([x, of(true), of(false)]);
    const left = rig.cycles.findLast(c => !c.accepted);
    byId("gate-why").textContent = left ? `Last left out: cycle ${left.cycle} of ${left.run}: ${left.why ?? ""}` : "";
  }
}

const QUALITY = { good: "✔ good", suspect: "? suspect", bad: "✖ bad", none: "– none" };

export function drawHealth(rig) {
  const health = rig.health;
  table(byId("channels"), [["channel", "quality", "value", "unit", "rate, Hz", "age, ms"],
    ...(health?.channels ?? []).map(c => [c.name ?? c.channel, QUALITY[c.quality] ?? c.quality,
      figure(c.unit === "m" ? 1000 * c.value : c.value, 5), c.unit === "m" ? "mm" : unitText(c.unit),
      figure(c.rate_hz, 4), c.age_s === undefined ? "–" : String(Math.round(1000 * c.age_s))])], [1, 3]);
  facts(byId("service"), health ? [
    ["exciter", health.exciter_connected ? "answers" : "DOES NOT ANSWER"],
    ["sensors", health.sensor_connected ? "answer" : "DO NOT ANSWER"],
    ["clock", health.clock], ["samples lost", health.lost + health.ring_overflows],
    ["engine late by", health.loop_late_max_s === undefined ? undefined : `${figure(1000 * health.loop_late_max_s, 3)} ms`],
    ["disk free", bytes(health.disk_free_bytes)], ["clients", health.clients]] : []);
}

export class Files {
  constructor() { this.list = []; }

  async fetch() {
    try {
      const answer = await fetch("campaigns.json");
      this.list = answer.ok ? (await answer.json()).campaigns : [];
    } catch {
      return;  // the stream tells that the gateway is away
    }
    this.drawList();
  }

  drawList() {
    const link = (href, text) => element("a", { href }, text);
    const rows = this.list.map(one => [
      one.recording ? `${one.name} (being recorded)` : link(`campaigns/${encodeURIComponent(one.name)}.db`, one.name),
      dayAndTime(one.modified_utc), bytes(one.bytes),
      one.report ? link(`reports/${encodeURIComponent(one.name)}.html`, "report") : ""]);
    table(byId("campaigns"), rows.length ? [["campaign", "written", "size", "diagnosis"], ...rows] : [], [1, 3]);
  }

  draw(rig) {
    const progress = rig.diagnosis, finding = rig.finding;
    const place = byId("diagnosis");
    if (progress) {
      place.textContent = `Diagnosis of ${progress.campaign}: ${progress.stage}, ${Math.round(100 * (progress.share ?? 0))} %`;
    } else if (finding) {
      const name = finding.database?.replace(/\.db$/, "");
      const report = this.list.find(one => one.name === name && one.report);
      place.replaceChildren(`Last diagnosis, of ${finding.campaign}: ${finding.status}. ${finding.reason} `,
        ...report ? [element("a", { href: `reports/${encodeURIComponent(name)}.html` }, "Its report")] : []);
    } else {
      place.textContent = "No diagnosis since the daemon started.";
    }
  }
}
