"""The compiled core; written by tools/stubs.py."""

from typing import Any

ISA: str
LEVELS: tuple[str, ...]
__version__: str

from collections.abc import Callable, Sequence
import enum
from typing import overload

import numpy
import numpy.typing


JOINTS: int = 7

CONFIGURATIONS: int = 8

ANGLE_TOLERANCE: float = 1e-09

ROTATION_TOLERANCE: float = 1e-06

UNIT_TOLERANCE: float = 1e-06

LARGEST_ANGLE: float = 1000000.0

LIKELY_DEGREES: float = 12.566370614359172

FARTHEST: float = 1000000000.0

LENGTH_LIMIT: float = 1000.0

ARC_CAPACITY: int = 32

MOST_MARGIN: float = 1.5

MAX_JOINT_STEP: float = 0.2

def exchange_progress(function: object | None) -> Any: ...

class Status(enum.IntEnum):
    OK = 0

    UNREACHABLE = 1

    FOLDED = 2

    ELBOW_LIMIT = 3

    ELBOW_MARGIN = 4

    LIMITS = 5

    OUTSIDE = 6

    JOINT_JUMP = 7

    WINDING_EXHAUSTED = 8

    VELOCITY_LIMIT = 9

    ACCELERATION_LIMIT = 10

    NOT_REACHED = 11

    BAD_INPUT = 12

    NOT_ALLOWED = 13

    POSE_BLOCKED = 14

    CLEARANCE = 15

    NEAR_SINGULAR = 16

    NO_CONVERGENCE = 17

    PARTIAL = 18

    NO_POSTURE = 19

    UNPROVEN = 20

    @property
    def solved(self) -> bool:
        """Whether the pose has a solution within all limits."""

    @property
    def sentence(self) -> str:
        """The outcome as one sentence."""

class Problem(enum.Enum):
    NONE = 0

    POSE_NOT_FINITE = 1

    POSE_LAST_ROW = 2

    POSE_NOT_ROTATION = 3

    POSE_REFLECTION = 4

    POSE_TOO_FAR = 5

    POSE_IN_MILLIMETRES = 6

    PSI_NOT_FINITE = 7

    GC_RANGE = 8

    JOINTS_NOT_FINITE = 9

    JOINTS_IN_DEGREES = 10

    UNREACHABLE = 11

    FOLDED = 12

    JOINT_LIMIT = 13

    STILL = 14

    ON_AXIS = 15

    NOT_UNIT = 16

    NEAR_SINGULAR = 17

    NO_CONVERGENCE = 18

    ON_END = 19

    NO_POSTURE = 20

    NO_DERIVATIVE = 21

def on_refusal(function: Callable[[Problem, str, tuple[int, ...], float], object]) -> None: ...

class Reference(enum.Enum):
    BASE = 0

    VECTOR = 1

    STEREOGRAPHIC = 2

class Orientation(enum.Enum):
    WXYZ = 0

    XYZW = 1

    RPY = 2

    ROTVEC = 3

def check_transforms(poses: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

def rotations_many(kind: Orientation, numbers: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], name: str) -> None: ...

