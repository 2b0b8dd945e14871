// What the page knows of the rig, from the documents of the stream. Draws nothing.

export const SCOPE_S = 10;
export const MOST = 2000;  // cycles, and estimates
const MOVING = ["RAMP", "SETTLE", "MEASURE", "RAMP_DOWN"];

export class Rig {
  constructor() { this.forget(); }

  forget() {
    this.version = this.rig = this.state = this.health = this.diagnosis = this.finding = undefined;
    this.alarms = [];
    this.scope = new Map();
    this.alarms = [];
    this.forgetCampaign();
  }

  // What belongs to one campaign.
  forgetCampaign() {
    this.cycles = [];
    this.estimates = [];
    this.runs = [];
    this.wave = undefined;
  }

  take(document) {
    const of = {
      version: d => { this.version = d; },
      rig: d => { this.rig = d; },
      state: d => this.takeState(d),
      health: d => { this.health = d; },
      run_start: d => { this.runs.push({ ...d, accepted: 0, rejected: 0 }); },
      run_stop: d => this.takeStop(d),
      cycle: d => this.takeCycle(d),
      estimate: d => this.takeEstimate(d),
      alarm: d => this.takeAlarm(d),
      wave: d => { this.wave = d; },
      scope: d => this.takeScope(d),
      diagnosis_progress: d => { this.diagnosis = d; },
      diagnosis_result: d => { this.finding = d; this.diagnosis = undefined; },
    };
    of[document.type]?.(document);
  }

  takeState(state) {
    const was = this.state?.state;
    if (state.state === "CHECK" && !["CHECK", "PAUSE", undefined].includes(was)) this.forgetCampaign();
    this.state = state;
  }

  takeStop(stop) {
    const run = this.runs.findLast(one => one.run === stop.run);
    if (run) Object.assign(run, { status: stop.status, reason: stop.reason });
  }

  takeCycle(cycle) {
    this.cycles.push(cycle);
    thin(this.cycles);
    const run = this.runs.findLast(one => one.run === cycle.run);
    if (run) cycle.accepted ? ++run.accepted : ++run.rejected;
  }

  // Only the newest one needs more than values and bands.
  takeEstimate(estimate) {
    const before = this.estimate;
    if (before) for (const key of ["covariance", "covariance_order", "correlation", "warnings"]) delete before[key];
    this.estimates.push(estimate);
    thin(this.estimates);
  }

  // One line for each kind, with the time at which it came first. The daemon says when alarms end.
  takeAlarm(alarm) {
    if (alarm.code === "acknowledged") this.alarms = [];
    if (alarm.code === "warnings_set_aside") this.alarms = this.alarms.filter(one => one.severity === "error");
    if (alarm.severity === "info") return;
    const same = this.alarms.find(one => one.code === alarm.code && one.severity === alarm.severity);
    if (same) Object.assign(same, { text: alarm.text, times: same.times + 1 });
    else this.alarms.push({ ...alarm, times: 1 });
  }

  takeScope(scope) {
    for (const channel of scope.channels) {
      if (!channel.min || !channel.max) continue;
      if (!this.scope.has(channel.channel)) this.scope.set(channel.channel, { t: [], min: [], max: [] });
      const kept = this.scope.get(channel.channel);
      channel.bin.forEach((bin, i) => {
        kept.t.push(bin * scope.bin_s);
        kept.min.push(channel.min[i]);
        kept.max.push(channel.max[i]);
      });
      const first = kept.t.findIndex(t => t >= kept.t.at(-1) - SCOPE_S);
      for (const list of [kept.t, kept.min, kept.max]) list.splice(0, first);
    }
    this.scopeTime = scope.t_mono_ns * 1e-9;
  }

  get run() { return this.runs.at(-1); }
  get cycle() { return this.cycles.at(-1); }
  get estimate() { return this.estimates.at(-1); }
  // What the campaign says of what is tested; undefined at rest.
  get specimen() {
    const plan = this.rig?.plan;
    return plan && plan.campaign === this.state?.campaign ? plan.specimen : undefined;
  }
  get moving() { return MOVING.includes(this.state?.state); }

  // Smallest and largest value of a channel in the last second; undefined without samples.
  lastSecond(name) {
    const kept = this.scope.get(name);
    if (!kept?.t.length || this.scopeTime - kept.t.at(-1) > 1) return undefined;
    const first = kept.t.findIndex(t => t > kept.t.at(-1) - 1);
    return [Math.min(...kept.min.slice(first)), Math.max(...kept.max.slice(first))];
  }
}

// A long campaign has more than a picture can show: of the older half, every second one goes.
export function thin(list) {
  if (list.length <= MOST) return;
  const half = list.length >> 1;
  list.splice(0, half, ...list.slice(0, half).filter((_, i) => i % 2 === 0));
}

// The derivative of one period on equal steps, by its first harmonics (which are what the missing
// force is computed from as well).
export function derivative(values, frequency, harmonics = 8) {
  const n = values.length;
  const most = Math.min(harmonics, Math.floor((n - 1) / 2));
  const out = new Array(n).fill(0);
  for (let h = 1; h <= most; ++h) {
    let c = 0, s = 0;
    for (let i = 0; i < n; ++i) {
      c += values[i] * Math.cos(2 * Math.PI * h * i / n) * 2 / n;
      s += values[i] * Math.sin(2 * Math.PI * h * i / n) * 2 / n;
    }
    const omega = 2 * Math.PI * h * frequency;
    for (let i = 0; i < n; ++i)
      out[i] += omega * (s * Math.cos(2 * Math.PI * h * i / n) - c * Math.sin(2 * Math.PI * h * i / n));
  }
  return out;
}
