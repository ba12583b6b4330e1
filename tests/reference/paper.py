"""Sections 3 and 4 of the paper and its examples, equation by equation: (1)-(24), (37)-(46).

Every function says exactly what the paper prints, slips included; a slip is named under
"Erratum". The one liberty: an arccos is kept within [-1, 1], which rounding may leave; not in Eqs. (4)
and (6). Angles are in radians and lengths in metres, joints are numbered 1 to 7. Sections 5 and 6, Eqs.
(25)-(36), are in ``paper_limits``. The paper is at hand without the opening of its section 3.2
and its list of cases in 5.1.1; no numbered equation is lost there.

Source: C. Faria, F. Ferreira, W. Erlhagen, S. Monteiro, E. Bicho, "Position-based kinematics
for 7-DoF serial manipulators with global configuration control, joint limit and singularity
avoidance", Mechanism and Machine Theory 121 (2018).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALPHA: Array = np.pi / 2 * np.array([-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0])
"""Link twists of Table 1, shape (7,), rad."""

THETA_START: Array = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
"""Joint angles of Eq. (37), shape (7,), rad (printed in degrees)."""

POSE_START: Array = np.array(
    [
        [-0.2634, -0.9112, -0.3166, -0.1174],
        [0.3014, -0.3895, 0.8703, -0.1464],
        [-0.9164, 0.1338, 0.3773, 1.0203],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""Pose of the joint angles (37), Eq. (38), shape (4, 4), printed to four decimals."""

