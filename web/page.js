// Puts the page together: documents in, pictures out. Draws at most once a frame, and only the
// parts whose documents have come.
import { Convergence, Files, Gate, drawHealth } from "./findings.js";
import { Places } from "./map.js";
import { drawAlarms, drawMotion, drawState } from "./overview.js";
import { Cycle, Scope } from "./pictures.js";
import { Rig } from "./rig.js";
import { Stream } from "./stream.js";
import { byId } from "./words.js";

const rig = new Rig();
const scope = new Scope(), cycle = new Cycle(), convergence = new Convergence(), gate = new Gate();
const files = new Files();
const parts = {
  state: () => drawState(rig), alarms: () => drawAlarms(rig), motion: () => drawMotion(rig), scope: () => scope.draw(rig),
  cycle: () => cycle.draw(rig), convergence: () => convergence.draw(rig), gate: () => gate.draw(rig),
  map: () => places.draw(rig), health: () => drawHealth(rig), files: () => files.draw(rig),
};
const shownBy = {
  version: ["state"], rig: ["state", "motion", "scope", "gate", "map"], state: ["state", "alarms", "motion", "gate", "map"],
  health: ["health"], run_start: ["motion", "map"], run_stop: ["motion", "map"], cycle: ["motion", "gate", "map"],
  estimate: ["convergence"], alarm: ["alarms", "state"], wave: ["cycle", "motion"], scope: ["scope", "motion"],
  diagnosis_progress: ["files"], diagnosis_result: ["files"],
};

const ofSeveral = /\/rig\/[^/]+\/[^/]*$/.test(location.pathname);
byId("all-rigs").hidden = !ofSeveral;

const CLOSING_MS = 5000;  // by then a campaign's file is closed
const due = new Set();
let opening = true, asked = false;

function draw() {
  asked = false;
  for (const part of due) parts[part]();
  due.clear();
  if (!window.firstPicture) {
    window.firstPicture = performance.now();
    setTimeout(() => places.recall());
  }
  document.body.dataset.frames = String(1 + Number(document.body.dataset.frames ?? 0));
}
function ask(names) {
  names.forEach(name => due.add(name));
  if (opening || asked) return;
  asked = true;
  requestAnimationFrame(draw);
}
const places = new Places(() => ask(["map"]));
const lookForFiles = () => files.fetch().then(() => ask(["files"]));
const everything = () => ask(Object.keys(parts));

new Stream({
  document(document) {
    const campaigns = rig.runs.length, was = rig.state?.state;
    rig.take(document);
    ask(shownBy[document.type] ?? []);
    const begins = document.type === "state" && document.state === "CHECK" && !["CHECK", "PAUSE"].includes(was);
    if (begins || campaigns > rig.runs.length) everything();
    const ended = document.type === "state" && was !== undefined && was !== document.state;
    if (!opening && (document.type === "diagnosis_result" || ended && ["IDLE", "FAULT"].includes(document.state)))
      [0, CLOSING_MS].forEach(wait => setTimeout(lookForFiles, wait));
  },
  reset() {
    rig.forget();
    opening = true;
    due.clear();
  },
  ready() {
    opening = false;
    everything();
    lookForFiles();
  },
  // Several rigs, and the root has the list of them. A page below rig/NAME/ stays.
  rigs() {
    if (!ofSeveral) location.reload();
  },
  live(why) {
    byId("lost").hidden = why === "";
    byId("lost-why").textContent = why;
  },
});
