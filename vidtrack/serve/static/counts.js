"use strict";

/* What each camera counted: the lines of its card, and the history of the one that is enlarged. */

const COUNTS_MS = 15000;
const MOST_LINES = 3;

/* The counts of a camera that were fetched last, and asked for again and again. */
async function followCounts(camera) {
  for (;;) {
    if (!document.hidden) {
      const counts = await fetched(`counts/${camera.place}.json`);
      if (counts) {
        camera.counts = { ...counts, totals: camera.status.counts ?? {} };
        showLines(camera);
        if (chosen() === camera) {
          showCounts(camera);
          showHistory(camera);
          showEvents(camera);
        }
      }
    }
    await pause(camera.counts ? COUNTS_MS : STATUS_MS);
  }
}

async function fetched(path) {
  try {
    const answer = await fetch(HERE + path, { signal: AbortSignal.timeout(10000) });
    return answer.ok ? await answer.json() : null;
  } catch {
    return null; // the page says that there is no answer
  }
}

/* What was counted today or in the last hour, with what the status has counted since. */
function sum(camera, span, line, direction) {
  const counts = camera.counts ?? {};
  const now = camera.status.counts?.[line]?.[direction];
  const then = counts.totals?.[line]?.[direction];
  const since = now === undefined || then === undefined ? 0 : Math.max(0, now - then);
  const known = counts[span]?.[line]?.[direction];
  return known === undefined ? undefined : known + since;
}

/* Names of the lines with their directions: as counted now, or as the files have them. */
const linesOf = (camera) => Object.entries(camera.status.counts && Object.keys(camera.status.counts).length
  ? camera.status.counts : camera.counts?.today ?? {}).map(([line, ways]) => [line, Object.keys(ways).sort()]);

function showLines(camera) {
  const lines = linesOf(camera);
  const shown = lines.slice(0, lines.length > MOST_LINES ? MOST_LINES - 1 : MOST_LINES);
  const made = shown.map(([line, directions]) => {
    const part = element("div", "");
    part.className = "line";
    const title = element("p", "");
    title.className = "title";
    title.append(element("span", `${line}, today`), element("span", "last hours"));
    const ways = element("p", "");
    ways.className = "ways";
    ways.append(...directions.map((name, place) => way(name, place, sum(camera, "today", line, name))));
    part.append(title, ways);
    if (camera.counts?.today) {
      const { intervals: all, since_s: since, until_s: until } = camera.counts;
      part.append(spark(all.filter((row) => row.gate === line), directions, beginning(all, since, until), until));
    }
    return part;
  });
  if (lines.length > shown.length) {
    const more = element("p", `and ${lines.length - shown.length} more lines`);
    more.className = "more";
    made.push(more);
  }
  camera.card.querySelector(".lines").replaceChildren(...made);
}

/* The table of the enlarged camera. */
function showCounts(camera) {
  const section = one.querySelector(".counts");
  const lines = linesOf(camera);
  section.querySelector("table").hidden = lines.length === 0;
  section.querySelector(".empty").hidden = lines.length > 0;
  section.querySelector("tbody").replaceChildren(...lines.flatMap(([line, directions]) => directions.map((name, place) => {
    const made = row(place ? "" : line, "", ...["hour", "today"].map((span) => number(sum(camera, span, line, name))),
      number(camera.status.counts?.[line]?.[name]));
    const arrow = element("i", ARROWS[name] ?? "");
    made.children[1].className = `way ${WAYS[place % 2]}`;
    const word = element("span", ` ${name}`);
    word.className = "word";
    made.children[1].append(arrow, word);
    return made;
  })));
}

/* The charts of the enlarged camera: of the last 24 hours, or of the day that is chosen. */
async function showHistory(camera) {
  const section = one.querySelector(".history");
  const days = camera.counts?.days ?? [];
  section.hidden = days.length === 0;
  if (section.hidden) return;
  const day = section.querySelector(".day");
  const every = section.querySelector(".every").value;
  const options = [...days].reverse();
  if (day.dataset.of !== `${camera.place} ${options}`) {
    const before = day.value;
    day.replaceChildren(new Option("the last 24 hours", ""), ...options.map((name) => new Option(name, name)));
    day.value = options.includes(before) ? before : "";
    day.dataset.of = `${camera.place} ${options}`;
  }
  const link = section.querySelector("a");
  link.href = `counts/${camera.place}/${day.value || options[0]}.csv?every=${every}`;
  const asked = `${camera.place} ${day.value} ${every}`;
  section.dataset.asked = asked;
  const path = day.value ? `counts/${camera.place}/${day.value}.json` : `counts/${camera.place}.json`;
  const counts = every === "15min" && !day.value ? camera.counts : await fetched(`${path}?every=${every}`);
  if (!counts || section.dataset.asked !== asked) return;
  const since = day.value ? counts.since_s : beginning(counts.intervals, counts.since_s, counts.until_s);
  draw(section.querySelector(".charts"), { ...counts, since_s: since }, linesOf(camera));
}

/* The pictures of the last events of the enlarged camera, where they are kept. */
async function showEvents(camera) {
  const section = one.querySelector(".events");
  const place = `camera/${encodeURIComponent(camera.status.name)}/`;
  const paths = (await fetched(`${place}pictures.json`)) ?? [];
  if (one.camera !== camera || section.dataset.of === `${place} ${paths}`) return;
  section.dataset.of = `${place} ${paths}`;
  section.hidden = paths.length === 0;
  section.querySelector("ul").replaceChildren(...paths.map((path) => {
    const [day, time] = path.split("/").at(-1).split("T");
    const [link, picture] = [document.createElement("a"), document.createElement("img")];
    link.href = picture.src = place + path;
    link.target = "_blank";
    picture.loading = "lazy";
    picture.alt = "";
    link.append(picture, element("time", time.slice(0, 8).replaceAll("-", ":")));
    link.title = day;
    const item = document.createElement("li");
    item.append(link);
    return item;
  }));
}

function draw(charts, counts, lines) {
  const names = [...new Set([...lines.map(([line]) => line), ...counts.intervals.map((row) => row.gate)])];
  const size = [Math.max(charts.clientWidth, 240), names.length > 1 ? 170 : 260];
  charts.replaceChildren(...names.map((line) => {
    const rows = counts.intervals.filter((row) => row.gate === line);
    const ways = [...new Set(rows.map((row) => row.direction))].sort();
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const counted = (name) => rows.filter((row) => row.direction === name).reduce((all, row) => all + (row.count ?? 0), 0);
    caption.append(element("strong", line), ...ways.map((name, place) => way(name, place, counted(name))));
    const note = element("p", "");
    note.className = "note";
    figure.append(caption, chart(rows, ways, counts.since_s, counts.until_s, size, (words) => { note.textContent = words; }), note);
    return figure;
  }));
}