class Arm:
    def __init__(self, lengths: numpy.typing.NDArray[numpy.float64], joint_map: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64], tool: numpy.typing.NDArray[numpy.float64], reference: Reference, vector: numpy.typing.NDArray[numpy.float64]) -> None: ...

    @property
    def reach(self) -> float: ...

    @property
    def inner_reach(self) -> float: ...

    def with_free_roll(self) -> Arm: ...

    @property
    def delta(self) -> float: ...

    @property
    def joint_middle(self) -> list[float]: ...

    def resting_links(self, rods: numpy.typing.NDArray[numpy.float64], link: numpy.typing.NDArray[numpy.int64]) -> None: ...

    def never_nearer_all(self, rods: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], cells: int) -> None: ...

    def proximity_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def widest_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], status: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def inverse_few(self, pose: object | None, psi: object | None, gc: object | None, limits: bool = False) -> Any: ...

    def check_poses(self, poses: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def check_joints(self, q: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def inverse_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], seed: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], limits: Enforce, unreachable: Enforce, threads: int, all_branches: bool = False) -> None: ...

    def forward_one(self, q: object | None) -> Any: ...

    def forward_many(self, q: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], nan: bool, threads: int) -> None: ...

    def frames_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def elbow_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def jacobian_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def theta_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def q_many(self, theta: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def correct_poses_many(self, poses: numpy.typing.NDArray[numpy.float64], precision: float) -> None: ...

    def limit_margin_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def psi_towards_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], wish: Wish, target: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], nan: bool, threads: int) -> None: ...

    def self_motion_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def inverse_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], nan: bool, threads: int) -> None: ...

    def inverse_pullback_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], by_q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def forward_pullback_many(self, q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], by_q: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def psi_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def nearest_pose(self, pose: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> float: ...

    def feasible_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, psi_margin: float, discriminant: float, wanted: Wanted, threads: int, scene: Scene | None) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def feasible_few(self, pose: object | None, gc: object | None, margin: object | None, psi_margin: object | None, discriminant: object | None, wanted: Wanted, threads: object | None, scene: Scene | None) -> ArcsOfFew: ...

    def joint_function(self, pose: numpy.typing.NDArray[numpy.float64], gc: int, joint: int) -> JointFunction: ...

    def step_one(self, q_now: object | None, pose: object | None, policy: Policy, gc: object | None, carry: object | None, max_joint_step: object | None, singularity_margin: object | None, dt: object | None, outside: object | None, allowed_count: object | None, allowed_psi: object | None, bounds: object | None, kind: object, statuses: object, scene: Scene | None) -> Any: ...

    def follow_all(self, start: numpy.typing.NDArray[numpy.float64], poses: numpy.typing.NDArray[numpy.float64], options: FollowOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, bounds: numpy.typing.NDArray[numpy.float64] | None, columns: tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]], scenes: Sequence[Scene]) -> None: ...

    def plan_path(self, segments: numpy.typing.NDArray[numpy.float64], rows: numpy.typing.NDArray[numpy.float64], start: numpy.typing.NDArray[numpy.float64] | None, goal: numpy.typing.NDArray[numpy.float64] | None, branches: int, weights: numpy.typing.NDArray[numpy.float64], singularity_margin: float, limit_margin: float, wish: Wish, wished: numpy.typing.NDArray[numpy.float64] | None, scenes: Sequence[Scene], allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, allowed_at: object | None, held_q_7: float, true_scene: Scene | None, threads: int) -> Any: ...

    def curve_at(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], branch: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], margin: numpy.typing.NDArray[numpy.float64], residual: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def curve_derivatives(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def rows_within(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def curve_through(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def certify_curve(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, singularity_margin: float, scene: Scene | None = None) -> tuple[Any, ...]: ...

    def explain_pose(self, segment: numpy.typing.NDArray[numpy.float64], singularity_margin: float) -> Any: ...

    def solve_few(self, pose: object | None, near: object | None, metric: Metric, kind: object, statuses: object) -> Any: ...

    def solve_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], distance: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int8], margin: numpy.typing.NDArray[numpy.float64], gap: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None) -> None: ...

    def solutions_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, threads: int, scene: Scene | None) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8]]: ...

    def solution_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64], options: SolveOptions, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def best_gradient_many(self, pose: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def freedom_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, widths: numpy.typing.NDArray[numpy.float64], codes: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def reachable_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def turns_many(self, pose: numpy.typing.NDArray[numpy.float64], turned: Turned, margin: float, threads: int) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def map_cells(self, places: numpy.typing.NDArray[numpy.float64], tilt: numpy.typing.NDArray[numpy.float64], turn: numpy.typing.NDArray[numpy.float64], size: numpy.typing.NDArray[numpy.float64], margin: float, gc: numpy.typing.NDArray[numpy.uint8], freedom: numpy.typing.NDArray[numpy.float32], yaw: numpy.typing.NDArray[numpy.uint8] | None, roll: numpy.typing.NDArray[numpy.uint8] | None, proven: numpy.typing.NDArray[numpy.uint8] | None, threads: int) -> None: ...

    def poses_of_reduced(self, coordinates: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def reduced_of_poses(self, pose: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def reduced_distances(self) -> tuple[float, float]: ...

    def place_many(self, pose: numpy.typing.NDArray[numpy.float64], weight: numpy.typing.NDArray[numpy.float64], position: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def freedom_gradient_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def end_slopes_one(self, pose: numpy.typing.NDArray[numpy.float64], gc: int, margin: float, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    @property
    def is_kuka(self) -> bool: ...

    def kuka_codes(self, q: numpy.typing.NDArray[numpy.float64], codes: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def kuka_inverse(self, pose: numpy.typing.NDArray[numpy.float64], e1: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int64], seed: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], outcome: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def kuka_share_turns(self, q: numpy.typing.NDArray[numpy.float64], seed: numpy.typing.NDArray[numpy.float64] | None, turn: int) -> bool: ...

    def kuka_e1_arcs(self, pose: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def keep(self, key: int) -> None: ...

class ChainArm:
    def __init__(self, lengths: numpy.typing.NDArray[numpy.float64], joint_map: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64], tool: numpy.typing.NDArray[numpy.float64], reference: Reference, vector: numpy.typing.NDArray[numpy.float64], chain: numpy.typing.NDArray[numpy.float64]) -> None: ...

    @property
    def reach(self) -> float: ...

    @property
    def inner_reach(self) -> float: ...

    @property
    def delta(self) -> float: ...

    @property
    def joint_middle(self) -> list[float]: ...

    @property
    def deviations(self) -> list[list[float]]: ...

    def inverse_few(self, pose: object | None, psi: object | None, gc: object | None, limits: bool = False) -> Any: ...

    def check_poses(self, poses: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def check_joints(self, q: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def inverse_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], seed: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], limits: Enforce, unreachable: Enforce, threads: int, all_branches: bool = False) -> None: ...

    def forward_one(self, q: object | None) -> Any: ...

    def forward_many(self, q: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], nan: bool, threads: int) -> None: ...

    def frames_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def elbow_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def jacobian_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def theta_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def q_many(self, theta: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def correct_poses_many(self, poses: numpy.typing.NDArray[numpy.float64], precision: float) -> None: ...

    def limit_margin_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def self_motion_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def feasible_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, wanted: Wanted, unproven: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None, left_out: bool = False) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def resting_links(self, rods: numpy.typing.NDArray[numpy.float64], link: numpy.typing.NDArray[numpy.int64]) -> None: ...

    def proximity_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def widest_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], status: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def freedom_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, widths: numpy.typing.NDArray[numpy.float64], codes: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def step_one(self, q_now: object | None, pose: object | None, policy: Policy, gc: object | None, carry: object | None, max_joint_step: object | None, singularity_margin: object | None, dt: object | None, outside: object | None, allowed_count: object | None, allowed_psi: object | None, bounds: object | None, kind: object, statuses: object, scene: Scene | None) -> Any: ...

    def follow_all(self, start: numpy.typing.NDArray[numpy.float64], poses: numpy.typing.NDArray[numpy.float64], options: FollowOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, bounds: numpy.typing.NDArray[numpy.float64] | None, columns: tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]], scenes: Sequence[Scene]) -> None: ...

    def plan_path(self, segments: numpy.typing.NDArray[numpy.float64], rows: numpy.typing.NDArray[numpy.float64], start: numpy.typing.NDArray[numpy.float64] | None, goal: numpy.typing.NDArray[numpy.float64] | None, branches: int, weights: numpy.typing.NDArray[numpy.float64], singularity_margin: float, limit_margin: float, wish: Wish, wished: numpy.typing.NDArray[numpy.float64] | None, scenes: Sequence[Scene], allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, allowed_at: object | None, held_q_7: float, true_scene: Scene | None, threads: int) -> Any: ...

    def curve_at(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], branch: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], margin: numpy.typing.NDArray[numpy.float64], residual: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def curve_derivatives(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def rows_within(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def curve_through(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def solve_few(self, pose: object | None, near: object | None, metric: Metric, kind: object, statuses: object) -> Any: ...

    def solve_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], distance: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int8], margin: numpy.typing.NDArray[numpy.float64], gap: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None) -> None: ...

    def solutions_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, threads: int, scene: Scene | None) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8]]: ...

