"""Moving obstacles: a scene for each of several places of a path."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..errors import SceneError
from .ready import Built, Ready, make_ready
from .scene import Scene, no_scene
from .shapes import SHAPES

Scenes = Scene | Sequence[Scene] | Callable[[float], Scene]


def scenes_at(scene: Scenes | None, s: Sequence[float]) -> list[Scene]:
    """Return the scenes as a list: none for None, one for a single `Scene`, otherwise one for each s.

    Raises `SceneError` if there are more or fewer than s, or one of them is not a `Scene`.
    """
    if scene is None:
        return []
    if isinstance(scene, Scene):
        return [scene]
    if callable(scene):
        every = [scene(at) for at in s]
    elif isinstance(scene, Iterable) and not isinstance(scene, (str, bytes)):
        every = list(scene)
    else:
        raise no_scene(scene, "one Scene for all poses, a sequence of one for each, or a function s -> Scene")
    if any(isinstance(each, SHAPES) for each in every):
        raise no_scene(every, "one Scene for all poses, or one for each")
    if len(every) != len(s):
        wanted = f"one Scene by itself for all poses, or one for each of the {len(s)}"
        raise SceneError("scene", "number of scenes", len(every), wanted)
    for at, each in enumerate(every):
        if not isinstance(each, Scene):
            raise SceneError(f"scene[{at}]", "scene", each, "an armangle.Scene")
    return every


def ready_each(arm: Built, scenes: Iterable[Scene]) -> list[Ready]:
    """Return each scene prepared for an arm; what concerns the arm alone is computed once."""
    last, out = arm._ready, []
    for scene in scenes:
        last = arm._ready if scene is arm.scene and arm._ready is not None else make_ready(arm, scene, last)
        out.append(last)
    return out
