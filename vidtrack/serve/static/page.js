"use strict";

const STATUS_MS = 1000;
const PICTURE_MS = 200;
const HERE = location.origin + location.pathname; // without the password that the address may hold: fetch refuses it
const cards = [];
let shownNames;
const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) entry.target.inSight = entry.isIntersecting;
});

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const number = (value, digits = 0, unit = "") => (value === undefined || value === null ? "–" : value.toFixed(digits) + unit);

function span(seconds) {
  if (seconds < 120) return `${Math.round(seconds)} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

function element(tag, text) {
  const made = document.createElement(tag);
  made.textContent = text;
  return made;
}

function row(...texts) {
  const made = document.createElement("tr");
  made.append(...texts.map((text) => element("td", text)));
  return made;
}

function numbers(camera) {
  const reading = camera.reading ?? {};
  const latency = reading.latency_ms ?? {};
  const lost = Object.entries(reading.lost ?? {}).filter(([, count]) => count > 0);
  const age = camera.frame_age_s;
  return [
    ["tracks now", number(camera.tracks?.length)],
    ["frames/s in", number(reading.fps_in, 1)],
    ["frames/s tracked", number(camera.fps_out, 1)],
    ["last frame", age === undefined || age === null ? "–" : `${span(age)} ago`, !camera.up],
    ["latency p50", number(latency.p50, 0, " ms")],
    ["latency p95", number(latency.p95, 0, " ms")],
    ["latency p99", number(latency.p99, 0, " ms")],
    ["frames tracked", number(reading.frames_read)],
    ["dropped", number(reading.frames_dropped)],
    ["decode errors", number(reading.decode_errors), reading.decode_errors > 0],
    ["stalls", number(reading.stalls), reading.stalls > 0],
    ["reconnects", number(reading.reconnects), reading.reconnects > 0],
    ...(camera.restarts ? [["process restarts", number(camera.restarts), true]] : []),
    ["not written", lost.map(([output, count]) => `${output} ${count}`).join(", ") || "0", lost.length > 0],
    ["runs for", camera.now_unix_s ? span(camera.now_unix_s - camera.started_unix_s) : "–"],
  ].map(([name, value, bad]) => {
    const pair = document.createElement("div");
    pair.append(element("dt", name), element("dd", value));
    pair.lastChild.classList.toggle("bad", Boolean(bad));
    return pair;
  });
}

function problem([unix, text]) {
  const item = document.createElement("li");
  item.append(element("time", new Date(1000 * unix).toLocaleString()), ` ${text}`);
  return item;
}

function fill(card, section, rows) {
  const place = card.querySelector(section);
  place.hidden = rows.length === 0;
  place.querySelector("tbody, ul").replaceChildren(...rows);
}

function show(card, camera) {
  card.classList.toggle("up", camera.up);
  card.querySelector(".name").textContent = camera.name;
  const failing = Object.keys(camera.failing ?? {});
  const trouble = failing.length ? `not written: ${failing.join(", ")}` : "no frames";
  card.querySelector(".state").textContent = camera.up || camera.state !== "running" ? camera.state : trouble;
  card.querySelector(".source").textContent = camera.source === camera.name ? "" : camera.source;
  card.querySelector(".numbers").replaceChildren(...numbers(camera));
  const counts = Object.entries(camera.counts ?? {}).flatMap(([line, ways]) =>
    Object.entries(ways).map(([way, count]) => row(line, way, count)));
  fill(card, ".counts", counts);
  fill(card, ".tracks", (camera.tracks ?? []).map((track) => row(track.track_id, track.status,
    number(track.x_px), number(track.y_px), number(Math.hypot(track.vx_px_s, track.vy_px_s)))));
  fill(card, ".problems", camera.problems.map(problem).reverse());
}

function addCard() {
  const card = document.getElementById("camera").content.firstElementChild.cloneNode(true);
  document.querySelector("main").append(card);
  seen.observe(card);
  const place = cards.push(card) - 1;
  watch(card.querySelector(".picture img"), card, place);
  followCounts(card, place);
  return card;
}

/* The next picture is asked for when the last one is here: a slow line sees fewer. */
async function watch(picture, card, place) {
  for (;;) {
    if (card.inSight && !document.hidden) {
      await new Promise((done) => {
        picture.onload = picture.onerror = (event) => {
          picture.classList.toggle("missing", event.type === "error");
          done();
        };
        picture.src = `picture/${place}.jpg?${Date.now()}`;
      });
    }
    await pause(PICTURE_MS);
  }
}

async function look() {
  const summary = document.getElementById("summary");
  try {
    const answer = await fetch(`${HERE}status`, { signal: AbortSignal.timeout(10000) });
    if (!answer.ok) throw new Error(answer.statusText);
    const cameras = await answer.json();
    const names = JSON.stringify(cameras.map((camera) => camera.name));
    if (shownNames !== undefined && names !== shownNames) location.reload(); // cameras were added or removed
    shownNames = names;
    cameras.forEach((camera, place) => show(cards[place] ?? addCard(), camera));
    const up = cameras.filter((camera) => camera.up).length;
    summary.textContent = up === cameras.length ? "all cameras deliver" : `${up} of ${cameras.length} cameras deliver`;
    summary.classList.toggle("bad", up < cameras.length);
    document.title = up === cameras.length ? "vidtrack" : `vidtrack (${cameras.length - up} down)`;
  } catch {
    summary.textContent = `no answer from vidtrack at ${new Date().toLocaleTimeString()}`;
    summary.classList.add("bad");
    document.title = "vidtrack (no answer)";
    cards.forEach((card) => card.classList.remove("up"));
  }
}

(async () => {
  for (;;) {
    await look();
    await pause(STATUS_MS);
  }
})();