class OffsetArm:
    def __init__(self, lengths: numpy.typing.NDArray[numpy.float64], joint_rows: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64], tool: numpy.typing.NDArray[numpy.float64], offset: float, mirrored: bool) -> None: ...

    def with_free_roll(self) -> OffsetArm: ...

    def step_one(self, q_now: object | None, pose: object | None, policy: Policy, gc: object | None, carry: object | None, max_joint_step: object | None, singularity_margin: object | None, dt: object | None, outside: object | None, allowed_count: object | None, allowed_psi: object | None, bounds: object | None, kind: object, statuses: object, scene: Scene | None) -> Any: ...

    def follow_all(self, start: numpy.typing.NDArray[numpy.float64], poses: numpy.typing.NDArray[numpy.float64], options: FollowOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, bounds: numpy.typing.NDArray[numpy.float64] | None, columns: tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]], scenes: Sequence[Scene]) -> None: ...

    def plan_path(self, segments: numpy.typing.NDArray[numpy.float64], rows: numpy.typing.NDArray[numpy.float64], start: numpy.typing.NDArray[numpy.float64] | None, goal: numpy.typing.NDArray[numpy.float64] | None, branches: int, weights: numpy.typing.NDArray[numpy.float64], singularity_margin: float, limit_margin: float, wish: Wish, wished: numpy.typing.NDArray[numpy.float64] | None, scenes: Sequence[Scene], allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, allowed_at: object | None, held_q_7: float, true_scene: Scene | None, threads: int) -> Any: ...

    def curve_at(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], branch: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], margin: numpy.typing.NDArray[numpy.float64], residual: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def curve_derivatives(self, segments: numpy.typing.NDArray[numpy.float64], stretches: numpy.typing.NDArray[numpy.float64], plane: numpy.typing.NDArray[numpy.float64], gc: int, roll_free: bool, shifts: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64] | None, s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def rows_within(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def rows_at(self, segments: numpy.typing.NDArray[numpy.float64], rows_s: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], rows_q: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], branch: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], margin: numpy.typing.NDArray[numpy.float64], residual: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def rows_derivatives(self, segments: numpy.typing.NDArray[numpy.float64], rows_s: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], rows_q: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def freedom_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, widths: numpy.typing.NDArray[numpy.float64], codes: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def reachable_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def turns_many(self, pose: numpy.typing.NDArray[numpy.float64], turned: Turned, margin: float, threads: int) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def map_cells(self, places: numpy.typing.NDArray[numpy.float64], tilt: numpy.typing.NDArray[numpy.float64], turn: numpy.typing.NDArray[numpy.float64], size: numpy.typing.NDArray[numpy.float64], margin: float, gc: numpy.typing.NDArray[numpy.uint8], freedom: numpy.typing.NDArray[numpy.float32], yaw: numpy.typing.NDArray[numpy.uint8] | None, roll: numpy.typing.NDArray[numpy.uint8] | None, proven: numpy.typing.NDArray[numpy.uint8] | None, threads: int) -> None: ...

    def poses_of_reduced(self, coordinates: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def reduced_of_poses(self, pose: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def reduced_distances(self) -> tuple[float, float]: ...

    def place_many(self, pose: numpy.typing.NDArray[numpy.float64], weight: numpy.typing.NDArray[numpy.float64], position: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def freedom_gradient_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def end_slopes_one(self, pose: numpy.typing.NDArray[numpy.float64], gc: int, margin: float, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def feasible_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, wanted: Wanted, unproven: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None, left_out: bool = False) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def psi_towards_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], wish: Wish, target: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], nan: bool, threads: int) -> None: ...

    def nearest_pose(self, pose: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> float: ...

    def correct_poses_many(self, poses: numpy.typing.NDArray[numpy.float64], precision: float) -> None: ...

    def theta_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def q_many(self, theta: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def jacobian_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def self_motion_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def inverse_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], nan: bool, threads: int) -> None: ...

    def inverse_pullback_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], by_q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def forward_pullback_many(self, q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], by_q: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def psi_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    @property
    def reach(self) -> float: ...

    @property
    def inner_reach(self) -> float: ...

    @property
    def delta(self) -> float: ...

    def resting_links(self, rods: numpy.typing.NDArray[numpy.float64], link: numpy.typing.NDArray[numpy.int64]) -> None: ...

    def proximity_many(self, scene: Scene, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def widest_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], status: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def solve_few(self, pose: object | None, near: object | None, metric: Metric, kind: object, statuses: object) -> Any: ...

    def solve_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], distance: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int8], margin: numpy.typing.NDArray[numpy.float64], gap: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None) -> None: ...

    def solutions_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, threads: int, scene: Scene | None) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8]]: ...

    def solution_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64], options: SolveOptions, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def check_poses(self, poses: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def check_joints(self, q: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def forward_many(self, q: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def frames_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def inverse_many(self, pose: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], seed: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], outcome: numpy.typing.NDArray[numpy.int64], limits: Enforce, threads: int) -> None: ...

    def keep(self, key: int) -> None: ...

class OffsetChain:
    def __init__(self, lengths: numpy.typing.NDArray[numpy.float64], joint_rows: numpy.typing.NDArray[numpy.float64], base: numpy.typing.NDArray[numpy.float64], tool: numpy.typing.NDArray[numpy.float64], offset: float, mirrored: bool, chain: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def step_one(self, q_now: object | None, pose: object | None, policy: Policy, gc: object | None, carry: object | None, max_joint_step: object | None, singularity_margin: object | None, dt: object | None, outside: object | None, allowed_count: object | None, allowed_psi: object | None, bounds: object | None, kind: object, statuses: object, scene: Scene | None) -> Any: ...

    def follow_all(self, start: numpy.typing.NDArray[numpy.float64], poses: numpy.typing.NDArray[numpy.float64], options: FollowOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, bounds: numpy.typing.NDArray[numpy.float64] | None, columns: tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]], scenes: Sequence[Scene]) -> None: ...

    def feasible_many(self, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, wanted: Wanted, unproven: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None, left_out: bool = False) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.int8], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8], object, object]: ...

    def correct_poses_many(self, poses: numpy.typing.NDArray[numpy.float64], precision: float) -> None: ...

    def theta_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def q_many(self, theta: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def limit_margin_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def jacobian_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def self_motion_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def inverse_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], nan: bool, threads: int) -> None: ...

    def inverse_pullback_many(self, pose: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], by_q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def forward_pullback_many(self, q: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64], by_psi: numpy.typing.NDArray[numpy.float64], by_q: numpy.typing.NDArray[numpy.float64], nan: bool) -> None: ...

    def psi_gradient_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    @property
    def reach(self) -> float: ...

    @property
    def inner_reach(self) -> float: ...

    @property
    def delta(self) -> float: ...

    def resting_links(self, rods: numpy.typing.NDArray[numpy.float64], link: numpy.typing.NDArray[numpy.int64]) -> None: ...

    def proximity_many(self, scene: Scene, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def widest_many(self, scene: Scene, pose: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], margin: float, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], pair: numpy.typing.NDArray[numpy.int64], status: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def freedom_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, widths: numpy.typing.NDArray[numpy.float64], codes: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def freedom_gradient_many(self, pose: numpy.typing.NDArray[numpy.float64], margin: float, out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def end_slopes_one(self, pose: numpy.typing.NDArray[numpy.float64], gc: int, margin: float, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def solve_few(self, pose: object | None, near: object | None, metric: Metric, kind: object, statuses: object) -> Any: ...

    def solve_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], distance: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int8], margin: numpy.typing.NDArray[numpy.float64], gap: numpy.typing.NDArray[numpy.float64], threads: int, scene: Scene | None) -> None: ...

    def solutions_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64] | None, options: SolveOptions, allowed_count: numpy.typing.NDArray[numpy.int64] | None, allowed_psi: numpy.typing.NDArray[numpy.float64] | None, threads: int, scene: Scene | None) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int8]]: ...

    def solution_derivative_many(self, pose: numpy.typing.NDArray[numpy.float64], near: numpy.typing.NDArray[numpy.float64], options: SolveOptions, q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def rows_within(self, segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64]) -> Any: ...

    def rows_at(self, segments: numpy.typing.NDArray[numpy.float64], rows_s: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], rows_q: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64], psi: numpy.typing.NDArray[numpy.float64], branch: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], margin: numpy.typing.NDArray[numpy.float64], residual: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def rows_derivatives(self, segments: numpy.typing.NDArray[numpy.float64], rows_s: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], rows_q: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def check_poses(self, poses: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def check_joints(self, q: numpy.typing.NDArray[numpy.float64], argument: str) -> None: ...

    def forward_many(self, q: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], threads: int) -> None: ...

    def frames_many(self, q: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], threads: int) -> None: ...

    def inverse_many(self, pose: numpy.typing.NDArray[numpy.float64], free: numpy.typing.NDArray[numpy.float64], gc: numpy.typing.NDArray[numpy.int64], seed: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], outcome: numpy.typing.NDArray[numpy.int64], limits: Enforce, threads: int) -> None: ...

    @property
    def deviations(self) -> list[list[float]]: ...

    def keep(self, key: int) -> None: ...

