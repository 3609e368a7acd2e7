// Points over the image, such as those of a lidar.

const POINT_RADIUS = 1.8; // radius of a drawn point in CSS pixels

/**
 * Draws points, each given by its number, column and row.
 * @param {CanvasRenderingContext2D} context
 * @param {number[]} points
 * @param {{ left: number, top: number, zoom: number }} place
 * @param {(number: number) => string} color
 */
export function drawPoints(context, points, { left, top, zoom }, color) {
  for (let i = 0; i < points.length; i += 3) {
    const x = left + points[i + 1] * zoom, y = top + points[i + 2] * zoom;
    context.fillStyle = "#000";
    context.fillRect(x - POINT_RADIUS - 0.5, y - POINT_RADIUS - 0.5, 2 * POINT_RADIUS + 1, 2 * POINT_RADIUS + 1);
    context.fillStyle = color(points[i]);
    context.fillRect(x - POINT_RADIUS, y - POINT_RADIUS, 2 * POINT_RADIUS, 2 * POINT_RADIUS);
  }
}
