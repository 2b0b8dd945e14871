// The list of several rigs: one card for each, which leads to its page.
import { KINDS, SIGNS } from "./overview.js";
import { Stream } from "./stream.js";
import { byId, element } from "./words.js";

const cards = new Map();  // by name: a link stays the same while somebody clicks it

function cardOf(name) {
  if (!cards.has(name)) {
    const link = element("a", { href: `rig/${encodeURIComponent(name)}/` }, name);
    const card = element("section", { class: "state card" }, element("h2", {}, link), element("div", { class: "state-name" }),
      element("p", { class: "reason" }), element("p", { class: "doing" }), element("p", { class: "alarms" }));
    card.dataset.rig = name;
    cards.set(name, card);
  }
  return cards.get(name);
}

function counted(count, word) {
  return count > 0 ? `${count} ${word}${count > 1 ? "s" : ""}` : "";
}

function fill(card, rig) {
  const say = (part, text) => { card.querySelector(part).textContent = text; };
  const live = rig.connected;
  card.dataset.kind = live ? KINDS[rig.state] ?? "rest" : "away";
  say(".state-name", live ? `${SIGNS[rig.state] ?? ""} ${rig.state ?? "–"}` : "✖ NOT LIVE");
  say(".reason", live ? rig.reason ?? "" : rig.why);
  const share = rig.progress === undefined ? "" : `, ${Math.round(100 * rig.progress)} %`;
  say(".doing", live && rig.campaign ? `${rig.campaign}${rig.run ? `: ${rig.run}` : ""}${share}` : "");
  const alarms = [rig.unprotected ? "UNPROTECTED" : "", counted(rig.errors, "error"), counted(rig.warnings, "warning")]
    .filter(text => text);
  say(".alarms", live && alarms.length ? `⚠ ${alarms.join(", ")}` : "");
}

function draw({ rigs }) {
  if (rigs.length === 1) return location.reload();  // its page is here now
  byId("rigs-none").hidden = rigs.length > 0;
  byId("rigs-count").textContent = rigs.length ? String(rigs.length) : "";
  const shown = rigs.map(rig => cardOf(rig.name));
  rigs.forEach((rig, i) => fill(shown[i], rig));
  if (byId("rigs").childElementCount !== shown.length) byId("rigs").replaceChildren(...shown);
  const bad = rigs.filter(rig => !rig.connected || rig.errors > 0 || rig.state === "FAULT").length;
  document.title = `${bad ? `⚠ ${bad} of ` : ""}${rigs.length} rigs – shakerd`;
}

new Stream({
  rigs: draw,
  live(why) {
    byId("lost").hidden = why === "";
    byId("lost-why").textContent = why;
  },
});
