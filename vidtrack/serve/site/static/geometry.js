/* Points [x, y], lines of points, and the two maps between a plan and metres. */

export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
export const rounded = (point, digits = 1) => point.map((value) => Number(value.toFixed(digits)) + 0);
export const between = (a, b, share = 0.5) => [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];

/* The nearest point of a segment. */
export function nearest(point, a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const square = dx * dx + dy * dy;
  const share = square ? ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / square : 0;
  return between(a, b, Math.min(Math.max(share, 0), 1));
}

/* The point halfway along a line. */
export function middle(line) {
  const lengths = line.slice(1).map((point, k) => distance(line[k], point));
  let rest = lengths.reduce((sum, length) => sum + length, 0) / 2;
  let k = 0;
  while (k < lengths.length - 1 && rest > lengths[k]) rest -= lengths[k++];
  return between(line[k], line[k + 1], rest / (lengths[k] || 1));
}

/* `to` moved so that the way from `from` is level, upright or at 45 degrees. */
export function squared(from, to) {
  const step = Math.PI / 4;
  const angle = Math.round(Math.atan2(to[1] - from[1], to[0] - from[0]) / step) * step;
  const length = (to[0] - from[0]) * Math.cos(angle) + (to[1] - from[1]) * Math.sin(angle);
  return [from[0] + length * Math.cos(angle), from[1] + length * Math.sin(angle)];
}

/* The corners and lines that a new point snaps to. */
export function snapped(point, lines, [width, height], reach) {
  let best = null;
  const take = (at, off, kind) => {
    if (off <= reach && (!best || off < best.off)) best = { at, off, kind };
  };
  for (const { points } of lines) for (const at of points) take(at, distance(point, at), "corner");
  if (best) return best;
  for (const { points, closed } of lines) {
    const ends = closed ? [...points.slice(1), points[0]] : points.slice(1);
    ends.forEach((b, k) => {
      const at = nearest(point, points[k], b);
      take(at, distance(point, at), "line");
    });
  }
  if (best) return best;
  const border = [
    Math.abs(point[0]) <= reach ? 0 : Math.abs(point[0] - width + 1) <= reach ? width - 1 : point[0],
    Math.abs(point[1]) <= reach ? 0 : Math.abs(point[1] - height + 1) <= reach ? height - 1 : point[1],
  ];
  return border[0] !== point[0] || border[1] !== point[1] ? { at: border, off: 0, kind: "border" } : null;
}

/* A world file is A D B E C F: x = A column + B row + C, y = D column + E row + F. */
export const metresOfPlan = ([A, D, B, E, C, F], [x, y]) => [A * x + B * y + C, D * x + E * y + F];
export function planOfMetres([A, D, B, E, C, F], [x, y]) {
  const det = A * E - B * D;
  return [(E * (x - C) - B * (y - F)) / det, (A * (y - F) - D * (x - C)) / det];
}

/* Metres of a picture point by a 3 x 3 matrix; null above the horizon. */
export function metresOf(matrix, [x, y]) {
  if (!matrix) return null;
  const [a, b, w] = matrix.map((row) => row[0] * x + row[1] * y + row[2]);
  return w > 0 ? [a / w, b / w] : null;
}