class SolidKind(enum.Enum):
    BALL = 0

    CAPSULE = 1

    BOX = 2

    HALF_SPACE = 3

    HULL = 4

    FIELD = 5

class Within(enum.Enum):
    USER = 0

    BASE = 1

    FLANGE = 2

    TOOL = 3

    POINTS = 4

MOST_PARTS: int = 64

MOST_LINKS: int = 254

MOST_OBSTACLES: int = 65000

class Scene:
    @overload
    def __init__(self, arm: ChainArm, solids: numpy.typing.NDArray[numpy.float64], first_base: int, first_held: int, cloud: numpy.typing.NDArray[numpy.float64], corners: numpy.typing.NDArray[numpy.float64], fields: numpy.typing.NDArray[numpy.float64], distances: numpy.typing.NDArray[numpy.float64], rods: numpy.typing.NDArray[numpy.float64], ignored: numpy.typing.NDArray[numpy.int8], apart: numpy.typing.NDArray[numpy.float64], own: numpy.typing.NDArray[numpy.int64], clearance: float, soft: float) -> None: ...

    @overload
    def __init__(self, arm: OffsetArm, solids: numpy.typing.NDArray[numpy.float64], first_base: int, first_held: int, cloud: numpy.typing.NDArray[numpy.float64], corners: numpy.typing.NDArray[numpy.float64], fields: numpy.typing.NDArray[numpy.float64], distances: numpy.typing.NDArray[numpy.float64], rods: numpy.typing.NDArray[numpy.float64], ignored: numpy.typing.NDArray[numpy.int8], apart: numpy.typing.NDArray[numpy.float64], own: numpy.typing.NDArray[numpy.int64], clearance: float, soft: float) -> None: ...

    @overload
    def __init__(self, arm: OffsetChain, solids: numpy.typing.NDArray[numpy.float64], first_base: int, first_held: int, cloud: numpy.typing.NDArray[numpy.float64], corners: numpy.typing.NDArray[numpy.float64], fields: numpy.typing.NDArray[numpy.float64], distances: numpy.typing.NDArray[numpy.float64], rods: numpy.typing.NDArray[numpy.float64], ignored: numpy.typing.NDArray[numpy.int8], apart: numpy.typing.NDArray[numpy.float64], own: numpy.typing.NDArray[numpy.int64], clearance: float, soft: float) -> None: ...

    @overload
    def __init__(self, arm: Arm, solids: numpy.typing.NDArray[numpy.float64], first_base: int, first_held: int, cloud: numpy.typing.NDArray[numpy.float64], corners: numpy.typing.NDArray[numpy.float64], fields: numpy.typing.NDArray[numpy.float64], distances: numpy.typing.NDArray[numpy.float64], rods: numpy.typing.NDArray[numpy.float64], ignored: numpy.typing.NDArray[numpy.int8], apart: numpy.typing.NDArray[numpy.float64], own: numpy.typing.NDArray[numpy.int64], clearance: float, soft: float) -> None: ...

    def always_near(self, arm: Arm) -> tuple[Any, ...]: ...

