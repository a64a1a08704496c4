"""OpenGL's functions by their names, for those few that moderngl lacks."""

import ctypes

from protocol.errors import Unavailable


def address_of(name: str) -> int:
    """Where one of OpenGL's functions is; it is called through ctypes, which lets Python's lock go meanwhile.

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
    address = egl.eglGetProcAddress(name.encode())
    if not address:
        raise Unavailable(f"this machine's EGL has no {name}; on Debian: apt install libgl1-mesa-dri")
    return int(address)
