"""The default renderer: OpenGL through EGL, on a GPU or on Mesa's llvmpipe."""

from render_worker.opengl.renderer import OpenGlRenderer

__all__ = ["OpenGlRenderer"]