class Enforce(enum.Enum):
    IGNORE = 0

    RAISE = 1

    NAN = 2

class Wish(enum.Enum):
    PSI = 0

    POINT = 1

    DIRECTION = 2

def pose_gradient_many(pose: numpy.typing.NDArray[numpy.float64], by_twist: numpy.typing.NDArray[numpy.float64], by_pose: numpy.typing.NDArray[numpy.float64]) -> None: ...

class Side(enum.Enum):
    NONE = 0

    LOWER = 1

    UPPER = 2

    USER = 3

    NEAR_MARGIN = 4

    FAR_MARGIN = 5

    NEAR_SINGULAR = 6

    FAR_SINGULAR = 7

    OBSTACLE = 8

    UNPROVEN = 9

class Wanted(enum.Enum):
    BRANCH = 0

    JOINTS = 1

    BRANCHES = 2

    CLEAR = 3

    SOFT = 4

class SetOperation(enum.Enum):
    INTERSECTION = 0

    UNION = 1

    COMPLEMENT = 2

class Case(enum.Enum):
    STATIONARY = 0

    MONOTONIC = 1

    SINGULAR = 2

    CONSTANT = 3

class ArcsOfFew:
    @property
    def rows(self) -> int: ...

    def column(self, index: int) -> Any: ...

