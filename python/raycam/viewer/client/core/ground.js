// The height above the ground, for walking in pages that render without a server.

/**
 * The height of a point above the highest ground within `foot` metres; null if there is no ground below.
 * @param {ArrayLike<number>} corners nine numbers for each triangle
 * @param {number[]} up one of the world's axes
 * @param {number[]} place
 * @param {number} foot
 */
export function groundBelow(corners, up, place, foot) {
  const k = up.indexOf(1);
  const [i, j] = [0, 1, 2].filter((axis) => axis !== k);
  const points = [[0, 0], [foot, 0], [-foot, 0], [0, foot], [0, -foot]].map(([x, y]) => [place[i] + x, place[j] + y]);
  let highest = -Infinity;
  for (let at = 0; at < corners.length; at += 9) {
    const [ax, ay, bx, by, cx, cy] = [corners[at + i], corners[at + j], corners[at + 3 + i], corners[at + 3 + j], corners[at + 6 + i], corners[at + 6 + j]];
    if (Math.max(ax, bx, cx) < place[i] - foot || Math.min(ax, bx, cx) > place[i] + foot) continue;
    if (Math.max(ay, by, cy) < place[j] - foot || Math.min(ay, by, cy) > place[j] + foot) continue;
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (!area) continue;
    for (const [x, y] of points) {
      const [p, q] = [((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area, ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area];
      if (p < 0 || q < 0 || p + q > 1) continue;
      const height = corners[at + k] + q * (corners[at + 3 + k] - corners[at + k]) + p * (corners[at + 6 + k] - corners[at + k]);
      if (height <= place[k]) highest = Math.max(highest, height);
    }
  }
  return Number.isFinite(highest) ? place[k] - highest : null;
}
