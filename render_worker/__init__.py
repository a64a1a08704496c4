"""Draws scenes: people of sixty identities in eight kinds of pose, as an RGB-D camera on a drone sees them."""

from render_worker.renderer import Renderer, open_renderer
from render_worker.scenes import sample_scene

__all__ = ["Renderer", "open_renderer", "sample_scene"]
