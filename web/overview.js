// Parts one to three: state, alarms, motion.
import { derivative } from "./rig.js";
import { byId, clockTime, duration, element, facts, figure, table } from "./words.js";

export const SIGNS = { IDLE: "■", CHECK: "◌", RAMP: "▲", SETTLE: "≈", MEASURE: "●", RAMP_DOWN: "▼", PAUSE: "‖", FAULT: "✖" };
export const KINDS = { RAMP: "moves", SETTLE: "moves", RAMP_DOWN: "moves", MEASURE: "good", FAULT: "fault" };
const NEAR = 0.05;  // of the room within the limits

// "left main gear, serial N-042, charge 18 bar, oil MIL-PRF-5606, 21 degC"; nothing of what is not stated.
export function specimenText(specimen = {}) {
  const named = (name, value) => value && `${name} ${value}`;
  const { name, serial, charge, oil, temperature } = specimen;
  return [name, named("serial", serial), named("charge", charge), named("oil", oil), temperature].filter(Boolean).join(", ");
}

export function drawState(rig) {
  const state = rig.state;
  byId("state").dataset.kind = KINDS[state?.state] ?? "rest";
  byId("state-name").textContent = state ? `${SIGNS[state.state] ?? ""} ${state.state}` : "–";
  byId("state-reason").textContent = state?.reason ?? "";
  const alarmed = rig.alarms.some(alarm => alarm.severity === "error") ? "⚠ " : "";
  document.title = `${alarmed}${state?.state ?? "?"} – ${rig.rig?.rig ?? rig.version?.rig ?? "shakerd"}`;
  const control = rig.rig ? rig.rig.in_control ?? "nobody" : undefined;
  facts(byId("identity"), [
    ["rig", rig.rig?.rig ?? rig.version?.rig],
    ["campaign", state?.campaign],
    ["specimen", specimenText(rig.specimen)],
    ["notes", rig.specimen?.notes],
    ["in control", control],
    ["shakerd", rig.version?.version],
    ["protection", state?.unprotected ? "UNPROTECTED: no detector ends the motion" : undefined],
  ]);
}

export function drawAlarms(rig) {
  const shown = [...rig.alarms].reverse().sort((a, b) => (b.severity === "error") - (a.severity === "error"));
  byId("alarm-list").replaceChildren(...shown.map(alarm => element("li", { class: alarm.severity },
    element("span", { class: "tag" }, alarm.severity),
    element("time", { datetime: alarm.t_utc }, clockTime(alarm.t_utc)),
    ` ${alarm.code}: ${alarm.text}${alarm.times > 1 ? ` (${alarm.times} times)` : ""}`)));
  byId("alarm-remedy").textContent = shown.length ? "they stay until somebody acknowledges them: shakerctl ack" : "";
  if (!shown.length) byId("alarm-list").append(element("li", { class: "none" }, "none"));
}

function drawProgress(rig) {
  const state = rig.state, run = rig.run;
  byId("progress").hidden = !state?.campaign || !rig.moving;
  if (byId("progress").hidden) return;
  byId("progress-bar").style.width = `${100 * (state.progress ?? 0)}%`;
  const where = state.run_count ? `run ${state.run_index + 1} of ${state.run_count}` : "";
  const cycles = run && run.run === state.run ? `, cycle ${run.accepted} of ${run.cycles_wanted}, ${run.rejected} left out` : "";
  byId("progress-text").textContent =
    `${where}${cycles} · ${Math.round(100 * (state.progress ?? 0))} % · ${duration(state.eta_s)} left`;
}

function drawSetpoint(rig) {
  const state = rig.state, cycle = rig.moving ? rig.cycle : undefined;
  const part = (value, of) => of > 0 && value > 0 ? ` (${figure(100 * value / of, 4)} %)` : "";
  table(byId("setpoint"), [
    ["", "setpoint", "measured"],
    ["frequency, Hz", figure(state?.frequency_hz, 5), figure(cycle?.frequency_hz, 6)],
    ["table, m/s²", figure(state?.amplitude), figure(cycle?.amplitude || undefined) + part(cycle?.amplitude, state?.amplitude)],
  ]);
}

// What the measured [low, high] leaves of the room within the limits: a share, and in words.
function leftOfRange([least, most], seen, unit, factor) {
  const left = Math.min(seen[0] - least, most - seen[1]);
  return [left / (most - least), `${figure(factor * left, 3)} ${unit}, `];
}
// The same where zero is in the middle: at rest, all of it is left.
function leftOfSwing([least, most], seen) {
  return [1 - Math.max(seen[0] / least, seen[1] / most), ""];
}

// One bar: what was measured, [low, high], between the limits.
function bar(name, unit, limits, seen, leftOf, factor = 1) {
  const row = element("div", { class: "limit" }, element("span", {}, `${name}, ${unit}`));
  const track = element("div", { class: "track" }), span = element("span");
  row.append(track);
  const [least, most] = limits;
  const text = element("span", { class: "text" });
  row.append(text);
  if (!seen || !(most > least)) {
    text.textContent = `– within ${figure(factor * least)} … ${figure(factor * most)}`;
    return row;
  }
  const place = value => Math.max(0, Math.min(100, 100 * (value - least) / (most - least)));
  span.style.left = `${place(seen[0])}%`;
  span.style.width = `${place(seen[1]) - place(seen[0])}%`;
  track.append(span);
  const [left, words] = leftOf(limits, seen, unit, factor);
  if (left < NEAR) row.classList.add("near");
  text.textContent = `${figure(factor * seen[0], 3)} … ${figure(factor * seen[1], 3)} of ${figure(factor * least, 3)} … ` +
    `${figure(factor * most, 3)}; ${left < NEAR ? "ONLY " : ""}${words}${Math.round(100 * left)} % left`;
  return row;
}

function extremes(values) {
  return values?.length ? [Math.min(...values), Math.max(...values)] : undefined;
}

export function drawMotion(rig) {
  drawProgress(rig);
  drawSetpoint(rig);
  const limits = rig.rig;
  if (!limits) return byId("limit-bars").replaceChildren();
  const rate = rig.moving && rig.wave ? extremes(derivative(rig.wave.stroke_m, rig.wave.frequency_hz)) : undefined;
  const most = limits.excitation_max_m_s2, fastest = limits.stroke_rate_max_m_s;
  byId("limit-bars").replaceChildren(
    bar("stroke", "mm", [limits.stroke_min_m, limits.stroke_max_m], rig.lastSecond("displacement"), leftOfRange, 1000),
    bar("rate", "m/s", [-fastest, fastest], rate, leftOfSwing),
    bar("table", "m/s²", [-most, most], rig.lastSecond("excitation"), leftOfSwing));
}