POSE_GOAL: Array = np.array(
    [
        [-0.2634, -0.9112, -0.3166, -0.1966],
        [0.3014, -0.3895, 0.8703, 0.0712],
        [-0.9164, 0.1338, 0.3773, 1.1146],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""Pose (38) moved by 0.25 m along its own z axis, Eq. (39), shape (4, 4)."""


class Lengths(NamedTuple):
    """Link lengths of Table 1, m: base-shoulder, shoulder-elbow, elbow-wrist, wrist-flange."""

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float


IIWA7 = Lengths(0.34, 0.4, 0.4, 0.126)
"""Lengths of the paper's example, KUKA LBR iiwa 7 R800; from its data sheet, not printed."""


def link_transform(theta: float, alpha: float, a: float, d: float) -> Array:
    """Transform between neighbouring frames from classic DH parameters, Eq. (1), shape (4, 4)."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def chain_transforms(theta: Array, lengths: Lengths) -> list[Array]:
    """Transforms 0T0, 0T1, ..., 0T7, each (4, 4), as the product of Eq. (1) below Table 1."""
    offsets = [lengths.d_bs, 0.0, lengths.d_se, 0.0, lengths.d_ew, 0.0, lengths.d_wf]
    frames = [np.eye(4)]
    for angle, alpha, d in zip(theta, ALPHA, offsets, strict=True):
        frames.append(frames[-1] @ link_transform(float(angle), float(alpha), 0.0, d))
    return frames


def configuration_sign(theta_k: float) -> int:
    """Global configuration GC_k of joint k = 2, 4 or 6, +1 or -1, Eq. (2)."""
    return 1 if theta_k >= 0 else -1


def circle_centre_fraction() -> float:
    """Centre of the redundancy circle as a fraction of the way S to W, section 3.1.

    Erratum: "half the distance" holds only for d_se = d_ew.
    """
    return 0.5


def shoulder_wrist_vector(pose: Array, lengths: Lengths) -> Array:
    """Vector 2p6 from shoulder to wrist in base axes, m, shape (3,), Eq. (3)."""
    shoulder = np.array([0.0, 0.0, lengths.d_bs])
    flange = np.array([0.0, 0.0, lengths.d_wf])
    return np.asarray(pose[:3, 3] - shoulder - pose[:3, :3] @ flange)


def theta_4(p_26: Array, gc_4: int, lengths: Lengths) -> float:
    """Elbow angle of the virtual and the real arm, rad, Eq. (4).

    Ill-conditioned where the arm is stretched or folded: the arccos there turns a rounding
    error e of its argument into an angle of sqrt(2 e).
    """
    d_se, d_ew = lengths.d_se, lengths.d_ew
    return float(gc_4 * np.arccos((p_26 @ p_26 - d_se**2 - d_ew**2) / (2 * d_se * d_ew)))


def theta_1_virtual(p_26: Array, axis: Array) -> float:
    """Virtual shoulder azimuth, rad, Eq. (5).

    ``axis``, shape (3,), is printed as 0R1,z and called "the z axis of joint 1".
    Erratum: by the paper's nomenclature (third column of 0R1) it is (-sin, cos, 0) of theta_1;
    what is meant is the axis that joint 1 turns about, (0, 0, 1).
    """
    if np.linalg.norm(np.cross(p_26, axis)) > 0:
        return float(np.arctan2(p_26[1], p_26[0]))
    return 0.0


def phi(p_26: Array, lengths: Lengths) -> float:
    """Angle at the shoulder between shoulder-wrist and shoulder-elbow, rad, Eq. (6); NaN out of reach."""
    n = float(np.linalg.norm(p_26))
    d_se, d_ew = lengths.d_se, lengths.d_ew
    return float(np.arccos((d_se**2 + n**2 - d_ew**2) / (2 * d_se * n)))


def theta_2_virtual(p_26: Array, gc_4: int, lengths: Lengths) -> float:
    """theta_2 of the virtual arm (theta_3 = 0), rad, Eq. (7); p_26 from shoulder to wrist."""
    r = np.sqrt(p_26[0] ** 2 + p_26[1] ** 2)
    return float(np.arctan2(r, p_26[2]) + gc_4 * phi(p_26, lengths))


def virtual_frames(p_26: Array, gc_4: int, lengths: Lengths) -> list[Array]:
    """Frames 0T0, ..., 0T4 of the virtual arm (theta_3 = 0), Eqs. (4)-(7) into (1)."""
    axis_1 = np.array([0.0, 0.0, 1.0])
    theta = np.zeros(7)
    theta[0] = theta_1_virtual(p_26, axis_1)
    theta[1] = theta_2_virtual(p_26, gc_4, lengths)
    theta[3] = theta_4(p_26, gc_4, lengths)
    return chain_transforms(theta, lengths)[:5]


def sew_normal(shoulder: Array, elbow: Array, wrist: Array) -> Array:
    """Normal v_sew of the shoulder-elbow-wrist plane, not of unit length, Eqs. (8) and (9)."""
    upper, reach = elbow - shoulder, wrist - shoulder
    return np.cross(upper / np.linalg.norm(upper), reach / np.linalg.norm(reach))


def arm_angle_sign(v_virtual: Array, v_real: Array, p_26: Array) -> float:
    """Sign of the arm angle from the two unit normals, Eq. (10).

    Erratum: the normals are opposite at psi = pi, their cross product vanishes and so does
    the sign.
    """
    return float(np.sign(np.cross(v_virtual, v_real) @ p_26))


def arm_angle(v_virtual: Array, v_real: Array, p_26: Array) -> float:
    """Arm angle psi in [-pi, pi] from the two unit normals, rad, Eq. (11).

    Undefined on a straight arm, where (8) and (9) vanish, and 0 at psi = pi because of (10).
    """
    cosine = np.clip(v_virtual @ v_real, -1.0, 1.0)
    return arm_angle_sign(v_virtual, v_real, p_26) * float(np.arccos(cosine))


def forward(theta: Array, lengths: Lengths) -> tuple[Array, float, tuple[int, int, int]]:
    """Pose (4, 4), arm angle (rad) and (GC_2, GC_4, GC_6) of joint angles, Eqs. (1)-(11)."""
    frames = chain_transforms(theta, lengths)
    signs = tuple(configuration_sign(float(theta[k])) for k in (1, 3, 5))
    p_26 = shoulder_wrist_vector(frames[7], lengths)
    virtual_elbow = virtual_frames(p_26, signs[1], lengths)[4][:3, 3]
    shoulder, elbow, wrist = (frames[k][:3, 3] for k in (2, 4, 6))
    v_virtual = sew_normal(shoulder, virtual_elbow, wrist)
    v_real = sew_normal(shoulder, elbow, wrist)
    unit_virtual = v_virtual / np.linalg.norm(v_virtual)
    unit_real = v_real / np.linalg.norm(v_real)
    return frames[7], arm_angle(unit_virtual, unit_real, p_26), (signs[0], signs[1], signs[2])


def cross_matrix(v: Array) -> Array:
    """Cross-product matrix [v x] of the nomenclature, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def real_rotation(r_psi: Array, r_virtual: Array) -> Array:
    """Rotation 0R4 or 0R3 of the real arm from that of the virtual one, Eqs. (12) and (13)."""
    return r_psi @ r_virtual


def redundancy_rotation(p_26: Array, psi: float) -> Array:
    """Rotation by psi about the shoulder-wrist vector (Rodrigues), shape (3, 3), Eq. (14)."""
    k = cross_matrix(p_26 / np.linalg.norm(p_26))
    return np.asarray(np.eye(3) + np.sin(psi) * k + (1 - np.cos(psi)) * k @ k)


def shoulder_matrices(p_26: Array, r_03_virtual: Array) -> tuple[Array, Array, Array]:
    """Matrices A_s, B_s, C_s of 0R3 = A_s sin psi + B_s cos psi + C_s, Eq. (15).

    Erratum: C_s is printed as [w w] 0R3v, a column times a column, which is no matrix product.
    The transpose is supplied here (w w^T), or nothing could be computed.
    """
    w = p_26 / np.linalg.norm(p_26)
    k = cross_matrix(w)
    return k @ r_03_virtual, -(k @ k) @ r_03_virtual, np.outer(w, w) @ r_03_virtual


def shoulder_rotation_elements(theta: Array) -> Array:
    """Elements of 0R3 that Eq. (16) prints, NaN where it prints a star, shape (3, 3)."""
    (c1, c2, c3), (s1, s2, s3) = np.cos(theta[:3]), np.sin(theta[:3])
    star = np.nan
    return np.array([[star, c1 * s2, star], [star, s1 * s2, star], [-s2 * c3, c2, -s2 * s3]])


def theta_1(r_03: Array, gc_2: int) -> float:
    """Joint angle 1 from 0R3 = A_s sin psi + B_s cos psi + C_s, rad, Eq. (17)."""
    return float(np.arctan2(gc_2 * r_03[1, 1], gc_2 * r_03[0, 1]))


def theta_2(r_03: Array, gc_2: int) -> float:
    """Joint angle 2 from 0R3, rad, Eq. (18)."""
    return float(gc_2 * np.arccos(np.clip(r_03[2, 1], -1.0, 1.0)))


def theta_3(r_03: Array, gc_2: int) -> float:
    """Joint angle 3 from 0R3, rad, Eq. (19).

    Erratum: taken by itself it loses theta_1 + theta_3 as theta_2 goes to 0, and with it the
    pose.
    """
    return float(np.arctan2(gc_2 * -r_03[2, 2], gc_2 * -r_03[2, 0]))


def wrist_matrices(
    shoulder: tuple[Array, Array, Array], r_34: Array, r_07: Array
) -> tuple[Array, Array, Array]:
    """Matrices A_w, B_w, C_w of 4R7 = A_w sin psi + B_w cos psi + C_w, Eq. (20)."""
    a_s, b_s, c_s = shoulder
    return r_34.T @ a_s.T @ r_07, r_34.T @ b_s.T @ r_07, r_34.T @ c_s.T @ r_07


def wrist_rotation_elements(theta: Array) -> Array:
    """Elements of 4R7 that Eq. (21) prints, NaN where it prints a star, shape (3, 3)."""
    (c5, c6, c7), (s5, s6, s7) = np.cos(theta[4:]), np.sin(theta[4:])
    star = np.nan
    return np.array([[star, star, c5 * s6], [star, star, s5 * s6], [-s6 * c7, s6 * s7, c6]])


def theta_5(r_47: Array, gc_6: int) -> float:
    """Joint angle 5 from 4R7 = A_w sin psi + B_w cos psi + C_w, rad, Eq. (22)."""
    return float(np.arctan2(gc_6 * r_47[1, 2], gc_6 * r_47[0, 2]))


def theta_6(r_47: Array, gc_6: int) -> float:
    """Joint angle 6 from 4R7, rad, Eq. (23)."""
    return float(gc_6 * np.arccos(np.clip(r_47[2, 2], -1.0, 1.0)))


def theta_7(r_47: Array, gc_6: int) -> float:
    """Joint angle 7 from 4R7, rad, Eq. (24).

    Erratum: taken by itself it loses theta_5 + theta_7 as theta_6 goes to 0, as (19) does.
    """
    return float(np.arctan2(gc_6 * r_47[2, 1], gc_6 * -r_47[2, 0]))


def circle_matrices(
    pose: Array, gc_4: int, lengths: Lengths
) -> tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]:
    """Matrices (A_s, B_s, C_s) and (A_w, B_w, C_w) of a pose and elbow sign, Eqs. (15), (20)."""
    p_26 = shoulder_wrist_vector(pose, lengths)
    virtual = virtual_frames(p_26, gc_4, lengths)
    r_34 = link_transform(theta_4(p_26, gc_4, lengths), float(ALPHA[3]), 0.0, 0.0)[:3, :3]
    shoulder = shoulder_matrices(p_26, virtual[3][:3, :3])
    return shoulder, wrist_matrices(shoulder, r_34, pose[:3, :3])


def inverse(pose: Array, psi: float, gc: tuple[int, int, int], lengths: Lengths) -> Array:
    """Joint angles of a pose, arm angle and (GC_2, GC_4, GC_6), rad, shape (7,), section 4."""
    shoulder, wrist = circle_matrices(pose, gc[1], lengths)
    terms = np.sin(psi), np.cos(psi), 1.0
    r_03 = sum((m * t for m, t in zip(shoulder, terms, strict=True)), np.zeros((3, 3)))
    r_47 = sum((m * t for m, t in zip(wrist, terms, strict=True)), np.zeros((3, 3)))
    elbow = theta_4(shoulder_wrist_vector(pose, lengths), gc[1], lengths)
    upper = [theta_1(r_03, gc[0]), theta_2(r_03, gc[0]), theta_3(r_03, gc[0])]
    lower = [theta_5(r_47, gc[2]), theta_6(r_47, gc[2]), theta_7(r_47, gc[2])]
    return np.array([*upper, elbow, *lower])


def appendix_transforms(theta: Array, lengths: Lengths) -> list[Array]:
    """Transforms 0T1, 1T2, ..., 6T7 written out, each (4, 4), Eqs. (40)-(46)."""
    c1, c2, c3, c4, c5, c6, c7 = np.cos(theta)
    s1, s2, s3, s4, s5, s6, s7 = np.sin(theta)
    d_bs, d_se, d_ew, d_wf = lengths
    last = [0.0, 0.0, 0.0, 1.0]
    return [
        np.array([[c1, 0, -s1, 0], [s1, 0, c1, 0], [0, -1, 0, d_bs], last]),
        np.array([[c2, 0, s2, 0], [s2, 0, -c2, 0], [0, 1, 0, 0], last]),
        np.array([[c3, 0, s3, 0], [s3, 0, -c3, 0], [0, 1, 0, d_se], last]),
        np.array([[c4, 0, -s4, 0], [s4, 0, c4, 0], [0, -1, 0, 0], last]),
        np.array([[c5, 0, -s5, 0], [s5, 0, c5, 0], [0, -1, 0, d_ew], last]),
        np.array([[c6, 0, s6, 0], [s6, 0, -c6, 0], [0, 1, 0, 0], last]),
        np.array([[c7, -s7, 0, 0], [s7, c7, 0, 0], [0, 0, 1, d_wf], last]),
    ]
