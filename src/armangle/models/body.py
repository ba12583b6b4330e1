"""Collision models of an arm's links."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING

from .._arrays import JOINTS
from .._values import fill
from ..errors import SceneError
from ..scenes.ready import Lengths
from ..scenes.scene import Pairs, as_pairs, as_shapes
from ..scenes.shapes import RODS, Ball, Capsule, Shape, _length, _thin

if TYPE_CHECKING:
    from .collision import Covered
    from .cover import Rod
    from .urdf import Source

MOST_SHAPES = 32
BARE = "nothing covers what is beyond the wrist, the flange and the tool"
_BARE = f"{BARE}: arm.with_(hand=...) does"
_THICKNESS = (
    0.24  # of the mean of both bones: 96 mm for an iiwa 7, whose links lie within 95 mm of axes 2 to 5
)


def _most_shapes(shapes: int) -> int:
    """Return the largest number of rods for one shape; raise unless it is an integer in range."""
    if isinstance(shapes, bool) or not isinstance(shapes, int) or not 1 <= shapes <= MOST_SHAPES:
        raise SceneError("Body", "shapes", shapes, f"an integer from 1 to {MOST_SHAPES}")
    return shapes


def _flag(owner: str, name: str, value: bool) -> bool:
    """Return `value`; raise, with owner and name, unless it is True or False."""
    if not isinstance(value, bool):
        raise SceneError(owner, name, value, "True or False")
    return value


def as_shape(name: str, rod: Rod) -> Ball | Capsule:
    """Return a rod as a named capsule, or as a ball if its ends coincide."""
    if (rod.begin == rod.end).all():
        return Ball(rod.begin, rod.radius, name=name)
    return Capsule(rod.begin, rod.end, rod.radius, name=name)


@dataclass(frozen=True)
class Body:
    """Collision model: balls and capsules that cover the links of an arm.

    Parameters
    ----------
    links : mapping of int to sequence of Ball or Capsule
        By DH frame 0..7, in which the shapes are given, m (`Arm.frames`): 3 is the upper arm, along its y
        axis, 4 the forearm, along its z axis. Radii > 0. The fastest shapes are those of links 3 and 4, and
        those of links 1, 2, 5 and 6 centred on axis 1, 3, 5 or 7: the z axis of frames 2 and 6, the y axis of
        frames 1 and 5. A shape's name names its link in results; the default is "link_3".
    ignore : iterable of (str, str), optional
        Pairs of link names that are not tested against each other.

    Attributes
    ----------
    notes : tuple of str
        Parts of the file that were left out, or why the model is not trusted.
    trusted : bool
        Whether its shapes are given or read; False if radii are guessed from lengths
        (``Arm(body="guessed")``).

    Raises
    ------
    SceneError

    See Also
    --------
    Body.bones : the two capsules along the bones.
    Body.from_urdf, Body.from_mjcf : covers of a robot file's collision shapes.
    """

    links: tuple[tuple[int, tuple[Shape, ...]], ...]
    ignore: Pairs = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    trusted: bool = field(default=True, compare=False)
    _bones: tuple[float, float, bool] | None = None

    def __init__(
        self, links: Mapping[int, Iterable[Ball | Capsule]], *, ignore: Iterable[tuple[str, str]] = ()
    ) -> None:
        """Check the shapes of each DH frame 0..7 and keep them, frames in order."""
        if not isinstance(links, Mapping) or not links:
            wanted = "a mapping of at least one DH frame (0..7) to balls and capsules, as {4: [Ball(...)]}"
            raise SceneError("Body", "links", links, wanted)
        rows = []
        for frame, shapes in links.items():
            if isinstance(frame, bool) or not isinstance(frame, int) or not 0 <= frame <= JOINTS:
                raise SceneError("Body", "links", frame, f"a DH frame, an integer from 0 to {JOINTS}")
            listed = as_shapes(f"Body link {frame}", shapes, RODS)
            for at, shape in enumerate(listed):
                assert isinstance(shape, Ball | Capsule)
                if shape.radius == 0:
                    raise SceneError(f"Body link {frame}", f"shapes[{at}]", shape, "a radius > 0 (m)")
                _thin(f"Body link {frame}", f"shapes[{at}].radius", shape.radius)
            rows.append((frame, listed))
        fill(self, links=tuple(sorted(rows, key=lambda row: row[0])), _bones=None)
        fill(self, ignore=as_pairs(ignore, "Body", "pairs of names of links"), notes=(), trusted=True)

    @classmethod
    def from_urdf(
        cls,
        source: Source,
        base: str | None = None,
        tip: str | None = None,
        *,
        shapes: int = 6,
        hulls: bool = False,
    ) -> Body:
        """Return balls and capsules that contain every ``<collision>`` of the links from base to tip.

        They are fixed to the frames of the arm from `Arm.from_urdf`. Boxes, cylinders and closed meshes lie
        within them completely: each piece of the surface lies within one of them, and they are convex (docs:
        background/feasible). Needs the extra ``view`` if the file has meshes.

        Parameters
        ----------
        source : path or str or bytes
            A URDF file, or its XML text.
        base, tip : str, optional
            As for `Arm.from_urdf`; shapes of links fixed to them count too.
        shapes : int
            Largest number for one box, cylinder or mesh, 1 to 32: more fit more closely.
        hulls : bool
            Replace meshes that are not closed by their convex hull; otherwise they raise an error. Needs the
            extra ``time``.

        Returns
        -------
        Body
            Its links have the names of the file. `notes` list what was left out: links with joints of their
            own. `ignore` lists pairs of links whose covers overlap in all of 200 random configurations:
            sampled, not proven.

        Raises
        ------
        SceneError
            With link and mesh: not found, not closed, far larger than the arm (in mm?), or without any shape.
        ModelError
            As `Arm.from_urdf`.
        """
        from .collision import cover_urdf

        most, flag = _most_shapes(shapes), _flag("Body.from_urdf", "hulls", hulls)
        return cls._from_covered(cover_urdf(source, base, tip, most, flag))

    @classmethod
    def from_mjcf(
        cls,
        source: str | PathLike[str],
        base: str | None = None,
        tip: str | None = None,
        *,
        shapes: int = 6,
    ) -> Body:
        """Return balls and capsules that contain every colliding geom of a MuJoCo model's bodies.

        As `from_urdf`; a mesh is its convex hull, an ellipsoid the box around it. Needs the extra ``mujoco``.

        Parameters
        ----------
        source : path or str
            A file, or the XML text itself.
        base, tip : str, optional
            As for `Arm.from_mjcf`.
        shapes : int
            Largest number for one box, cylinder, ellipsoid or mesh, 1 to 32.

        Returns
        -------
        Body

        Raises
        ------
        SceneError
        MissingExtraError, ModelError
            As `Arm.from_mjcf`.
        """
        from .collision import cover_mjcf

        return cls._from_covered(cover_mjcf(source, base, tip, _most_shapes(shapes)))

    @classmethod
    def _from_covered(cls, covered: Covered) -> Body:
        """Return the collision model of covered links."""
        links = {frame: [as_shape(name, rod) for name, rod in rods] for frame, rods in covered.links.items()}
        new = cls(links, ignore=covered.ignore)
        fill(new, notes=tuple(covered.notes))
        return new

    @classmethod
    def bones(cls, upper_arm: float, forearm: float, *, plates: bool = False) -> Body:
        """Return a collision model of two capsules along the bones of the arm that uses it.

        Parameters
        ----------
        upper_arm : float
            Radius of the capsule on axis 3, from the shoulder to the foot of the elbow, d_se long; m, > 0.
        forearm : float
            Radius of the capsule on axis 5, from its foot to the wrist, d_ew long; m, > 0.
        plates : bool
            Adds capsules of the same radii from those feet to the elbow's axis if the elbow has offsets.

        Returns
        -------
        Body
            Its links are called "upper_arm" and "forearm". Nothing covers the wrist, the flange and the tool,
            as its note says: use ``arm.with_(hand=...)``.

        Raises
        ------
        SceneError
        """
        new = cls.__new__(cls)
        radii = (
            _length("Body.bones", "upper_arm", upper_arm, positive=True),
            _length("Body.bones", "forearm", forearm, positive=True),
        )
        for name, radius in zip(("upper_arm", "forearm"), radii, strict=True):
            _thin("Body.bones", name, radius)
        _flag("Body.bones", "plates", plates)
        fill(new, links=(), ignore=(), notes=(_BARE,), trusted=True, _bones=(*radii, plates))
        return new

    @classmethod
    def _guessed(cls, d_se: float, d_ew: float) -> Body:
        """Return a collision model of bones and plates guessed from the lengths (m) of the arm."""
        radius = round(_THICKNESS * 0.5 * (d_se + d_ew), 4)
        new = cls.bones(radius, radius, plates=True)
        why = f"{_THICKNESS:g} of the mean of d_se and d_ew, not measured: not trusted"
        fill(new, notes=(f"radii of {1e3 * radius:g} mm are {why}", _BARE), trusted=False)
        return new

    def __repr__(self) -> str:
        if self._bones is None:
            more = f", ignore={self.ignore!r}" if self.ignore else ""
            return f"Body({dict(self.links)!r}{more})"
        upper_arm, forearm, plates = self._bones
        more = ", plates=True" if plates else ""
        return f"Body.bones(upper_arm={upper_arm!r}, forearm={forearm!r}{more})"

    def _shapes(self, lengths: Lengths) -> list[tuple[int, Shape]]:
        """Return all shapes with their DH frames, for an arm with these lengths (m)."""
        if self._bones is None:
            return [(frame, shape) for frame, shapes in self.links for shape in shapes]
        upper_arm, forearm, plates = self._bones
        foot = (-lengths.a_3, 0.0, 0.0)
        shapes: list[tuple[int, Shape]] = [
            (3, Capsule((-lengths.a_3, -lengths.d_se, 0.0), foot, upper_arm, name="upper_arm")),
            (4, Capsule((0.0, 0.0, 0.0), (0.0, 0.0, lengths.d_ew), forearm, name="forearm")),
        ]
        if plates and (lengths.a_3 or lengths.d_4):
            shapes.append((3, Capsule(foot, (0.0, 0.0, lengths.d_4), upper_arm, name="upper_arm")))
        if plates and lengths.a_4:
            shapes.append((4, Capsule((-lengths.a_4, 0.0, 0.0), (0.0, 0.0, 0.0), forearm, name="forearm")))
        return shapes
