"use strict";

/* The chart of the last day and the download of any day, for each camera that counts. */

const COUNTS_MS = 30000;
const WIDE = 960;
const HIGH = 120;

const clock = (unix) => new Date(1000 * unix).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });

function shape(name, attributes, title) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (title) made.append(shape("title", {}));
  if (title) made.firstChild.textContent = title;
  return made;
}

/* One gate: what its two directions counted stands on each other; grey is what was not watched. */
function chart(gate, rows, since, until) {
  const ways = [...new Set(rows.map((row) => row.direction))];
  const intervals = grouped(rows);
  const sums = [...intervals.values()].map((group) => group.reduce((sum, row) => sum + (row.count ?? 0), 0));
  const most = Math.max(1, ...sums);
  const across = (unix) => (WIDE * (Math.max(unix, since) - since)) / (until - since);
  const drawing = shape("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", role: "img" });
  drawing.append(shape("rect", { class: "unwatched", x: 0, y: 0, width: WIDE, height: HIGH }, "not watched"));
  for (const [begin, group] of intervals) {
    const x = across(begin);
    const width = Math.max(across(group[0].end_s) - x - 1, 0.5);
    const covered = Math.min(group[0].coverage ?? 0, 1);
    const told = group.map((row) => {
      const speed = row.time_mean_speed_kmh ? `, ${row.time_mean_speed_kmh.toFixed(0)} km/h` : "";
      return `${row.direction} ${row.count ?? "–"}${speed}`;
    });
    const title = `${clock(begin)} to ${clock(group[0].end_s)}: ${told.join("; ")}; watched ${Math.round(100 * covered)} %`;
    drawing.append(shape("rect", { class: "watched", x, y: 0, width: width + 1, height: HIGH, opacity: covered }, title));
    let y = HIGH;
    for (const row of group) {
      const height = (HIGH * (row.count ?? 0)) / most;
      y -= height;
      drawing.append(shape("rect", { class: `way${ways.indexOf(row.direction) % 2}`, x, y, width, height }, title));
    }
  }
  const made = document.createElement("figure");
  const caption = document.createElement("figcaption");
  const name = document.createElement("strong");
  name.textContent = gate;
  caption.append(name);
  ways.forEach((way, number) => {
    const counted = rows.filter((row) => row.direction === way).reduce((sum, row) => sum + (row.count ?? 0), 0);
    const part = document.createElement("span");
    part.className = `way${number % 2}`;
    part.textContent = `${way} ${counted}`;
    caption.append(part);
  });
  const peak = document.createElement("span");
  peak.textContent = `most in an interval ${Math.max(0, ...sums)}`;
  caption.append(peak);
  const hours = document.createElement("div");
  hours.className = "hours";
  for (let part = 0; part <= 4; part += 1) {
    const label = document.createElement("span");
    label.textContent = clock(since + (part * (until - since)) / 4);
    hours.append(label);
  }
  made.append(caption, drawing, hours);
  return made;
}

function grouped(rows) {
  const groups = new Map();
  for (const row of rows) groups.set(row.begin_s, [...(groups.get(row.begin_s) ?? []), row]);
  return groups;
}

function offerDays(section, place, days) {
  const choice = section.querySelector(".day");
  if (choice.options.length !== days.length) {
    choice.replaceChildren(...[...days].reverse().map((day) => new Option(day, day)));
  }
  const link = section.querySelector("a");
  const point = () => {
    const every = section.querySelector(".every").value;
    link.href = `counts/${place}/${choice.value}.csv?every=${every}`;
  };
  choice.onchange = section.querySelector(".every").onchange = point;
  point();
}

async function followCounts(card, place) {
  const section = card.querySelector(".history");
  for (;;) {
    try {
      const answer = await fetch(`${HERE}counts/${place}.json`, { signal: AbortSignal.timeout(10000) });
      if (answer.ok) {
        const counts = await answer.json();
        const gates = [...new Set(counts.intervals.map((row) => row.gate))];
        const until = counts.since_s + 86400;
        section.querySelector(".charts").replaceChildren(...gates.map((gate) =>
          chart(gate, counts.intervals.filter((row) => row.gate === gate), counts.since_s, until)));
        section.hidden = counts.days.length === 0;
        offerDays(section, place, counts.days);
      }
    } catch {
      /* the page says that there is no answer */
    }
    await pause(COUNTS_MS);
  }
}
