"""The scenes used last, as OpenGL has them."""

from collections import OrderedDict

from protocol.scene import Scene
from render_worker.opengl.staging import Staged


class SceneCache:
    """Keeps the scenes used last; the context's own collection frees those that drop out.

    Not for several threads at once: the thread that draws holds the renderer's lock.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._scenes: OrderedDict[Scene, Staged] = OrderedDict()

    def get(self, scene: Scene) -> Staged | None:
        """A kept scene; it is then the one used last."""
        staged = self._scenes.get(scene)
        if staged is not None:
            self._scenes.move_to_end(scene)
        return staged

    def put(self, scene: Scene, staged: Staged) -> None:
        """Keep a scene in place of the least recently used one."""
        self._scenes[scene] = staged
        self._scenes.move_to_end(scene)
        while len(self._scenes) > self._kept:
            self._scenes.popitem(last=False)

    def clear(self) -> None:
        """Keep none."""
        self._scenes.clear()
