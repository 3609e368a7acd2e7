"""The world in the viewer: navigation, edits, and lines drawn over the image."""
