"""Waiting for OpenGL to draw, without keeping Python's lock.

moderngl holds the lock in every call. On llvmpipe nearly all of a frame is drawn when its pixels are first read, so the
worker's other thread could take no request and answer no ping for as long as a frame takes. A foreign function called
through ctypes lets the lock go: what is queued is drawn in `glFinish`, and reading then only copies.
"""

import ctypes
from collections.abc import Callable

from render_worker.opengl.functions import address_of


def finish_function() -> Callable[[], None]:
    """OpenGL's `glFinish` for the thread's current context.

    Raises:
        Unavailable: there is no EGL that knows it.
    """
    return ctypes.CFUNCTYPE(None)(address_of("glFinish"))
