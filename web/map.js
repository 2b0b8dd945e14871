// Part eight: where the campaign has been, and what a plan would add. The plan is a file that the operator chooses; it
// stays in this browser.
import { Plane } from "./plane.js";
import { byId } from "./words.js";

const KEPT = `plan of ${location.pathname}`, MOST_BYTES = 1e6, MOST_RUNS = 1000;
const SAME = 0.01;  // relative: such a run has been measured

// A file may hold comments, as every file of shakerctl may.
function withoutComments(text) {
  return text.replace(/("(?:[^"\\]|\\.)*")|\/\/[^\n]*|\/\*[^]*?\*\//g, (_, string) => string ?? " ");
}

// The values of a run's key: one, or those of a stepped sweep.
function steps(value) {
  if (typeof value === "number") return [value];
  const { from, to, steps: count, spacing } = value ?? {};
  if (!(count >= 2 && count <= MOST_RUNS)) return [];
  const parts = [...Array(Math.floor(count)).keys()].map(k => k / (count - 1));
  return parts.map(part => spacing === "logarithmic" ? from * (to / from) ** part : from + part * (to - from));
}

// { name, runs: [{ x, y }] } of the text of a campaign file. Throws an Error whose message tells what to choose.
export function planOf(text) {
  let file;
  try {
    file = JSON.parse(withoutComments(text));
  } catch {
    throw new Error("is not JSON");
  }
  if (!Array.isArray(file?.runs)) throw new Error('has no "runs"');
  const runs = file.runs.flatMap(run => steps(run?.frequency_hz).flatMap(x => steps(run?.amplitude).map(y => ({ x, y }))));
  if (!runs.length || runs.some(run => !(run.x > 0 && run.y > 0 && run.x < Infinity && run.y < Infinity)))
    throw new Error("has no run with a frequency and an amplitude above 0");
  return { name: String(file.name ?? ""), runs: runs.slice(0, MOST_RUNS) };
}

export const toAdd = (plan, done) => plan.runs.filter(run => !done.some(one =>
  Math.abs(one.frequency_hz / run.x - 1) < SAME && Math.abs(one.amplitude / run.y - 1) < SAME));

// The browser may refuse to keep anything.
const kept = {
  get text() { try { return localStorage.getItem(KEPT); } catch { return null; } },
  set text(value) { try { value === null ? localStorage.removeItem(KEPT) : localStorage.setItem(KEPT, value); } catch { /* until it is loaded again */ } },
};

export class Places {
  constructor(changed) {
    this.plane = new Plane(byId("map-plot"), { x: "frequency, Hz" });
    this.changed = changed;
    byId("plan-file").addEventListener("change", event => this.choose(event.target.files[0]));
    byId("plan-away").addEventListener("click", () => this.hide());
  }

  // The plan that this browser has kept: looking for it is slow, and the first picture does not wait for it.
  recall() {
    const before = kept.text;
    if (before !== null && !this.plan) this.take(before, "The file of before");
  }

  async choose(file) {
    if (!file) return;
    if (file.size > MOST_BYTES) return this.refuse(file.name, "is too large");
    this.take(await file.text(), file.name);
  }
  take(text, name) {
    try {
      this.plan = planOf(text);
      kept.text = text;
    } catch (trouble) {
      return this.refuse(name, trouble.message);
    }
    byId("plan-away").hidden = false;
    this.changed();
  }
  refuse(name, why) {
    this.hide();
    byId("plan-said").textContent = `${name} ${why}: choose the file that "shakerctl plan --write FILE" wrote, or another campaign file.`;
  }
  hide() {
    this.plan = undefined;
    kept.text = null;
    byId("plan-file").value = "";
    byId("plan-away").hidden = true;
    byId("plan-said").textContent = "";
    this.changed();
  }

  // The runs of the plan that have not been measured.
  addition(done) {
    if (!this.plan) return [];
    const left = toAdd(this.plan, done);
    const of = this.plan.runs.length;
    const said = `Diamonds: ${this.plan.name || "the plan"} would add ${left.length} of its ${of} ` +
      `${of === 1 ? "run" : "runs"}${left.length < of ? "; the others have been measured" : ""}.`;
    if (byId("plan-said").textContent !== said) byId("plan-said").textContent = said;
    return left.map(run => ({ ...run, colour: "good", diamond: true }));
  }

  draw(rig) {
    const plan = rig.rig?.plan, limits = rig.rig;
    const done = rig.runs.filter(run => run.accepted > 0);
    const planned = plan && plan.campaign === (rig.state?.campaign ?? plan.campaign) ? plan.runs : [];
    const now = rig.moving ? rig.state : undefined;
    const points = [
      ...planned.map(run => ({ x: run.frequency_hz, y: run.amplitude, colour: "soft", label: run.run })),
      ...done.map(run => ({ x: run.frequency_hz, y: run.amplitude, colour: "measured", filled: true })),
      ...this.addition(done),
      ...now?.amplitude > 0 ? [{ x: now.frequency_hz, y: now.amplitude, colour: "model", large: true }] : []];
    this.plane.say("amplitude of the table, m/s², over frequency, Hz. Filled: measured. Hollow: to come. Ring: now. Frame: limits.");
    this.plane.draw({ points, box: limits ? [[0, 1.05 * limits.frequency_max_hz], [0, 1.05 * limits.excitation_max_m_s2]] : undefined,
      curves: limits ? [{ colour: "limit", dash: [2, 4], closed: true,
        x: [limits.frequency_min_hz, limits.frequency_max_hz, limits.frequency_max_hz, limits.frequency_min_hz],
        y: [0, 0, limits.excitation_max_m_s2, limits.excitation_max_m_s2] }] : [] });
  }
}
