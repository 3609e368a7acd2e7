// Places labels around their points so that no two labels overlap and all lie within the figure.

/** @typedef {{ x: number, y: number, width: number, height: number }} Box */
/** @typedef {{ at: number[], width: number, height: number }} LabelRequest the point, and the size of the text */

const DIRECTIONS = [[1, -1], [1, 0], [1, 1], [0, -1], [0, 1], [-1, -1], [-1, 0], [-1, 1]];
const GAPS_PX = [7, 14, 24, 38, 56, 80];

/** True if two boxes share area. @param {Box} a @param {Box} b */
export function boxesOverlap(a, b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

/** The boxes of a label around its point, the closest first. @param {LabelRequest} label @returns {Box[]} */
function candidateBoxes({ at: [x, y], width, height }) {
  return GAPS_PX.flatMap((gap) =>
    DIRECTIONS.map(([dx, dy]) => ({
      x: x + dx * gap + (dx < 0 ? -width : dx === 0 ? -width / 2 : 0),
      y: y + dy * gap * 0.8 + (dy < 0 ? -height : dy === 0 ? -height / 2 : 0),
      width, height,
    })),
  );
}

/**
 * The box of each label; null for a label without free space. Earlier labels have priority; labels avoid all points.
 * @param {LabelRequest[]} labels
 * @param {number} width of the figure
 * @param {number} height
 * @param {number[][]} [marks] points that labels do not cover if there is other space
 * @returns {(Box | null)[]}
 */
export function placeLabels(labels, width, height, marks = []) {
  /** @type {Box[]} */
  const placed = [];
  const points = [...labels.map(({ at }) => at), ...marks].map(([x, y]) => ({ x: x - 4, y: y - 4, width: 8, height: 8 }));
  return labels.map((label) => {
    const inside = candidateBoxes(label).filter((box) => box.x >= 0 && box.y >= 0 && box.x + box.width <= width && box.y + box.height <= height);
    const free = inside.filter((box) => !placed.some((other) => boxesOverlap(box, other)));
    const found = free.find((box) => !points.some((point) => boxesOverlap(box, point))) || free[0] || null;
    if (found) placed.push(found);
    return found;
  });
}