class JointFunction:
    def value(self, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def derivative(self, psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

    @property
    def stationary(self) -> list[float]: ...

    @property
    def singular(self) -> list[float]: ...

    @property
    def kind(self) -> Case: ...

def arcs_from(count: numpy.typing.NDArray[numpy.int64], psi: numpy.typing.NDArray[numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]: ...

def combine(operation: SetOperation, count_a: numpy.typing.NDArray[numpy.int64], psi_a: numpy.typing.NDArray[numpy.float64], index_a: numpy.typing.NDArray[numpy.int64], count_b: numpy.typing.NDArray[numpy.int64], psi_b: numpy.typing.NDArray[numpy.float64], index_b: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.int64]]: ...

def query(count: numpy.typing.NDArray[numpy.int64], psi_arcs: numpy.typing.NDArray[numpy.float64], index: numpy.typing.NDArray[numpy.int64], psi: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64], nearest: bool) -> None: ...

class Rule(enum.Enum):
    REPULSION = 0

    HOLD = 1

    CENTRE = 2

    TOWARDS = 3

class Outside(enum.Enum):
    NEAREST = 0

    STOP = 1

    ESCAPE = 2

class Carry(enum.Enum):
    PSI = 0

    ELBOW = 1

class OnFail(enum.Enum):
    STOP = 0

    HOLD = 1

    SKIP = 2

class Policy:
    def __init__(self, rule: Rule, K: float, alpha: float, outside: Outside) -> None: ...

    @staticmethod
    def towards(wish: Wish, psi: float, target: numpy.typing.NDArray[numpy.float64], K: float, outside: Outside) -> Policy: ...

class FollowOptions:
    def __init__(self, policy: Policy, gc: int | None, carry: Carry, max_joint_step: float | None, singularity_margin: float, dt: float | None, nearest: bool, on_fail: OnFail, lookahead: int) -> None: ...

LONGEST_STEP: float = 1000000000.0

def resolve_many(policy: Policy, count: numpy.typing.NDArray[numpy.int64], psi_arcs: numpy.typing.NDArray[numpy.float64], kept_count: numpy.typing.NDArray[numpy.int64] | None, kept_arcs: numpy.typing.NDArray[numpy.float64] | None, index: numpy.typing.NDArray[numpy.int64], psi: numpy.typing.NDArray[numpy.float64], wish: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64], status: numpy.typing.NDArray[numpy.int8]) -> None: ...

