"""Renders a scene as a camera sees it: `render(scene, camera) -> Frame`."""
