// Numbers and elements as people read them.

export const byId = id => document.getElementById(id);

// An element with text and children; never HTML from outside.
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

// `digits` significant digits without an exponent where that is readable.
export function figure(value, digits = 4) {
  if (value === undefined || value === null || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

// A value rounded by its standard error: "16.72 ± 0.05".
export function measured(value, error) {
  if (!(error > 0)) return figure(value);
  const places = Math.max(0, Math.min(12, 1 - Math.floor(Math.log10(error))));
  return `${value.toFixed(places)} ± ${error.toFixed(places)}`;
}

// "m/s^2" as "m/s²"; nothing for a ratio.
export function unitText(unit) {
  return !unit || unit === "-" ? "" : unit.replace(/\^2/g, "²").replace(/\^3/g, "³");
}

export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  const minutes = Math.floor(whole / 60);
  if (minutes >= 60) return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  return minutes ? `${minutes} min ${whole % 60} s` : `${whole} s`;
}

export function bytes(count) {
  if (!(count >= 0)) return "–";
  const units = ["B", "kB", "MB", "GB", "TB"];
  let power = 0;
  while (count >= 1000 && power < units.length - 1) { count /= 1000; ++power; }
  return `${count >= 100 || power === 0 ? Math.round(count) : count.toFixed(1)} ${units[power]}`;
}

// "2026-11-27 02:42:53", on the clock of the browser's PC.
export function dayAndTime(utc) {
  const t = new Date(utc), two = number => String(number).padStart(2, "0");
  if (Number.isNaN(t.getTime())) return "";
  return `${t.getFullYear()}-${two(t.getMonth() + 1)}-${two(t.getDate())} ${two(t.getHours())}:${two(t.getMinutes())}:${two(t.getSeconds())}`;
}

// The time of day where that is today, and the day with it where it is not.
export function clockTime(utc, now = Date.now()) {
  const [day, time] = dayAndTime(utc).split(" ");
  return dayAndTime(now).startsWith(day) ? time ?? "" : `${day} ${time}`;
}

// Name and value pairs of a <dl>, without the empty ones.
export function facts(list, pairs) {
  list.replaceChildren(...pairs.filter(([, value]) => value !== undefined && value !== "").map(
    ([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, String(value)))));
}

// Rows of a table; the first one is the head. A cell that is a node stays one.
export function table(place, rows, words = []) {
  place.replaceChildren(...rows.map((cells, row) => element("tr", {}, ...cells.map((cell, column) => element(
    row === 0 || column === 0 ? "th" : "td", words.includes(column) ? { class: "word" } : {}, cell)))));
}