def gain(rate: float, dt: float) -> float: ...

class Verdict(enum.IntEnum):
    OK = 0

    UNREACHABLE = 1

    IMPOSSIBLE = 2

    DEAD_END = 3

    START = 4

    GOAL = 5

    UNRESOLVED = 6

SEGMENT_WIDTH: int = 44

STRETCH_WIDTH: int = 25

def path_waypoints(poses: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

def path_line(start: numpy.typing.NDArray[numpy.float64], end: numpy.typing.NDArray[numpy.float64], fixed: bool, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

def path_screw(start: numpy.typing.NDArray[numpy.float64], point: numpy.typing.NDArray[numpy.float64], direction: numpy.typing.NDArray[numpy.float64], angle: float, advance: float, carried: bool, end: numpy.typing.NDArray[numpy.float64] | None, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

def arc_through(start: numpy.typing.NDArray[numpy.float64], via: numpy.typing.NDArray[numpy.float64], end: numpy.typing.NDArray[numpy.float64]) -> tuple[Any, ...]: ...

def path_gap(segments: numpy.typing.NDArray[numpy.float64]) -> tuple[Any, ...]: ...

def path_joined(segments: numpy.typing.NDArray[numpy.float64], radius: numpy.typing.NDArray[numpy.float64]) -> tuple[Any, ...]: ...

def path_rolled(segments: numpy.typing.NDArray[numpy.float64], roll: float, rate: float, out: numpy.typing.NDArray[numpy.float64]) -> None: ...

RADIAN: float = 0.2

def path_poses(segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

def path_derivatives(segments: numpy.typing.NDArray[numpy.float64], s: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

def interval_many(operation: int, a: numpy.typing.NDArray[numpy.float64], b: numpy.typing.NDArray[numpy.float64], out: numpy.typing.NDArray[numpy.float64]) -> None: ...

class Metric(enum.Enum):
    L2 = 0

    MAX = 1

    MARGIN = 2

class SolveOptions:
    def __init__(self, metric: Metric, weight: numpy.typing.NDArray[numpy.float64], branches: int, margin: float, length: float) -> None: ...

class Tracking(enum.IntEnum):
    FOLLOWING = 0

    LAGGING = 1

    NEAREST = 2

    HELD = 3

    TURNING = 4

    RETURNING = 5

def smooth_hand(omega: float, patience: float, jump: float, turn: float, samples: numpy.typing.NDArray[numpy.float64], dt: float, poses: numpy.typing.NDArray[numpy.float64]) -> None: ...

class Tracker:
    def __init__(self, arm: Arm, numbers: numpy.typing.NDArray[numpy.float64], scene: Scene | None) -> None: ...

    def nearest_pair(self, reach: float) -> tuple[Any, ...]: ...

    @property
    def q(self) -> Any: ...

    @property
    def saved_size(self) -> int: ...

    def save(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def restore(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def look_again(self) -> None: ...

    def start(self, q: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def step_hand(self, pose: object | None, names: object) -> Any: ...

    def step_one(self, pose: object | None, names: object, elbow: object | None, wish: Wish, dt: float, reconfigure: int) -> Any: ...

    def run(self, poses: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64]) -> None: ...

class ChainTracker:
    def __init__(self, arm: ChainArm, numbers: numpy.typing.NDArray[numpy.float64], nominal: Scene | None, scene: Scene | None) -> None: ...

    def nearest_pair(self, reach: float) -> tuple[Any, ...]: ...

    @property
    def q(self) -> Any: ...

    @property
    def saved_size(self) -> int: ...

    def save(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def restore(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def look_again(self) -> None: ...

    def start(self, q: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def step_hand(self, pose: object | None, names: object) -> Any: ...

    def step_one(self, pose: object | None, names: object, elbow: object | None, wish: Wish, dt: float, reconfigure: int) -> Any: ...

    def run(self, poses: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64]) -> None: ...

class OffsetTracker:
    def __init__(self, arm: OffsetArm, numbers: numpy.typing.NDArray[numpy.float64], nominal: Scene | None, scene: Scene | None) -> None: ...

    def nearest_pair(self, reach: float) -> tuple[Any, ...]: ...

    @property
    def q(self) -> Any: ...

    @property
    def saved_size(self) -> int: ...

    def save(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def restore(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def look_again(self) -> None: ...

    def start(self, q: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def step_hand(self, pose: object | None, names: object) -> Any: ...

    def step_one(self, pose: object | None, names: object, elbow: object | None, wish: Wish, dt: float, reconfigure: int) -> Any: ...

    def run(self, poses: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64]) -> None: ...

class OffsetChainTracker:
    def __init__(self, arm: OffsetChain, numbers: numpy.typing.NDArray[numpy.float64], nominal: Scene | None, scene: Scene | None) -> None: ...

    def nearest_pair(self, reach: float) -> tuple[Any, ...]: ...

    @property
    def q(self) -> Any: ...

    @property
    def saved_size(self) -> int: ...

    def save(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def restore(self, numbers: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def look_again(self) -> None: ...

    def start(self, q: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def step_hand(self, pose: object | None, names: object) -> Any: ...

    def step_one(self, pose: object | None, names: object, elbow: object | None, wish: Wish, dt: float, reconfigure: int) -> Any: ...

    def run(self, poses: numpy.typing.NDArray[numpy.float64], q: numpy.typing.NDArray[numpy.float64]) -> None: ...

class Turned(enum.Enum):
    BASE = 0

    TOOL = 1

def xla_targets() -> dict[str, object]: ...
