/* What the page asks of vidtrack. */

const HERE = location.origin + location.pathname;
const TOKEN = location.hash.slice(1);

export class Refusal extends Error {
  constructor(status, words) {
    super(words);
    this.status = status;
  }
}

async function ask(path, body) {
  const headers = { "X-Vidtrack-Token": TOKEN };
  const post = body === undefined ? { headers } : { headers, method: "POST", body: JSON.stringify(body), keepalive: path === "here" };
  let answer;
  try {
    answer = await fetch(HERE + path, post);
  } catch {
    throw new Refusal(0, "vidtrack does not answer; is it still running?");
  }
  if (!answer.ok) throw new Refusal(answer.status, (await answer.text()).trim());
  return answer;
}

export const drawing = async () => (await ask("drawing")).json();
export const look = async (tree, count) => (await ask("look", { tree, count })).json();
export const save = async (tree, digest, world) => (await ask("save", { tree, digest, world })).json();
export const here = async (editor, open) => (await ask("here", { editor, open })).json();
export const picture = async (path) => createImageBitmap(await (await ask(path)).blob());

/* The paths as [Float32Array x0 y0 x1 y1 ..., ...]. */
export async function paths(tree) {
  const bytes = await (await ask("paths", { tree })).arrayBuffer();
  const count = new Uint32Array(bytes, 0, 1)[0];
  const lengths = new Uint32Array(bytes, 4, count);
  const found = [];
  let at = 4 + 4 * count;
  for (const length of lengths) {
    found.push(new Float32Array(bytes, at, 2 * length));
    at += 8 * length;
  }
  return found;
}
