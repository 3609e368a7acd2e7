"""The viewer: pages that contain frames with their values, and live views of worlds in the browser."""
