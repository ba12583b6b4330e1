"""
09. A hand, a tracker, and physics
==================================

A position controller lags behind its command, in MuJoCo too. With the joints' velocities, and the torques
that hold the arm up, added to the command it does not: ``ctrl = q + (kv / kp) * velocity + bias / kp``.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import armangle as aa

KP, KV, DT = 2000.0, 200.0, 0.004
JOINTS = [("0 0 .15", "0 0 1", 6), ("0 0 .21", "0 1 0", 5), ("0 0 .21", "0 0 1", 4), ("0 0 .21", "0 -1 0", 4),
          ("0 0 .2", "0 0 1", 3), ("0 0 .2", "0 1 0", 2), ("0 0 .08", "0 0 1", 1)]  # fmt: skip
BODIES = "".join(
    f'<body name="link{k}" pos="{place}"><joint name="j{k}" axis="{axis}" range="-120 120" armature=".1"/>'
    f'<geom type="capsule" fromto="0 0 0 0 0 .1" size=".05" mass="{mass}" contype="0" conaffinity="0"/>'
    for k, (place, axis, mass) in enumerate(JOINTS, start=1)
)
XML = f"""<mujoco><compiler angle="degree"/><option timestep="{DT / 2}" integrator="implicitfast"/>
<worldbody>{BODIES}<site name="tool" pos="0 0 .1"/>{"</body>" * 7}</worldbody><actuator>
{"".join(f'<position joint="j{k}" kp="{KP}" kv="{KV}"/>' for k in range(1, 8))}</actuator></mujoco>"""

arm = aa.Arm.from_mjcf(XML, tip="tool").with_(velocity=np.full(7, 2.0))
model = mujoco.MjModel.from_xml_string(XML)
q0 = np.radians([10.0, 40.0, 20.0, 80.0, 10.0, 60.0, 0.0])


def hand(t: float) -> np.ndarray:
    """A hand that begins at rest and goes round an eight, 16 by 12 cm, tilting."""
    angle = 2 * np.pi * t**2 / (t + 1) / 4
    pose = arm.forward(q0)[0] @ aa.pose([0.0, 0.0, 0.0], rpy=[0.0, 0.2 * np.sin(angle), 0.0])
    pose[:3, 3] += [0.0, 0.08 * np.sin(angle), 0.06 * np.sin(2 * angle)]
    return pose


def run(feed_velocity: bool) -> np.ndarray:
    """Distance of the simulated tip from the hand at every tick, m."""
    data, tracker, away = mujoco.MjData(model), aa.Tracker(arm, dt=DT), []
    data.qpos = q0
    tracker.start(q0)
    for tick in range(1, 2001):
        now = tracker.step(hand(tick * DT))
        mujoco.mj_forward(model, data)
        data.ctrl = now.q + feed_velocity * KV / KP * now.velocity + data.qfrc_bias / KP
        mujoco.mj_step(model, data, 2)
        mujoco.mj_kinematics(model, data)
        away.append(np.linalg.norm(data.site("tool").xpos - hand(tick * DT)[:3, 3]))
    return np.array(away)


runs = {"q alone": run(False), "q and velocity": run(True)}
for name, away in runs.items():
    plt.plot(DT * np.arange(1, len(away) + 1), 1e3 * away, label=name)
    print(f"{name}: {1e3 * away.max():.2f} mm at most")
plt.gca().set(xlabel="time (s)", ylabel="tip from hand (mm)", yscale="log", title="closed loop")
plt.legend()
