"use strict";

/* The wall of all cameras, and the one that is enlarged: #NAME in the address. */

const STATUS_MS = 1000;
const PICTURE_MS = 200;
const FEW = 4; // more cameras are shown closer together, and their pictures are asked for less often
const HERE = location.origin + location.pathname; // without the password that the address may hold: fetch refuses it
const cameras = [];
const wall = document.getElementById("wall");
const one = document.getElementById("one");
let shownNames;
const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) entry.target.inSight = entry.isIntersecting;
});

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const number = (value, digits = 0, unit = "") =>
  (value === undefined || value === null ? "–" : value.toLocaleString(undefined, { minimumFractionDigits: digits, maximumFractionDigits: digits }) + unit);
const named = () => decodeURIComponent(location.hash.slice(1));
const chosen = () => (cameras.length === 1 ? cameras[0] : cameras.find((camera) => camera.status.name === named()));

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

/* Why a camera does not deliver, in a word and in a sentence. */
function trouble(camera) {
  if (camera.up) return ["running", ""];
  const failing = Object.entries(camera.failing ?? {});
  const last = camera.problems.at(-1);
  const age = camera.frame_age_s;
  const since = age > 2 ? `no picture for ${span(age)}` : "";
  if (camera.state !== "running") return [camera.state, [since, last?.[1]].filter(Boolean).join(": ")];
  if (failing.length) return [`not written: ${failing.map(([output]) => output).join(", ")}`, failing.map(([, why]) => why).join("; ")];
  return ["no frames", since];
}

function showState(place, camera) {
  place.classList.toggle("up", camera.up);
  place.querySelector(".name").textContent = camera.name;
  place.querySelector(".state").textContent = trouble(camera)[0];
}

function showCard(camera) {
  const { card, status } = camera;
  showState(card, status);
  card.querySelector(".why").textContent = trouble(status)[1];
  card.querySelector(".picture").href = `#${encodeURIComponent(status.name)}`;
  card.querySelector(".picture").title = `enlarge ${status.name}`;
  showLines(camera);
}

function showOne(camera) {
  const { status } = camera;
  showState(one, status);
  one.querySelector(".source").textContent = status.source === status.name ? "" : status.source;
  one.querySelector(".back").hidden = cameras.length === 1;
  showCounts(camera);
  one.querySelector(".numbers").replaceChildren(...numbers(status));
  const tracks = (status.tracks ?? []).map((track) => row(track.track_id, track.status,
    number(track.x_px), number(track.y_px), number(Math.hypot(track.vx_px_s, track.vy_px_s))));
  one.querySelector(".tracks").hidden = tracks.length === 0;
  one.querySelector(".tracks tbody").replaceChildren(...tracks);
  const problems = [...status.problems].reverse().map(([unix, text]) => {
    const item = document.createElement("li");
    item.append(element("time", `${new Date(1000 * unix).toLocaleDateString()} ${clock(unix)}`), text);
    return item;
  });
  one.querySelector(".problems").hidden = problems.length === 0;
  one.querySelector(".problems ul").replaceChildren(...problems);
}

/* All cameras, or the one of the address. */
function route() {
  const camera = chosen();
  one.hidden = !camera;
  wall.hidden = Boolean(camera);
  if (!camera || one.camera === camera) return;
  one.camera = camera;
  one.querySelector(".picture img").removeAttribute("src");
  one.querySelector(".charts").replaceChildren();
  showOne(camera);
  showHistory(camera);
  showEvents(camera);
  scrollTo(0, 0);
}

function addCamera(status) {
  const card = document.getElementById("camera").content.firstElementChild.cloneNode(true);
  const camera = { card, status, place: cameras.length, counts: null };
  wall.append(card);
  seen.observe(card);
  cameras.push(camera);
  watch(card.querySelector("img"), () => (card.inSight && !wall.hidden ? camera : null), () => (cameras.length > FEW ? 5 : 1) * PICTURE_MS);
  followCounts(camera);
  return camera;
}

/* The next picture is asked for when the last one is here: a slow line sees fewer. */
async function watch(picture, of, every) {
  for (;;) {
    const camera = document.hidden ? null : of();
    if (camera) {
      await new Promise((done) => {
        picture.onload = picture.onerror = (event) => {
          picture.classList.toggle("missing", event.type === "error");
          done();
        };
        picture.src = `picture/${camera.place}.jpg?${Date.now()}`;
      });
    }
    await pause(every());
  }
}

/* The cameras that are down; a link that is there stays, so that a click begins and ends on it. */
function alarms(down) {
  const list = document.getElementById("alerts");
  while (list.children.length > down.length) list.lastChild.remove();
  down.forEach((camera, place) => {
    const [word, why] = trouble(camera.status);
    if (place === list.children.length) list.append(document.createElement("li"));
    const item = list.children[place];
    const link = item.firstChild ?? document.createElement("a");
    link.href = `#${encodeURIComponent(camera.status.name)}`;
    link.replaceChildren(element("b", camera.status.name), ` ${word}${why ? `: ${why}` : ""}`);
    if (!item.firstChild) item.append(link);
  });
}

function showAll(statuses) {
  statuses.forEach((status, place) => {
    const camera = cameras[place] ?? addCamera(status);
    camera.status = status;
    showCard(camera);
  });
  const down = cameras.filter((camera) => !camera.status.up);
  const count = cameras.length;
  const summary = document.getElementById("summary");
  const all = count === 1 ? "the camera delivers" : `all ${count} cameras deliver`;
  summary.textContent = down.length ? `${count - down.length} of ${count} cameras deliver` : all;
  summary.classList.toggle("bad", down.length > 0);
  document.title = down.length ? `vidtrack (${down.length} down)` : "vidtrack";
  alarms(down);
  wall.classList.toggle("dense", count > FEW);
  wall.style.setProperty("--columns", Math.min(5, Math.ceil(Math.sqrt(count))));
  wall.style.setProperty("--head", `${document.querySelector("header").offsetHeight}px`);
  route();
  if (one.camera && !one.hidden) showOne(one.camera);
}

async function look() {
  const statuses = await fetched("status");
  const [day, time] = document.getElementById("clock").children;
  day.textContent = new Date().toLocaleDateString([], { weekday: "long", day: "numeric", month: "long" });
  time.textContent = clock(Date.now() / 1000);
  if (statuses) {
    const names = JSON.stringify(statuses.map((status) => status.name));
    if (shownNames !== undefined && names !== shownNames) location.reload(); // cameras were added or removed
    shownNames = names;
    showAll(statuses);
    return;
  }
  const summary = document.getElementById("summary");
  summary.textContent = `no answer from vidtrack at ${clock(Date.now() / 1000)}`;
  summary.classList.add("bad");
  document.title = "vidtrack (no answer)";
  for (const place of [one, ...cameras.map((camera) => camera.card)]) place.classList.remove("up");
}

addEventListener("hashchange", route);
addEventListener("resize", () => one.camera && !one.hidden && showHistory(one.camera));
addEventListener("keydown", (event) => {
  if (event.key === "Escape" && cameras.length > 1) location.hash = "";
});
for (const choice of one.querySelectorAll("select")) choice.onchange = () => showHistory(one.camera);
watch(one.querySelector(".picture img"), () => (one.hidden ? null : one.camera), () => PICTURE_MS);

(async () => {
  for (;;) {
    await look();
    await pause(STATUS_MS);
  }
})();
