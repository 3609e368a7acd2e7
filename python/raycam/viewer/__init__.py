"""The viewer: frames as pages that carry their numbers, and worlds seen live in the browser."""
