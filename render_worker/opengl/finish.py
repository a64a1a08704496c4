"""Waiting for OpenGL to draw, without keeping Python's lock.

moderngl holds the lock in every call. On llvmpipe nearly all of a frame is drawn when its pixels are first read, so the
worker's other thread could take no request and answer no ping for as long as a frame takes. A foreign function called
through ctypes lets the lock go: what is queued is drawn in `glFinish`, and reading then only copies.
"""

import ctypes
from collections.abc import Callable

from protocol.errors import Unavailable


def finish_function() -> Callable[[], None]:
    """OpenGL's `glFinish` for the thread's current context.

    Raises:
        Unavailable: there is no EGL that knows it.
    """
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError as error:
        raise Unavailable(
            f"no EGL on this machine ({error}); on Debian: apt install libegl1 libgl1 libgl1-mesa-dri"
        ) from error
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    address = egl.eglGetProcAddress(b"glFinish")
    if not address:
        raise Unavailable("this machine's EGL has no glFinish; on Debian: apt install libgl1-mesa-dri")
    return ctypes.CFUNCTYPE(None)(address)
