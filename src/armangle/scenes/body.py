"""What the links of an arm look like."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from .._arrays import JOINTS
from ..errors import SceneError
from .scene import as_shapes
from .shapes import RODS, Ball, Capsule, Shape, _length, _set


@dataclass(frozen=True)
class Body:
    """Balls and capsules that cover the links of an arm.

    Parameters
    ----------
    links : mapping of int to sequence of Ball or Capsule
        By DH frame 0..7, in which the shapes are given, m (`Arm.frames`): 3 is the upper arm, its y axis
        along it, 4 the forearm, its z axis along it. Radii > 0. Quickest are those of links 3 and 4, and of
        links 1, 2, 5 and 6 those centred on axis 1, 3, 5 or 7: the z axis of frames 2 and 6, the y axis of
        frames 1 and 5. A name of a shape names its link in results; without one it is "link_3".

    Raises
    ------
    SceneError

    See Also
    --------
    Body.bones : the two capsules along the bones.
    """

    links: tuple[tuple[int, tuple[Shape, ...]], ...]
    _bones: tuple[float, float, bool] | None = None

    def __init__(self, links: Mapping[int, Iterable[Ball | Capsule]]) -> None:
        if not isinstance(links, Mapping) or not links:
            wanted = "a mapping of at least one DH frame (0..7) to balls and capsules, as {4: [Ball(...)]}"
            raise SceneError("Body", "links", links, wanted)
        rows = []
        for frame, shapes in links.items():
            if isinstance(frame, bool) or not isinstance(frame, int) or not 0 <= frame <= JOINTS:
                raise SceneError("Body", "links", frame, f"a DH frame, an integer from 0 to {JOINTS}")
            listed = as_shapes(f"Body link {frame}", shapes, RODS)
            for at, shape in enumerate(listed):
                if isinstance(shape, Ball | Capsule) and shape.radius == 0:
                    raise SceneError(f"Body link {frame}", f"shapes[{at}]", shape, "a radius > 0 (m)")
            rows.append((frame, listed))
        _set(self, links=tuple(sorted(rows, key=lambda row: row[0])), _bones=None)

    @classmethod
    def bones(cls, upper_arm: float, forearm: float, *, plates: bool = False) -> Body:
        """Return a body of two capsules along the bones of whatever arm it is given to.

        Parameters
        ----------
        upper_arm : float
            Radius of the capsule on axis 3, from the shoulder to the foot of the elbow, d_se long; m, > 0.
        forearm : float
            Radius of that on axis 5, from its foot to the wrist, d_ew long; m, > 0.
        plates : bool
            With capsules of the same radii from those feet to the elbow's axis, where the elbow has offsets.

        Returns
        -------
        Body
            Its links are called "upper_arm" and "forearm".

        Raises
        ------
        SceneError
        """
        new = cls.__new__(cls)
        radii = (
            _length("Body.bones", "upper_arm", upper_arm, positive=True),
            _length("Body.bones", "forearm", forearm, positive=True),
        )
        if not isinstance(plates, bool):
            raise SceneError("Body.bones", "plates", plates, "True or False")
        _set(new, links=(), _bones=(*radii, plates))
        return new

    def __repr__(self) -> str:
        if self._bones is None:
            return f"Body({dict(self.links)!r})"
        upper_arm, forearm, plates = self._bones
        more = ", plates=True" if plates else ""
        return f"Body.bones(upper_arm={upper_arm!r}, forearm={forearm!r}{more})"

    def _shapes(
        self, d_se: float, d_ew: float, a_3: float, a_4: float, d_4: float
    ) -> list[tuple[int, Shape]]:
        """Return (DH frame, shape) of an arm with these lengths."""
        if self._bones is None:
            return [(frame, shape) for frame, shapes in self.links for shape in shapes]
        upper_arm, forearm, plates = self._bones
        foot = (-a_3, 0.0, 0.0)
        shapes: list[tuple[int, Shape]] = [
            (3, Capsule((-a_3, -d_se, 0.0), foot, upper_arm, name="upper_arm")),
            (4, Capsule((0.0, 0.0, 0.0), (0.0, 0.0, d_ew), forearm, name="forearm")),
        ]
        if plates and (a_3 or d_4):
            shapes.append((3, Capsule(foot, (0.0, 0.0, d_4), upper_arm, name="upper_arm")))
        if plates and a_4:
            shapes.append((4, Capsule((-a_4, 0.0, 0.0), (0.0, 0.0, 0.0), forearm, name="forearm")))
        return shapes
