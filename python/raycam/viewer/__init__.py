"""The viewer: pages with frames and their values, and live views of worlds in the browser."""
