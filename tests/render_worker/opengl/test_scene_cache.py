"""Which scenes are kept."""

from render_worker.opengl.scene_cache import SceneCache
from render_worker.scenes import sample_scene

ONE, TWO, THREE = (sample_scene(seed, "train") for seed in (1, 2, 3))


def test_the_scene_that_was_not_used_for_the_longest_drops_out():
    cache = SceneCache(kept=2)
    cache.put(ONE, "one")
    cache.put(TWO, "two")
    assert cache.get(ONE) == "one"
    cache.put(THREE, "three")
    assert [cache.get(scene) for scene in (ONE, TWO, THREE)] == ["one", None, "three"]


def test_a_scene_is_found_by_what_it_is():
    cache = SceneCache(kept=2)
    cache.put(ONE, "one")
    assert cache.get(sample_scene(1, "train")) == "one"


def test_nothing_is_kept_after_it_was_cleared():
    cache = SceneCache(kept=2)
    cache.put(ONE, "one")
    cache.clear()
    assert cache.get(ONE) is None
