"""Arrays of textures whose mipmaps are given: moderngl can only have them made, and in software that takes longer."""

import ctypes
from collections.abc import Sequence
from typing import TYPE_CHECKING

from protocol.arrays import UInt8Array
from render_worker.opengl.functions import address_of
from render_worker.textures import Levels

if TYPE_CHECKING:
    from moderngl import Context, TextureArray

_TEXTURE_2D_ARRAY, _RGBA8, _RGBA, _UNSIGNED_BYTE = 0x8C1A, 0x8058, 0x1908, 0x1401
"""As OpenGL's specification numbers them."""


class TextureArrays:
    """Uploads images of one size, each with its smaller levels, as one texture.

    Raises:
        Unavailable: this machine's OpenGL can't.
    """

    def __init__(self, context: "Context") -> None:
        self._context = context
        integer, count, address = ctypes.c_int, ctypes.c_uint, ctypes.c_void_p
        shape, layout = [integer] * 3, [count, count, address]
        self._bind = ctypes.CFUNCTYPE(None, count, count)(address_of("glBindTexture"))
        define = ctypes.CFUNCTYPE(None, count, integer, integer, *shape, integer, *layout)
        self._define = define(address_of("glTexImage3D"))
        write = ctypes.CFUNCTYPE(None, count, integer, *shape, *shape, *layout)
        self._write = write(address_of("glTexSubImage3D"))

    def make(self, images: Sequence[Levels]) -> "TextureArray":
        """The images (size, size, 4) of each level, from the largest to a single pixel."""
        import moderngl

        size = len(images[0][0])
        texture = self._context.texture_array((size, size, len(images)), 4)
        self._bind(_TEXTURE_2D_ARRAY, texture.glo)
        for level, of_level in enumerate(zip(*images, strict=True)):
            self._write_level(level, of_level)
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        return texture

    def _write_level(self, level: int, images: Sequence[UInt8Array]) -> None:
        kind, size = _TEXTURE_2D_ARRAY, len(images[0])
        self._define(kind, level, _RGBA8, size, size, len(images), 0, _RGBA, _UNSIGNED_BYTE, None)
        for number, image in enumerate(images):
            self._write(kind, level, 0, 0, number, size, size, 1, _RGBA, _UNSIGNED_BYTE, image.ctypes.data)
